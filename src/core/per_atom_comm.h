// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <vector>

namespace EVP {

/// Exchanges values of particles and their ghosts between MPI ranks. Collective.
class PerAtomComm {
 public:
  using Values = std::vector<double>;    ///< a fixed number of values per particle and ghost

  /// Ghosts take the values of their owners.
  virtual void forward_comm(Values &) = 0;

  /// The same for velocities: periodic images may move against their owners.
  virtual void forward_comm_velocities(Values &velocities) { forward_comm(velocities); }

  /// Owners add what their ghosts hold; nothing where ghosts take no reactions.
  virtual void reverse_comm(Values &) = 0;

  /// Of a value of each MPI rank.
  virtual double sum(double here) = 0;

 protected:
  ~PerAtomComm() = default;
};

}    // namespace EVP
