// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/coefficients.h"
#include "lammps_names.h"

#include <vector>

namespace EVP {

class PairData;

/// Warns of a timestep above the largest stable one, which nothing else does where neither compute evp/dt nor fix dt/evp
/// is defined. Atoms that do not follow the forces on them are held.
class TimestepCheck : protected Pointers {
 public:
  TimestepCheck(LAMMPS *lmp, const PairData &network_in, const Coefficients &coefficients_in) :
      Pointers(lmp), pair_data(network_in), coefficients(coefficients_in)
  {
  }

  /// Collective, at the set-up of a run, with the packed pairs at the present positions. The same timestep of the same
  /// network is not checked again.
  void warn();

 private:
  const PairData &pair_data;
  const Coefficients &coefficients;
  std::vector<double> checked;    // what the last check depended on

  std::vector<double> describe(const std::vector<double> &inverse_mass) const;
};

}    // namespace EVP
