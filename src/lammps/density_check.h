// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/coefficients.h"
#include "cut_offs.h"
#include "lammps_names.h"

#include <string>

namespace EVP {

/// Warns where atoms have a density that does not go with that of the solid in the row of their type: atoms of a body of
/// solid fraction s have the density of the solid, or 1/s of it, with which the body has the mass of the solid.
class DensityCheck : protected Pointers {
 public:
  DensityCheck(LAMMPS *lmp, const Coefficients &coefficients_in, const CutOffs &cuts_in) :
      Pointers(lmp), coefficients(coefficients_in), cuts(cuts_in)
  {
  }

  /// Collective, at the set-up of a run. Again only when it changes.
  void warn();

 private:
  const Coefficients &coefficients;
  const CutOffs &cuts;
  std::string last_warning;
};

}    // namespace EVP
