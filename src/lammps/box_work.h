// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "acting_forces.h"
#include "box_motion.h"

#include <utility>

namespace EVP {

/// The work of a box that deforms with 'remap v', from one force evaluation to the next: on pairs across its boundary;
/// by the forces on atoms whose unwrapped positions it shifts, though the atoms do not move; and on atoms that are
/// wrapped, whose velocity changes. Energies of this MPI rank.
class BoxWork {
 public:
  explicit BoxWork(const PairWork &pairs_in) : pairs(pairs_in) {}

  bool acts = false;       ///< in this run
  double kinetic = 0.0;    ///< before atoms are wrapped

  void begin_run(bool deforms)
  {
    acts = deforms;
    if (!acts) before = false;
  }

  /// At set-up, as LAMMPS moves the box after the last forces of a run: returns the work since these, 0 where they were
  /// of a run without.
  double begin(const Domain *domain)
  {
    box.go_on(domain);
    const double done = carried + through_moved();
    carried = 0.0;
    take_forces();
    return std::exchange(before, true) ? done + through_moved() : 0.0;
  }

  /// By damping forces across the boundary over half a step dt. They act at the rates of the box that dampers see, which
  /// in single steps are not those at which LAMMPS moves it.
  double by_damping(double dt) const
  {
    return 0.5 * dt * work_of(pairs.through.damping, box.rates);
  }

  /// Where the box is about to be that of the next forces. damping, solved: work by explicit and implicit damping in the
  /// half step before.
  void begin_step(const Domain *domain, double damping, double solved)
  {
    box.go_on(domain);
    done = damping + through_moved() + solved;
    prescribed = others = 0.0;
  }

  /// At the next forces: work of the step. damping: that in the half step after.
  double end_step(double damping)
  {
    take_forces();
    return done + std::exchange(carried, 0.0) + damping + through_moved();
  }

  /// Half of what a force would do on an atom along with its unwrapped position.
  double along(imageint image, const double *f) const
  {
    const auto shift = unwrapping(box.moved, image);
    return 0.5 * (f[0] * shift[0] + f[1] * shift[1] + f[2] * shift[2]);
  }

  /// What these do in the step that begins, by the forces on each atom. add() returns that of damping on prescribed ones.
  double prescribed = 0.0, others = 0.0;
  double add(imageint image, bool integrated, const AtomForces &now)
  {
    const double working = along(image, now.working);
    if (integrated) {
      others -= working;
      return 0.0;
    }
    const double damping = along(image, now.damping);
    prescribed += working + damping;
    return damping;
  }

  /// At a neighbor build: LAMMPS may have flipped the box, and has wrapped atoms.
  void note_flip(const Domain *domain) { box.note_flip(domain); }
  void note_wrapped(double kinetic_now) { carried += kinetic_now - kinetic; }

  const Edges &edges() const { return box.edges; }

 private:
  const PairWork &pairs;
  bool before = false;    // at the last forces?
  MovingBox box;
  Edges through{};         // without damping, of the last forces
  double carried = 0.0;    // kinetic energy gained where atoms were wrapped, since the last step
  double done = 0.0;       // so far, in the step under way

  double through_moved() const { return 0.5 * work_of(through, box.moved); }
  void take_forces()
  {
    through = pairs.through.whole;
    for (int c = 0; c < 6; c++) through[c] -= pairs.through.damping[c];
  }
};

}    // namespace EVP
