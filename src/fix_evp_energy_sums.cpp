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
   Between steps atoms hold the mean of the two half-step velocities, and f what
   takes one to the other. At set-up the pair style saw the mean itself.
------------------------------------------------------------------------- */

void FixEVPEnergy::find_velocities(bool at_setup)
{
  velocities.resize((size_t) VELOCITIES * (atom->nlocal + atom->nghost));
  for (int i = 0; i < atom->nlocal; i++) {
    double *mean = &velocities[(size_t) VELOCITIES * i], *before = mean + 3;
    for (int c = 0; c < 3; c++) {
      mean[c] = atom->v[i][c];
      before[c] = at_setup ? mean[c] : mean[c] - half_kick(i) * atom->f[i][c];
    }
  }
  if (pair->damps_explicitly()) to_ghosts(velocities);
}

/* ----------------------------------------------------------------------
   pair_force is left with the force of the pairs, damping included, on local atoms.
   A bond's energy counts from its rest; what it cost to take one beyond dlim
   stays in the ledger as the depth that is missing
------------------------------------------------------------------------- */

FixEVPEnergy::Instant FixEVPEnergy::evaluate()
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  const int nreact = force->newton_pair ? nall : nlocal;
  pair_force.assign((size_t) 3 * nall, 0.0);

  double sums[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, all[6];
  for (int i = 0; i < nlocal; i++) {
    if (!is_driven(i)) continue;    // the energy of a mover is its own affair
    const double mass = EVP::scene::mass(atom, i);
    for (int c = 0; c < 3; c++) {
      const double v = atom->v[i][c], kick = half_kick(i) * atom->f[i][c];
      sums[0] += 0.5 * force->mvv2e * mass * (v * v + kick * kick);
    }
  }

  const EVP::PackedList &list = pair->packed_pairs();
  const auto x = EVP::scene::rows(atom->x);
  for (const auto &row : list.rows)
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &p = list.pairs[n];
      const int i = row.i, j = p.j;
      const EVP::PairGeometry g(x, i, j);
      if (g.dsq > p.cutsq) continue;
      // without newton both owners of a pair across processes hold it
      const double weight = j < nreact ? 1.0 : 0.5;
      const double d = std::sqrt(g.dsq), deq = 1.0 / p.inv_deq, cut = p.cut;

      const EVP::Law &law = pair->law_of(p);
      if (p.is_bond) {
        const double xi_s = law.parameters().xi_s;
        const double xi = std::min(std::max(d / deq - 1.0, -xi_s), xi_s);
        const double first = law.energy(deq * (1.0 + xi), deq, deq);
        sums[1] += weight * first;
        sums[2] += weight * (law.energy(d, deq, deq) - first);
        sums[3] += weight * law.energy(cut, deq, deq);
      } else
        sums[4] += weight * law.energy(d, deq, cut);

      double over_d = law.force(d, deq) / d;
      const double gamma = law.parameters().gamma;    // without that of implicit pairs
      if (gamma > 0.0) {
        const double *vi = &velocities[(size_t) VELOCITIES * i];
        const double *vj = &velocities[(size_t) VELOCITIES * j];
        const double damping = EVP::damping_over_distance(gamma, g, vi + 3, vj + 3);
        sums[5] -= weight * damping *
            (g.dx * (vi[0] - vj[0]) + g.dy * (vi[1] - vj[1]) + g.dz * (vi[2] - vj[2]));
        over_d += damping;
      }
      const double f[3] = {over_d * g.dx, over_d * g.dy, over_d * g.dz};
      for (int c = 0; c < 3; c++) {
        pair_force[(size_t) 3 * i + c] += f[c];
        if (j < nreact) pair_force[(size_t) 3 * j + c] -= f[c];
      }
    }

  to_owners(pair_force);
  if (implicit && pair->damps_implicitly())
    for (int i = 0; i < nlocal; i++)
      for (int c = 0; c < 3; c++) {
        const size_t k = (size_t) 3 * i + c;
        const double damping = implicit->applied_damping()[k];
        sums[5] -= damping * atom->v[i][c];
        pair_force[k] += damping;
      }
  MPI_Allreduce(sums, all, 6, MPI_DOUBLE, MPI_SUM, world);
  return {all[0], all[1], all[2], all[3], all[4], all[5]};
}

/* ----------------------------------------------------------------------
   from the last step to this one
------------------------------------------------------------------------- */

void FixEVPEnergy::advance(const Instant &now, double dt)
{
  double work[2] = {0.0, 0.0}, all[2];    // of the movers, of other forces
  for (int i = 0; i < atom->nlocal; i++) {
    Past then;
    memcpy(&then, past[i], sizeof(then));
    double x[3];
    domain->unmap(atom->x[i], atom->image[i], x);
    for (int c = 0; c < 3; c++) {
      const double dx = x[c] - then.x[c], pairs = pair_force[(size_t) 3 * i + c];
      if (is_driven(i))
        work[1] += 0.5 * (then.others[c] + atom->f[i][c] - pairs) * dx;
      else
        work[0] -= 0.5 * (then.pairs[c] + pairs) * dx;
    }
  }
  MPI_Allreduce(work, all, 2, MPI_DOUBLE, MPI_SUM, world);

  ledger[KINETIC] = now.kinetic - start.kinetic;
  ledger[FIRST] = now.first - start.first;
  ledger[SECOND] = now.second - start.second;
  ledger[LOST] = depth_at_start - now.depth;
  ledger[CONTACTS] = now.contacts - start.contacts;
  ledger[DISSIPATED] += 0.5 * dt * (last.dissipation + now.dissipation);
  ledger[MOVERS] += all[0];
  ledger[OTHERS] += all[1];
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::remember()
{
  for (int i = 0; i < atom->nlocal; i++) {
    Past now;
    domain->unmap(atom->x[i], atom->image[i], now.x);
    for (int c = 0; c < 3; c++) {
      now.pairs[c] = pair_force[(size_t) 3 * i + c];
      now.others[c] = atom->f[i][c] - now.pairs[c];
    }
    memcpy(past[i], &now, sizeof(now));
  }
}
