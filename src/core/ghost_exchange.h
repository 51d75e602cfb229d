// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <vector>

namespace EVP {

/// Exchanges values of particles and their ghosts between MPI ranks. Collective.
class GhostExchange {
 public:
  using Nodal = std::vector<double>;    ///< a fixed number of values per particle and ghost

  /// Ghosts take the values of their owners.
  virtual void to_ghosts(Nodal &) = 0;

  /// The same for velocities: periodic images may move against their owners.
  virtual void velocities_to_ghosts(Nodal &velocities) { to_ghosts(velocities); }

  /// Owners add what their ghosts hold; nothing where ghosts take no reactions.
  virtual void to_owners(Nodal &) = 0;

  /// Owners take the lowest of their values and those of their ghosts, whether ghosts take reactions or
  /// not. Returns whether a value on this MPI rank fell.
  virtual bool lower_owners(Nodal &) = 0;

  /// Of a value of each MPI rank.
  virtual double sum(double here) = 0;

 protected:
  ~GhostExchange() = default;
};

}    // namespace EVP
