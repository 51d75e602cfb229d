/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/energy: what a step adds to the entries of the ledger. */

#include "fix_evp_energy.h"

#include "fix_nve_evp.h"
#include "pair_evp_lj.h"
#include "scene.h"

#include "atom.h"
#include "domain.h"
#include "force.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

bool FixEVPEnergy::is_driven(int i) const
{
  return atom->mask[i] & driven_groupbits;
}

/* ----------------------------------------------------------------------
   velocity per force in half a step; none where forces do not move the atom
------------------------------------------------------------------------- */

double FixEVPEnergy::half_kick(int i) const
{
  return is_driven(i) ? 0.5 * dt_step * EVP::scene::inverse_mass(atom, force, i) : 0.0;
}

/* ----------------------------------------------------------------------
   last, and the forces of the pairs on local atoms, explicit damping apart.
   Within a run the pair style saw the half-step velocities, at set-up those of the atoms.
   A bond's energy counts from its rest; what it cost to take one beyond dlim stays in the balance as
   the depth that is missing
------------------------------------------------------------------------- */

void FixEVPEnergy::evaluate(bool at_setup)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  const int nreact = force->newton_pair ? nall : nlocal;
  const bool damps = pair->damps_explicitly();

  Instant here{};    // of this MPI rank
  velocities.resize((size_t) 3 * nall);
  for (int i = 0; i < nlocal; i++) {
    const double half = at_setup ? 0.0 : half_kick(i);
    const double weight = is_driven(i) ? 0.5 * force->mvv2e * EVP::scene::mass(atom, i) : 0.0;
    for (int c = 0; c < 3; c++) {
      const double v = atom->v[i][c];
      velocities[(size_t) 3 * i + c] = v - half * atom->f[i][c];
      here.kinetic += weight * v * v;    // the energy of a mover is its own affair
    }
  }
  if (damps) to_ghosts(velocities);

  pair_force.assign((size_t) 3 * nall, 0.0);
  damping_force.assign((size_t) 3 * nall, 0.0);
  const EVP::PackedList &list = pair->packed_pairs();
  if (stored.is_due(list)) find_depths(list);
  const auto x = EVP::scene::rows(atom->x);
  for (const auto &row : list.rows)
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &p = list.pairs[n];
      const int i = row.i, j = p.j;
      const EVP::PairGeometry g(x, i, j);
      if (g.dsq > p.cutsq) continue;
      // without newton both owners of a pair across MPI ranks hold it
      const double weight = j < nreact ? 1.0 : 0.5;
      const double d = std::sqrt(g.dsq), deq = stored.deq_of(n);
      const EVP::Law &law = pair->law_of(p);
      stored.add(here.pairs, n, p, law, d, weight);

      const auto add = [&](Nodal &forces, double over_d) {
        const double f[3] = {over_d * g.dx, over_d * g.dy, over_d * g.dz};
        for (int c = 0; c < 3; c++) {
          forces[(size_t) 3 * i + c] += f[c];
          if (j < nreact) forces[(size_t) 3 * j + c] -= f[c];
        }
      };
      add(pair_force, law.force(d, deq) / d);
      const double gamma = law.parameters().gamma;    // without that of implicit pairs
      if (gamma > 0.0)
        add(damping_force, EVP::damping_over_distance(gamma, g, &velocities[(size_t) 3 * i],
                                                      &velocities[(size_t) 3 * j]));
    }
  to_owners(pair_force);
  if (damps) to_owners(damping_force);
  static_assert(sizeof(Instant) % sizeof(double) == 0, "an Instant is a row of numbers");
  MPI_Allreduce(&here, &last, sizeof(Instant) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::find_depths(const EVP::PackedList &list)
{
  stored.assign(list, pair->rest_distances(), [&](const EVP::PackedPair &p) -> const EVP::Law & {
    return pair->law_of(p);
  });
}

/* ----------------------------------------------------------------------
   of the start, for all instants that are compared with it
------------------------------------------------------------------------- */

void FixEVPEnergy::find_largest_depth()
{
  const double here = stored.total_depth();
  double all;
  MPI_Allreduce(&here, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  stored.set_largest_depth(all);
}

/* ----------------------------------------------------------------------
   on a local atom, all of it that f holds
------------------------------------------------------------------------- */

void FixEVPEnergy::find_damping(int i, double *damping) const
{
  const bool solved = implicit && pair->damps_implicitly();
  for (int c = 0; c < 3; c++) {
    const size_t k = (size_t) 3 * i + c;
    damping[c] = damping_force[k] + (solved ? implicit->applied_damping()[k] : 0.0);
  }
}

/* ----------------------------------------------------------------------
   at the beginning of a step, where atoms hold the half-step velocity by now, or at its end, where
   they hold that of the full step: of either the mean over the half step is half of its kick away
------------------------------------------------------------------------- */

FixEVPEnergy::StepEnd FixEVPEnergy::sum_half_step() const
{
  StepEnd sums = {0.0, 0.0};
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_driven(i)) continue;
    const double half = half_kick(i);
    double damping[3];
    find_damping(i, damping);
    for (int c = 0; c < 3; c++) {
      const double f = atom->f[i][c], mean = atom->v[i][c] - 0.5 * half * f;
      sums.dissipated -= 0.5 * dt_step * damping[c] * mean;
      sums.ripple += 0.25 * dt_step * half * (f - damping[c]) * f;
    }
  }
  return sums;
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::remember_places()
{
  for (int i = 0; i < atom->nlocal; i++) domain->unmap(atom->x[i], atom->image[i], past[i]);
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::remember_forces()
{
  for (int i = 0; i < atom->nlocal; i++) {
    double *working = past[i] + 3, *damping = past[i] + 6;
    find_damping(i, damping);
    for (int c = 0; c < 3; c++) {
      const double pairs = pair_force[(size_t) 3 * i + c];
      working[c] = is_driven(i) ? atom->f[i][c] - damping[c] - pairs : pairs;
    }
  }
}

/* ----------------------------------------------------------------------
   works and dissipation of the step that ends. What damping gives back where a velocity turns within a
   step is held against what it takes next
------------------------------------------------------------------------- */

void FixEVPEnergy::advance(const StepEnd &ended)
{
  enum { TAKEN, RIPPLE, OF_MOVERS, OF_OTHERS, NSUMS };
  double sums[NSUMS] = {begun.dissipated + ended.dissipated, ended.ripple - begun.ripple, 0.0, 0.0};
  double all[NSUMS];
  for (int i = 0; i < atom->nlocal; i++) {
    Past then;
    memcpy(&then, past[i], sizeof(then));
    double x[3], damping[3];
    domain->unmap(atom->x[i], atom->image[i], x);
    find_damping(i, damping);
    const bool driven = is_driven(i);
    for (int c = 0; c < 3; c++) {
      const double dx = x[c] - then.x[c], pairs = pair_force[(size_t) 3 * i + c];
      if (driven) {
        const double others = atom->f[i][c] - damping[c] - pairs;
        sums[OF_OTHERS] += 0.5 * (then.working[c] + others) * dx;
      } else {
        const double damped = 0.5 * (then.damping[c] + damping[c]) * dx;
        sums[TAKEN] -= damped;
        sums[OF_MOVERS] -= 0.5 * (then.working[c] + pairs) * dx + damped;
      }
    }
  }
  MPI_Allreduce(sums, all, NSUMS, MPI_DOUBLE, MPI_SUM, world);

  taken += all[TAKEN];
  ripple += all[RIPPLE];
  ledger[DISSIPATED] = std::max(ledger[DISSIPATED], taken);
  ledger[MOVERS] += all[OF_MOVERS];
  ledger[OTHERS] += all[OF_OTHERS];
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::update_states()
{
  ledger[KINETIC] = last.kinetic - start.kinetic + ripple;
  ledger[FIRST] = last.pairs.first - start.pairs.first;
  ledger[SECOND] = last.pairs.second - start.pairs.second;
  ledger[LOST] = EVP::StoredEnergy::lost(start.pairs, last.pairs);
  ledger[CONTACTS] = EVP::StoredEnergy::of_contacts(start.pairs, last.pairs);
}
