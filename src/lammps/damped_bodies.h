// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bodies.h"
#include "core/pairs.h"
#include "lammps_names.h"
#include "nodal_exchange.h"

#include <functional>
#include <vector>

namespace EVP {

/// The bodies that the damped pairs of a group connect over all MPI ranks, valid until the next
/// collective build of the list: pairs count within their cut-offs or not. Atoms outside the group
/// connect nothing: their velocity is prescribed.
class DampedBodies : protected Pointers {
 public:
  DampedBodies(LAMMPS *lmp, GhostExchange &exchange_in) : Pointers(lmp), exchange(exchange_in) {}

  const Bodies &found() const { return bodies; }

  /// Must they be found anew for the list? The same on all ranks.
  bool are_due(const PairLists &list) const { return list.common_build != found_build; }
  void forget() { found_build = -1; }

  /// Collective. gamma_of(pair): 0 of a pair that is not damped; the same for all pairs of a law.
  void find(const PairLists &list, int groupbit,
            const std::function<double(const PackedPair &)> &gamma_of);

  double memory_usage() const
  {
    return connected.memory_usage() + bodies.memory_usage() + bytes_of(lowest);
  }

 private:
  GhostExchange &exchange;
  NodeSets connected;    // atoms and ghosts
  Bodies bodies;
  long found_build = -1;

  // per atom and ghost: label of the body (its lowest ID), first and minus last rank with atoms of it
  GhostExchange::Nodal lowest;

  std::vector<double> labels_across() const;
};

}    // namespace EVP
