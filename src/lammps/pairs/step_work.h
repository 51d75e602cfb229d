// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/pairs/pairs.h"
#include "lammps/pairs/effect.h"

#include "atom.h"
#include "update.h"

#include <algorithm>

namespace EVP {

/// Where forces fall at fixed distances, before those of a step: the half step that led there had the force of before, the other half
/// has that of now. Work is done by the mean of both, and what is missing to that of the force of before is no dissipation.
class StepWork : protected Pointers {
 public:
  explicit StepWork(LAMMPS *lmp) : Pointers(lmp) {}

  /// Collective, before any pair is asked for. Velocities of ghosts are needed where someone asks what has been dissipated in a
  /// step.
  void begin(const PairLists &lists, const Effects &effects, PerAtomComm &exchange)
  {
    const bool asked = update->whichflag == 1 && effects.any(&Effect::takes_dissipated);
    velocities.resize(asked ? lists.nall : 0);
    if (!asked) return;
    for (int i = 0; i < lists.nlocal; i++) std::copy_n(atom->v[i], 3, velocities[i]);
    if (update->ntimestep == update->firststep + 1)
      exchange.forward_comm(velocities);    // a box that deforms is still that of the set-up
    else
      exchange.forward_comm_velocities(velocities);
  }
  void skip() { velocities.resize(0); }

  /// Of a pair whose force has fallen by this much, positive repels [energy].
  double of(const PlacedPair &p, double force_lost) const
  {
    if (velocities.empty() || p.is_past_cutoff()) return 0.0;
    const Vector parting = Vector(velocities[p.i]) - Vector(velocities[p.j]);
    return -0.5 * force_lost * update->dt * dot(p.g, parting) / p.distance();
  }

 private:
  AtomValues velocities{3};    // of atoms and ghosts, of the half step
};

}    // namespace EVP
