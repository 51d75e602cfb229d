/* SPDX-License-Identifier: GPL-2.0-only

   Fix nve/evp: (M + h C) v+ = M v + h F by conjugate gradients, matrix free, over all processes. */

#include "fix_nve_evp.h"

#include "evp_cg.h"
#include "evp_opening.h"
#include "evp_vector.h"
#include "pair_evp_lj.h"
#include "scene.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;

static constexpr double LARGEST_TURN = 0.15;    // rad per step, see doc/fix_nve_evp.rst
static constexpr double ROUND_OFF = 4.0 * std::numeric_limits<double>::epsilon();

/* ----------------------------------------------------------------------
   velocities, with ghosts, that predict how pairs turn in the step to come: of the last step, which
   ended at the present places, of the atoms now, or of this step as far as it is known, by what f holds
------------------------------------------------------------------------- */

void FixNVEEVP::predict_velocities(Predictor predictor)
{
  const double half = predictor == Predictor::THIS_STEP ? 0.5 * update->dt : 0.0;
  velocities.resize((size_t) 3 * (atom->nlocal + atom->nghost));
  for (int i = 0; i < atom->nlocal; i++) {
    const double scale = half > 0.0 && in_group(i) ? half * EVP::scene::inverse_mass(atom, force, i)
                                                   : 0.0;
    for (int c = 0; c < 3; c++)
      velocities[(size_t) 3 * i + c] = atom->v[i][c] + scale * atom->f[i][c];
  }
  to_ghosts(velocities);
}

/* ----------------------------------------------------------------------
   x is that of the force evaluation here; later it may not be, so u and 1/d are kept
------------------------------------------------------------------------- */

void FixNVEEVP::collect_dampers(Predictor predictor)
{
  damper_rows.clear();
  if (!pair->damps_implicitly()) {
    dampers.clear();
    return;
  }
  predict_velocities(predictor);
  const EVP::PackedList &list = pair->packed_pairs();
  const size_t most = list.pairs.size();
  dampers.resize(most);
  if (list.build != last_build) last_force.assign(most, 0.0);
  last_build = list.build;
  for (auto *values : {&damper_turning, &inverse_distance}) values->resize(most);
  if (balance_wanted) rate_before.resize(most);

  const auto x = EVP::scene::rows(atom->x);
  const auto v = reinterpret_cast<const double(*)[3]>(velocities.data());
  double *const turning = damper_turning.data(), *const inv_distance = inverse_distance.data();
  double *const before = balance_wanted ? rate_before.data() : nullptr;
  const int side = predictor == Predictor::LAST_STEP ? -1 : 0;
  const double half_dt = 0.5 * update->dt;
  double turned = 0.0;
  Damper *damper = dampers.data();
  int law = -1, n = 0;
  double root = 0.0;    // sqrt(gamma) of that law
  for (const auto &row : list.rows) {
    const int first = n;
    for (int k = row.first; k < row.last; k++) {
      const EVP::PackedPair p = list.pairs[k];
      if (p.law != law) {
        law = p.law;
        root = std::sqrt(pair->implicit_gamma(p));
      }
      if (root == 0.0) continue;
      const EVP::PairGeometry g(x, row.i, p.j);
      if (g.dsq > p.cutsq) continue;

      if (others_groupbits) check_partners(row.i, p.j);
      const double inv_d = 1.0 / std::sqrt(g.dsq), scale = root * inv_d;
      damper->w[0] = scale * g.dx;
      damper->w[1] = scale * g.dy;
      damper->w[2] = scale * g.dz;
      damper->j = p.j;
      damper->pair = k;
      damper++;

      const EVP::PairGeometry dv(v, row.i, p.j);
      const double along = inv_d * (g.dx * dv.dx + g.dy * dv.dy + g.dz * dv.dz);
      const double half_step = half_dt * inv_d;
      const double rate = EVP::turning_rate(dv.dsq, along, half_step, side);
      turned = std::max(turned, half_step * rate);
      inv_distance[n] = inv_d;
      turning[n] = root * rate;
      // the opening rate of the last step is without what turning added to it
      if (before) before[n] = root * (along + side * rate);
      n++;
    }
    if (n > first) damper_rows.push_back({row.i, first, n});
  }
  dampers.resize(n);
  if (balance_wanted) rate_now = rate_before;
  warn_of_turning(turned);
}

/* ----------------------------------------------------------------------
   how all pairs turn, from this step as far as it is known
------------------------------------------------------------------------- */

void FixNVEEVP::predict_again()
{
  predict_velocities(Predictor::THIS_STEP);
  double turned = 0.0;
  for (const auto &row : damper_rows) {
    const EVP::Vector vi(&velocities[(size_t) 3 * row.i]);
    for (int k = row.first; k < row.last; k++) {
      const EVP::Vector w(dampers[k].w);
      const EVP::Vector v = vi - EVP::Vector(&velocities[(size_t) 3 * dampers[k].j]);
      const double root = std::sqrt(dot(w, w)), half_step = 0.5 * update->dt * inverse_distance[k];
      const double rate = EVP::turning_rate(dot(v, v), dot(w, v) / root, half_step, 1);
      turned = std::max(turned, half_step * rate);
      damper_turning[k] = root * rate;
    }
  }
  warn_of_turning(turned);
}

/* ----------------------------------------------------------------------
   turned: a quarter of the square of the largest angle by which a pair turns in this step
------------------------------------------------------------------------- */

void FixNVEEVP::warn_of_turning(double turned)
{
  if (turning_warned || 4.0 * turned <= LARGEST_TURN * LARGEST_TURN) return;
  turning_warned = true;
  const double angle = 2.0 * std::sqrt(turned);
  error->warning(
      FLERR,
      "Fix {} nve/evp: damped pairs turn by more than {} rad per step, now {:.3g} rad at "
      "step {}, which the damping does not resolve: reduce the timestep to {:.4g}, or use "
      "fix dt/evp",
      id, LARGEST_TURN, angle, update->ntimestep, update->dt * LARGEST_TURN / angle);
}

/* ----------------------------------------------------------------------
   the velocity at the present places is the mean of those before and after
------------------------------------------------------------------------- */

void FixNVEEVP::find_rates()
{
  if (!balance_wanted) return;
  for (size_t k = 0; k < dampers.size(); k++)
    rate_now[k] = 0.5 * (rate_before[k] - last_force[dampers[k].pair]);
}

/* ---------------------------------------------------------------------- */

double FixNVEEVP::power_before() const
{
  return power([this](size_t k, double) {
    return 0.5 * (rate_before[k] + rate_now[k]);
  });
}

double FixNVEEVP::power_after() const
{
  return power([this](size_t k, double rate) {
    return 0.5 * (rate_now[k] + rate);
  });
}

/* ----------------------------------------------------------------------
   of the damper forces at the present places, over a time with that mean rate
------------------------------------------------------------------------- */

template <class F> double FixNVEEVP::power(F &&mean_rate) const
{
  const int nreact = force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
  double sum = 0.0;
  for (size_t k = 0; k < dampers.size(); k++) {
    const double rate = -last_force[dampers[k].pair];
    sum += (dampers[k].j < nreact ? 1.0 : 0.5) * rate * mean_rate(k, rate);
  }
  return sum;
}

/* ----------------------------------------------------------------------
   neighbours of the group may be held or moved along a path, but not follow forces of their own
------------------------------------------------------------------------- */

void FixNVEEVP::check_partners(int i, int j) const
{
  for (const int k : {i, j})
    if (!in_group(k) && (atom->mask[k] & others_groupbits))
      error->one(FLERR,
                 "Fix {} nve/evp: atom {} interacts with its group but is integrated by another "
                 "fix, whose velocity would enter as prescribed: put it into the group of fix "
                 "{}, or move it by fix nve/noforce or fix move",
                 id, atom->tag[k], id);
}

/* ----------------------------------------------------------------------
   reaction = C velocities for all local atoms, velocities being set for the local ones, and where
   asked for gamma times what turning adds; keep(damper, sqrt(gamma) times the opening rate) is called
   on the way
------------------------------------------------------------------------- */

template <bool Turning, class F> void FixNVEEVP::damping_product(F &&keep)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  to_ghosts(velocities);

  const int nreact = force->newton_pair ? nall : nlocal;
  reaction.assign((size_t) 3 * nall, 0.0);
  const double *all = velocities.data();
  double *forces = reaction.data();
  for (const auto &row : damper_rows) {
    const EVP::Vector vi(all + (size_t) 3 * row.i);
    EVP::Vector yi;
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      const EVP::Vector w(damper.w);
      double along = dot(w, vi - EVP::Vector(all + (size_t) 3 * damper.j));
      if constexpr (Turning) along += damper_turning[k];
      keep(damper, along);
      const EVP::Vector y = w * along;
      yi = yi + y;
      if (damper.j < nreact) y.subtract_from(forces + (size_t) 3 * damper.j);
    }
    yi.add_to(forces + (size_t) 3 * row.i);
  }
  to_owners(reaction);
}

static constexpr auto nothing_to_keep = [](const auto &, double) {
};

/* ----------------------------------------------------------------------
   velocity = v* with the damper forces of the last step along the present pairs: like those of
   every iterate they have neither momentum nor angular momentum. Residual to match
------------------------------------------------------------------------- */

void FixNVEEVP::warm_start(double h)
{
  const size_t n = (size_t) 3 * atom->nlocal;
  const int nreact = force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
  Nodal &guess = reaction;
  guess.assign(velocities.size(), 0.0);
  for (const auto &row : damper_rows)
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      for (int c = 0; c < 3; c++) {
        const double force_c = last_force[damper.pair] * damper.w[c];
        guess[(size_t) 3 * row.i + c] += force_c;
        if (damper.j < nreact) guess[(size_t) 3 * damper.j + c] -= force_c;
      }
    }
  to_owners(guess);
  for (size_t k = 0; k < n; k++) {
    residual[k] = mobility[k] > 0.0 ? -h * guess[k] : 0.0;
    change[k] = h * mobility[k] * guess[k];
    velocity[k] = undamped[k] + change[k];
  }
  exchange_velocities(velocity);
  damping_product<true>(nothing_to_keep);
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
      velocities[k] = mobility[k] > 0.0 ? of[k] : atom->v[i][c];
    }
}

/* ----------------------------------------------------------------------
   preconditioned by M, in the form that needs one sum over processes per iteration
   (Chronopoulos and Gear). M keeps the momentum of every iterate exact: pair forces
   have none, and the start carries that of M v + h F.
   The tolerance is against what the damping does, M (v - v*): a measure that knows no frame, so a
   body in flight is not solved worse than one at rest, and that does not grow with h C, as
   h C v* would (it exceeds the motion itself where damping is strong).
   Held atoms need no branch: their mobility, hence every direction, and their inertia are zero.
------------------------------------------------------------------------- */

int FixNVEEVP::solve(double h)
{
  const int nlocal = atom->nlocal;
  const size_t n = (size_t) 3 * nlocal;
  velocities.resize(n + (size_t) 3 * atom->nghost);
  for (Nodal *nodal : {&mobility, &inertia, &undamped, &velocity, &change, &residual, &direction,
                       &direction_product})
    nodal->assign(n, 0.0);
  for (int i = 0; i < nlocal; i++)
    if (in_group(i)) {
      const double w = EVP::scene::inverse_mass(atom, force, i);
      std::fill_n(&mobility[(size_t) 3 * i], 3, w);
      std::fill_n(&inertia[(size_t) 3 * i], 3, 1.0 / w);
    }

  const double *v = atom->v[0], *f = atom->f[0];
  for (size_t k = 0; k < n; k++) undamped[k] = v[k] + h * mobility[k] * f[k];
  warm_start(h);

  const EVP::CgLoops loops = EVP::cg_loops();
  const EVP::CgArrays arrays = {mobility.data(),   inertia.data(),   change.data(),
                                residual.data(),   direction.data(), direction_product.data(),
                                velocities.data(), reaction.data()};
  double whole = 0.0;    // M v*^2, here
  for (size_t k = 0; k < n; k++) {
    velocities[k] = mobility[k] * residual[k];
    whole += inertia[k] * undamped[k] * undamped[k];
  }
  double changed = loops.changed(arrays, n);

  double last_norm = 0.0, last_alpha = 0.0;
  for (int iteration = 0;; iteration++) {
    damping_product<false>(nothing_to_keep);

    const EVP::CgProducts products = loops.products(arrays, n, h);
    double sums[4] = {products.norm, products.curvature, changed, whole};
    double all[4];
    MPI_Allreduce(sums, all, 4, MPI_DOUBLE, MPI_SUM, world);
    const double norm = all[0], curvature = all[1];
    const double target = std::max(tolerance * tolerance * all[2], ROUND_OFF * ROUND_OFF * all[3]);
    if (!std::isfinite(norm + target))
      error->all(FLERR,
                 "Fix {} nve/evp: velocities or forces are not numbers any more at step {} with "
                 "timestep {:.6g}: the step is above the limit (see compute evp/dt), or the motion "
                 "too fast for it (see fix dt/evp)",
                 id, update->ntimestep, update->dt);
    if (norm <= target) {
      for (size_t k = 0; k < n; k++) velocity[k] = undamped[k] + change[k];
      return iteration;
    }
    if (iteration == max_iterations)
      error->all(FLERR,
                 "Fix {} nve/evp: the damping did not converge in {} iterations at step {} "
                 "(residual {:.3g} of the tolerance): reduce the timestep, or raise maxiter",
                 id, iteration, update->ntimestep, std::sqrt(norm / target));

    const double beta = iteration ? norm / last_norm : 0.0;
    const double alpha = norm / (curvature - (iteration ? beta * norm / last_alpha : 0.0));
    changed = loops.update(arrays, n, alpha, beta);
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
  damping_product<true>([this](const Damper &damper, double along) {
    last_force[damper.pair] = -along;
  });
  const size_t n = (size_t) 3 * atom->nlocal;
  applied.resize(n);
  double *v = atom->v[0], *f = atom->f[0], *damping = applied.data();
  for (size_t k = 0; k < n; k++)
    damping[k] = mobility[k] > 0.0 ? (velocity[k] - v[k]) / (h * mobility[k]) - f[k] : -reaction[k];
}

/* ----------------------------------------------------------------------
   of the damping, which the pair style left out
------------------------------------------------------------------------- */

void FixNVEEVP::tally_virial()
{
  v_init(vflag_now);
  if (!evflag) return;    // v_init sets no vflag_either

  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  const int nreact = force->newton_pair ? nall : nlocal;
  // per atom in two parts of three, the width of the exchange
  Nodal shares[2];
  if (vflag_atom)
    for (auto &share : shares) share.assign((size_t) 3 * nall, 0.0);

  const auto x = EVP::scene::rows(atom->x);
  for (const auto &row : damper_rows)
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      const EVP::PairGeometry g(x, row.i, damper.j);
      const double along = last_force[damper.pair];
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
    to_owners(shares[part]);
    for (int i = 0; i < nlocal; i++)
      for (int c = 0; c < 3; c++) vatom[i][3 * part + c] += shares[part][(size_t) 3 * i + c];
  }
}
