// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/body_solves.h"
#include "core/dampers.h"
#include "lammps_names.h"
#include "nodal_exchange.h"

#include <string>

namespace EVP {

/// Solves M (v+ - v) = h (F - C v+ - T) for the velocities v+ of a group by conjugate gradients, matrix
/// free, preconditioned by M, over all MPI ranks, each body by itself: a still one does not wait in the
/// residual of a violent one. Other atoms enter with velocities that are prescribed.
///
/// T holds gamma times what turning adds to the opening rates, that of v+ in the end: it changes little
/// from step to step, so that the T of the last step mostly suffices.
///
/// M keeps the momentum of every iterate exact: pair forces have none, and the start carries that of
/// M v + h F. The tolerance is against what the damping does, M (v - v*), v* = v + h M^-1 F: this is
/// Galilean invariant, so that a body in flight is not solved worse than one at rest, and does not grow
/// with h C, as h C v* would (it exceeds the motion itself where damping is strong).
class DampingSolver : protected Pointers {
 public:
  using Nodal = GhostExchange::Nodal;

  double tolerance = 1.0e-3;
  int max_iterations = 500;

  /// who: the owner, in error messages.
  DampingSolver(LAMMPS *lmp, const std::string &who_in, GhostExchange &exchange_in,
                Dampers &dampers_in, const Bodies &bodies_in) :
      Pointers(lmp),
      who(who_in), exchange(exchange_in), dampers(dampers_in), bodies(bodies_in)
  {
  }

  /// Collective. From v and F in atom->v and atom->f, over a time h: the timestep or its second half.
  /// prescribed: velocities v+ of local atoms, used outside the group. applied: the force that took v to
  /// v+ beside F, on the group, and the reaction of the dashpots elsewhere. Returns the number of
  /// iterations. Stops if max_iterations do not suffice or velocities are non-finite.
  int solve(double h, int groupbit, const Nodal &prescribed, Nodal &applied);

  void forget_turns() { most_turned = 0.0; }

  /// Collective. Largest angle by which a dashpot turned in a step since the last call [rad].
  double take_largest_turn();

  double memory_usage() const
  {
    return solves.memory_usage() +
        bytes_of(velocities, reaction, mobility, inertia, undamped, change, residual, direction,
                 direction_product);
  }

 private:
  const std::string who;
  GhostExchange &exchange;
  Dampers &dampers;
  const Bodies &bodies;
  BodySolves solves;

  double h = 0.0;
  const Nodal *prescribed = nullptr;
  Nodal velocities, reaction;    // with ghosts
  Nodal mobility, inertia;       // ftm2v / mass and its inverse, zero for atoms outside the group
  Nodal undamped;                // v*
  Nodal change, residual, direction, direction_product;    // change: v+ - v*
  double most_turned = 0.0;                                // square of half the largest angle

  void warm_start();
  int iterate(int iteration);
  bool turning_settled(Nodal &applied);
  BodySolves::State judge_residuals();
  void exchange_velocities();
};

}    // namespace EVP
