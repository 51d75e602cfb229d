/* SPDX-License-Identifier: GPL-2.0-only

   Fix nve/evp: (M + h C) v+ = M v + h F by conjugate gradients, matrix free, over all processes. */

#include "fix_nve_evp.h"

#include "lammps_compat.h"
#include "pair_evp_lj.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;

static constexpr double ROUND_OFF = 4.0 * std::numeric_limits<double>::epsilon();

/* ----------------------------------------------------------------------
   x is that of the force evaluation here; later it may not be, so u is kept
------------------------------------------------------------------------- */

void FixNVEEVP::collect_dampers()
{
  dampers.clear();
  damper_rows.clear();
  if (!pair->damps_implicitly()) return;
  const auto x = reinterpret_cast<const double(*)[3]>(atom->x[0]);
  const EVP::PackedList &list = pair->packed_pairs();
  if (list.build != last_build) last_force.assign(list.pairs.size(), 0.0);
  last_build = list.build;
  for (const auto &row : list.rows) {
    const int first = (int) dampers.size();
    for (int k = row.first; k < row.last; k++) {
      const EVP::PackedPair &p = list.pairs[k];
      const double gamma = pair->implicit_gamma(p);
      if (gamma == 0.0) continue;
      const EVP::PairGeometry g(x, row.i, p.j);
      if (g.dsq > p.cutsq) continue;

      for (const int i : {row.i, p.j})
        if (!in_group(i) && (atom->mask[i] & others_groupbits))
          error->one(
              FLERR,
              "Fix {} nve/evp: atom {} interacts with its group but is integrated by another "
              "fix, whose velocity would enter as prescribed: put it into the group of fix "
              "{}, or move it by fix nve/noforce or fix move",
              id, atom->tag[i], id);
      const double d = std::sqrt(g.dsq);
      const double scale = std::sqrt(gamma) / d;
      dampers.push_back({{scale * g.dx, scale * g.dy, scale * g.dz}, p.j, k});
    }
    const int last = (int) dampers.size();
    if (last > first) damper_rows.push_back({row.i, first, last});
  }
}

/* ----------------------------------------------------------------------
   reaction = C exchanged for all local atoms, exchanged being set for the local ones
------------------------------------------------------------------------- */

void FixNVEEVP::damping_product()
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  EVP::compat::forward_comm(comm, this);

  const int nreact = force->newton_pair ? nall : nlocal;
  reaction.assign((size_t) 3 * nall, 0.0);
  const double *velocities = exchanged.data();
  double *forces = reaction.data();
  for (const auto &row : damper_rows) {
    const double *vi = velocities + (size_t) 3 * row.i;
    double yi[3] = {0.0, 0.0, 0.0};
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      const double along = damper.opening(vi, velocities + (size_t) 3 * damper.j);
      for (int c = 0; c < 3; c++) yi[c] += along * damper.w[c];
      if (damper.j >= nreact) continue;
      double *yj = forces + (size_t) 3 * damper.j;
      for (int c = 0; c < 3; c++) yj[c] -= along * damper.w[c];
    }
    for (int c = 0; c < 3; c++) forces[(size_t) 3 * row.i + c] += yi[c];
  }
  sum_to_owners(reaction);
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::sum_to_owners(Nodal &values)
{
  if (!force->newton_pair) return;
  exchanged.swap(values);
  EVP::compat::reverse_comm(comm, this);
  exchanged.swap(values);
}

/* ----------------------------------------------------------------------
   velocity = v* with the damper forces of the last step along the present pairs: like those of
   every iterate they have neither momentum nor angular momentum. Residual to match
------------------------------------------------------------------------- */

void FixNVEEVP::warm_start(double h)
{
  const size_t n = (size_t) 3 * atom->nlocal;
  const int nreact = force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
  Nodal &guess = reaction;
  guess.assign(exchanged.size(), 0.0);
  for (const auto &row : damper_rows)
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      for (int c = 0; c < 3; c++) {
        const double force_c = last_force[damper.pair] * damper.w[c];
        guess[(size_t) 3 * row.i + c] += force_c;
        if (damper.j < nreact) guess[(size_t) 3 * damper.j + c] -= force_c;
      }
    }
  sum_to_owners(guess);
  for (size_t k = 0; k < n; k++) {
    residual[k] = mobility[k] > 0.0 ? -h * guess[k] : 0.0;
    velocity[k] = undamped[k] + h * mobility[k] * guess[k];
  }
  exchange_velocities(velocity);
  damping_product();
  for (size_t k = 0; k < n; k++)
    if (mobility[k] > 0.0) residual[k] -= h * reaction[k];
}

/* ----------------------------------------------------------------------
   the velocities of the group from `of`, all others as the atoms have them
------------------------------------------------------------------------- */

void FixNVEEVP::exchange_velocities(const Nodal &of)
{
  for (int i = 0; i < atom->nlocal; i++)
    for (int c = 0; c < 3; c++) {
      const size_t k = (size_t) 3 * i + c;
      exchanged[k] = mobility[k] > 0.0 ? of[k] : atom->v[i][c];
    }
}

/* ----------------------------------------------------------------------
   preconditioned by M, in the form that needs one sum over processes per iteration
   (Chronopoulos and Gear). M keeps the momentum of every iterate exact: pair forces
   have none, and the start carries that of M v + h F.
   The tolerance is against what the damping does, M (v - v*): a measure that knows no frame, so a
   body in flight is not solved worse than one at rest, and that does not grow with h C, as
   h C v* would (it exceeds the motion itself where damping is strong).
   Held atoms need no branch: their mobility, hence every direction, is zero.
------------------------------------------------------------------------- */

int FixNVEEVP::solve(double h)
{
  const int nlocal = atom->nlocal;
  const size_t n = (size_t) 3 * nlocal;
  exchanged.resize(n + (size_t) 3 * atom->nghost);
  for (Nodal *nodal : {&mobility, &undamped, &velocity, &residual, &direction, &direction_product})
    nodal->assign(n, 0.0);
  for (int i = 0; i < nlocal; i++)
    if (in_group(i)) std::fill_n(&mobility[(size_t) 3 * i], 3, inverse_mass(i));

  const double *v = atom->v[0], *f = atom->f[0];
  for (size_t k = 0; k < n; k++) undamped[k] = v[k] + h * mobility[k] * f[k];
  warm_start(h);

  double last_norm = 0.0, last_alpha = 0.0;
  for (int iteration = 0;; iteration++) {
    for (size_t k = 0; k < n; k++) exchanged[k] = mobility[k] * residual[k];
    damping_product();

    double sums[4] = {0.0, 0.0, 0.0, 0.0}, all[4];
    for (size_t k = 0; k < n; k++) {
      reaction[k] = residual[k] + h * reaction[k];    // (M + h C) M^-1 r
      sums[0] += residual[k] * exchanged[k];
      sums[1] += reaction[k] * exchanged[k];
      if (mobility[k] > 0.0) {
        const double change = velocity[k] - undamped[k];
        sums[2] += change * change / mobility[k];
        sums[3] += undamped[k] * undamped[k] / mobility[k];
      }
    }
    MPI_Allreduce(sums, all, 4, MPI_DOUBLE, MPI_SUM, world);
    const double norm = all[0], curvature = all[1];
    const double target = std::max(tolerance * tolerance * all[2], ROUND_OFF * ROUND_OFF * all[3]);
    if (norm <= target) return iteration;
    if (iteration == max_iterations || !std::isfinite(norm))
      error->all(
          FLERR,
          "Fix {} nve/evp: the damping did not converge in {} iterations at step {} (residual "
          "{:.3g} of the tolerance): reduce the timestep, raise maxiter, or look for what "
          "blew up before",
          id, iteration, update->ntimestep, std::sqrt(norm / target));

    const double beta = iteration ? norm / last_norm : 0.0;
    const double alpha = norm / (curvature - (iteration ? beta * norm / last_alpha : 0.0));
    for (size_t k = 0; k < n; k++) {
      direction[k] = exchanged[k] + beta * direction[k];
      direction_product[k] = reaction[k] + beta * direction_product[k];
      velocity[k] += alpha * direction[k];
      residual[k] -= alpha * direction_product[k];
    }
    last_norm = norm;
    last_alpha = alpha;
  }
}

/* ----------------------------------------------------------------------
   on the group what took v to the v+ found, elsewhere the reaction of the dampers
------------------------------------------------------------------------- */

void FixNVEEVP::store_applied(double h)
{
  exchange_velocities(velocity);
  damping_product();
  const size_t n = (size_t) 3 * atom->nlocal;
  double *v = atom->v[0], *f = atom->f[0], *damping = applied.data();
  for (size_t k = 0; k < n; k++)
    damping[k] = mobility[k] > 0.0 ? (velocity[k] - v[k]) / (h * mobility[k]) - f[k] : -reaction[k];

  for (const auto &row : damper_rows)
    for (int k = row.first; k < row.last; k++)
      last_force[dampers[k].pair] = -dampers[k].opening(&exchanged[(size_t) 3 * row.i],
                                                        &exchanged[(size_t) 3 * dampers[k].j]);
}

/* ----------------------------------------------------------------------
   of the damping, which the pair style left out
------------------------------------------------------------------------- */

void FixNVEEVP::tally_virial()
{
  v_init(vflag_now);
  if (!evflag) return;    // v_init sets no vflag_either

  exchange_velocities(velocity);
  EVP::compat::forward_comm(comm, this);

  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  const int nreact = force->newton_pair ? nall : nlocal;
  // per atom in two parts of three, so that the exchange of velocities serves both
  Nodal shares[2];
  if (vflag_atom)
    for (auto &share : shares) share.assign((size_t) 3 * nall, 0.0);

  const auto x = reinterpret_cast<const double(*)[3]>(atom->x[0]);
  for (const auto &row : damper_rows)
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      const EVP::PairGeometry g(x, row.i, damper.j);
      const double along =
          -damper.opening(&exchanged[(size_t) 3 * row.i], &exchanged[(size_t) 3 * damper.j]);
      const double *w = damper.w;
      const double v[6] = {along * w[0] * g.dx, along * w[1] * g.dy, along * w[2] * g.dz,
                           along * w[0] * g.dy, along * w[0] * g.dz, along * w[1] * g.dz};
      // without newton both owners of a pair across processes hold it
      const double whole = damper.j < nreact ? 1.0 : 0.5;
      if (vflag_global)
        for (int c = 0; c < 6; c++) virial[c] += whole * v[c];
      if (vflag_atom)
        for (int c = 0; c < 6; c++) {
          shares[c / 3][(size_t) 3 * row.i + c % 3] += 0.5 * v[c];
          if (damper.j < nreact) shares[c / 3][(size_t) 3 * damper.j + c % 3] += 0.5 * v[c];
        }
    }
  if (!vflag_atom) return;
  for (int part = 0; part < 2; part++) {
    if (force->newton_pair) {
      exchanged.swap(shares[part]);
      EVP::compat::reverse_comm(comm, this);
      exchanged.swap(shares[part]);
    }
    for (int i = 0; i < nlocal; i++)
      for (int c = 0; c < 3; c++) vatom[i][3 * part + c] += shares[part][(size_t) 3 * i + c];
  }
}

/* ---------------------------------------------------------------------- */

int FixNVEEVP::pack_forward_comm(int n, int *indices, double *buf, int /*pbc_flag*/, int * /*pbc*/)
{
  for (int k = 0; k < n; k++) std::copy_n(&exchanged[(size_t) 3 * indices[k]], 3, buf + 3 * k);
  return 3 * n;
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::unpack_forward_comm(int n, int first, double *buf)
{
  std::copy_n(buf, 3 * n, &exchanged[(size_t) 3 * first]);
}

/* ---------------------------------------------------------------------- */

int FixNVEEVP::pack_reverse_comm(int n, int first, double *buf)
{
  std::copy_n(&exchanged[(size_t) 3 * first], 3 * n, buf);
  return 3 * n;
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++)
    for (int c = 0; c < 3; c++) exchanged[(size_t) 3 * indices[k] + c] += buf[3 * k + c];
}
