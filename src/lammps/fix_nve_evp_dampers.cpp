/* SPDX-License-Identifier: GPL-2.0-only

   Fix nve/evp: the dampers at the last force evaluation, their power and their virial. */

#include "fix_nve_evp.h"

#include "core/opening.h"
#include "core/vector.h"
#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr double LARGEST_TURN = 0.15;    // rad per step, see doc/fix_nve_evp.rst

/* ----------------------------------------------------------------------
   x is that of the force evaluation here; later it may not be, so u and 1/d are kept
------------------------------------------------------------------------- */

void FixNVEEVP::collect_dampers()
{
  damper_rows.clear();
  if (!pair->damps_implicitly()) {
    dampers.clear();
    return;
  }
  const auto x = EVP::scene::rows(atom->x);
  const EVP::PairList &list = pair->packed_pairs();
  const size_t most = list.pairs.size();
  if (list.build != last_build)
    for (auto *of_pairs : {&last_force, &last_turning}) of_pairs->assign(most, 0.0);
  last_build = list.build;
  if (list.common_build != bodies_build) {
    warn_of_turning();
    find_bodies();
  }
  dampers.resize(most);
  damper_scale.resize(most);
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
      const double scale = root / std::sqrt(g.dsq);
      damper->w[0] = scale * g.dx;
      damper->w[1] = scale * g.dy;
      damper->w[2] = scale * g.dz;
      damper->j = p.j;
      damper->pair = k;
      damper++;
      damper_scale[n++] = scale;
    }
    if (n > first) damper_rows.push_back({row.i, first, n});
  }
  dampers.resize(n);
}

/* ----------------------------------------------------------------------
   opening rates over the last step of size dt, or now with dt = 0, from the velocities that atoms hold
------------------------------------------------------------------------- */

void FixNVEEVP::find_rates(double dt)
{
  rate_before.resize(dampers.size());
  if (!pair->damps_implicitly()) return;
  velocities.resize((size_t) 3 * (atom->nlocal + atom->nghost));
  std::copy_n(atom->v[0], (size_t) 3 * atom->nlocal, velocities.begin());
  if (dt > 0.0)
    movers.for_each_before(atom, domain, dt, [this](int i, int c, double before) {
      if (!in_group(i)) velocities[(size_t) 3 * i + c] = before;
    });
  to_ghosts(velocities);
  for (const auto &row : damper_rows) {
    const EVP::Vector vi(&velocities[(size_t) 3 * row.i]);
    for (int k = row.first; k < row.last; k++) {
      const EVP::Vector w(dampers[k].w);
      const EVP::Vector v = vi - EVP::Vector(&velocities[(size_t) 3 * dampers[k].j]);
      rate_before[k] =
          EVP::opening_rate(dot(w, v), dot(v, v), -0.5 * dt * damper_scale[k], 1.0 / dot(w, w));
    }
  }
  rate_now = rate_before;
}

/* ----------------------------------------------------------------------
   collective, once per neighbor build and at the end of a run: fast turning leads to builds
------------------------------------------------------------------------- */

void FixNVEEVP::warn_of_turning()
{
  double turned;
  MPI_Allreduce(&most_turned, &turned, 1, MPI_DOUBLE, MPI_MAX, world);
  most_turned = 0.0;
  if (turning_warned || 2.0 * std::sqrt(turned) <= 1.01 * LARGEST_TURN) return;
  turning_warned = true;
  if (comm->me) return;
  const double angle = 2.0 * std::sqrt(turned);
  error->warning(
      FLERR,
      "Fix {} nve/evp: damped pairs turned by more than {} rad per step, {:.3g} rad before "
      "step {}, which the damping does not resolve: reduce the timestep to {:.4g}, or use "
      "fix dt/evp",
      id, LARGEST_TURN, angle, update->ntimestep, update->dt * LARGEST_TURN / angle);
}

/* ----------------------------------------------------------------------
   the velocity at the present places is the mean of those before and after
------------------------------------------------------------------------- */

void FixNVEEVP::find_mean_rates()
{
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
   of the damping, which the pair style left out
------------------------------------------------------------------------- */

void FixNVEEVP::tally_virial()
{
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
