// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/damping/cg.h"
#include "core/damping/dampers.h"
#include "lammps/base/lammps_names.h"
#include "lammps/pairs/pair_data.h"

#include <string>
#include <vector>

namespace EVP {

/// Solves M (v+ - v) = h (F - C v+ - T) for the velocities v+ of a group by conjugate gradients, matrix
/// free, preconditioned by M, over all MPI ranks, each body by itself: a still one does not wait in the
/// residual of a violent one. Other atoms enter with velocities that are prescribed.
///
/// T holds gamma times what rotation adds to the separation rates, that of v+ in the end: it changes
/// little from step to step, so that the T of the last step mostly suffices.
///
/// M keeps the momentum of every iterate exact: pair forces have none, and that of the start is that of
/// M v + h F. The tolerance is against what the damping does, M (v - v*), v* = v + h M^-1 F: this is
/// Galilean invariant, so that a body in flight is not solved worse than one at rest, and does not grow
/// with h C, as h C v* would (it exceeds the motion itself where damping is strong).
class DampingSolver : protected Pointers {
 public:
  double tolerance = 1.0e-3;
  int max_iterations = 500;

  /// who: the owner, in error messages.
  DampingSolver(LAMMPS *lmp, const std::string &who_in, PerAtomComm &ghosts_in,
                Dampers &dampers_in) :
      Pointers(lmp),
      who(who_in), ghosts(ghosts_in), dampers(dampers_in)
  {
  }

  /// Collective. Which atoms of the group damped pairs of the list connect, within their cutoffs or not:
  /// valid until its next collective build.
  void find_bodies(const PairData &, int groupbit);

  /// Must they be found anew for the list? The same on all ranks.
  bool bodies_are_due(const PairLists &list) const { return list.common_build != bodies_build; }

  /// Drops bodies and rotations of the last run.
  void reset()
  {
    bodies_build = -1;
    most_rotated = 0.0;
    passes_warned = false;
  }

  /// Collective. From v and F in atom->v and atom->f, over a time h: the timestep or its second half.
  /// prescribed: velocities v+ of local atoms, used outside the group. applied: the force that took v to
  /// v+ beside F, on the group, and the reaction of the dashpots elsewhere. Returns the number of
  /// iterations. Stops if max_iterations do not suffice or velocities are non-finite.
  int solve(double h, int groupbit, const AtomValues &prescribed, AtomValues &applied);

  /// Collective. Largest angle by which a dashpot rotated in a step since the last call [rad].
  double largest_rotation();

  double memory_usage() const
  {
    return bodies.memory_usage() + cg.memory_usage() +
        bytes_of(labels, links, velocities, reaction, mobility, inertia, undamped, change, residual,
                 direction, direction_product, noise);
  }

 private:
  const std::string who;
  PerAtomComm &ghosts;
  Dampers &dampers;
  Bodies bodies;
  AtomValues labels{1};
  std::vector<Bodies::Link> links;
  long bodies_build = -1;
  ConjugateGradients cg;

  double h = 0.0;
  AtomValues velocities{3}, reaction{3};    // with ghosts
  // ftm2v / mass and its inverse, zero for atoms outside the group
  AtomValues mobility{3}, inertia{3};
  AtomValues undamped{3};                                                   // v*
  AtomValues change{3}, residual{3}, direction{3}, direction_product{3};    // change: v+ - v*
  std::vector<double> noise;                                                // one value per atom
  bool passes_warned = false;
  double most_rotated = 0.0;    // square of half the largest angle

  int iterate(int iteration);
  bool meets_tolerance();
  void exchange_velocities(const AtomValues &prescribed);
  void subtract_damping();
};

}    // namespace EVP
