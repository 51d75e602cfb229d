/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/energy: what a step adds to the entries of the ledger. */

#include "fix_evp_energy.h"

#include "fix_nve_evp.h"
#include "pair_network.h"
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
  const EVP::PairList &list = pair->packed_pairs();
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
        add(damping_force,
            EVP::damping_over_distance(gamma, g, &velocities[(size_t) 3 * i],
                                       &velocities[(size_t) 3 * j]));
    }
  to_owners(pair_force);
  if (damps) to_owners(damping_force);
  static_assert(sizeof(Instant) % sizeof(double) == 0, "an Instant is a row of numbers");
  MPI_Allreduce(&here, &last, sizeof(Instant) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::find_depths(const EVP::PairList &list)
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
  double here = stored.total_depth();
  double all;
  MPI_Allreduce(&here, &all, 1, MPI_DOUBLE, MPI_SUM, world);
  stored.set_largest_depth(all);
}

/* ---------------------------------------------------------------------- */

bool FixEVPEnergy::is_solved() const
{
  return implicit && pair->damps_implicitly();
}

/* ----------------------------------------------------------------------
   of the damping that fix nve/evp solved for, on a local atom
------------------------------------------------------------------------- */

double FixEVPEnergy::solved_damping(int i, int c) const
{
  return is_solved() ? implicit->applied_damping()[(size_t) 3 * i + c] : 0.0;
}

/* ----------------------------------------------------------------------
   on this MPI rank, by the damping of driven atoms over the half step on one side of the present places.
   At the beginning of a step atoms hold the half-step velocity by now, at its end that of the full step:
   of either the mean over the half step is half of its kick away
------------------------------------------------------------------------- */

double FixEVPEnergy::dissipated_in_half_step(bool at_begin) const
{
  double sum = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_driven(i)) continue;
    const double half = half_kick(i);
    for (int c = 0; c < 3; c++)
      sum -= damping_force[(size_t) 3 * i + c] * (atom->v[i][c] - 0.5 * half * atom->f[i][c]);
  }
  if (is_solved()) sum += at_begin ? implicit->power_after() : implicit->power_before();
  return 0.5 * dt_step * sum;
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
    for (int c = 0; c < 3; c++) {
      damping[c] = damping_force[(size_t) 3 * i + c];
      working[c] = working_force(i, c);
    }
  }
}

/* ----------------------------------------------------------------------
   on an atom that forces move all but those of the pairs, on a mover those of the pairs, but for
   explicit damping
------------------------------------------------------------------------- */

double FixEVPEnergy::working_force(int i, int c) const
{
  const size_t k = (size_t) 3 * i + c;
  const double pairs = pair_force[k] + solved_damping(i, c);
  return is_driven(i) ? atom->f[i][c] - damping_force[k] - pairs : pairs;
}

/* ----------------------------------------------------------------------
   works and dissipation of the step that ends. What damping gives back where a velocity turns within a
   step is held against what it takes next
------------------------------------------------------------------------- */

void FixEVPEnergy::advance()
{
  double sums[3] = {dissipated_at_begin + dissipated_in_half_step(false), 0.0, 0.0}, all[3];
  for (int i = 0; i < atom->nlocal; i++) {
    Past then;
    memcpy(&then, past[i], sizeof(then));
    double x[3];
    domain->unmap(atom->x[i], atom->image[i], x);
    for (int c = 0; c < 3; c++) {
      const double dx = x[c] - then.x[c];
      const double work = 0.5 * (then.working[c] + working_force(i, c)) * dx;
      if (is_driven(i))
        sums[2] += work;
      else {
        const double damped = 0.5 * (then.damping[c] + damping_force[(size_t) 3 * i + c]) * dx;
        sums[0] -= damped;
        sums[1] -= work + damped;
      }
    }
  }
  MPI_Allreduce(sums, all, 3, MPI_DOUBLE, MPI_SUM, world);

  taken += all[0];
  ledger[DISSIPATED] = std::max(ledger[DISSIPATED], taken);
  ledger[MOVERS] += all[1];
  ledger[OTHERS] += all[2];
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::update_states()
{
  ledger[KINETIC] = last.kinetic - start.kinetic;
  ledger[FIRST] = last.pairs.first - start.pairs.first;
  ledger[SECOND] = last.pairs.second - start.pairs.second;
  ledger[LOST] = EVP::StoredEnergy::lost(start.pairs, last.pairs);
  ledger[CONTACTS] = EVP::StoredEnergy::of_contacts(start.pairs, last.pairs);
}
