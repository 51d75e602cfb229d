// SPDX-License-Identifier: GPL-2.0-only
//
// What spheres keep for fix evp/heat.
#pragma once

#include "core/bonds/sphere_table.h"

namespace EVP {

struct HeatRecord {
  double waiting;    ///< heat that its temperature does not have yet [energy]
  double latent;     ///< see ThermalState
  double factor;     ///< what its limit is multiplied by
  double strain;     ///< plastic, when limits moved on last; below 0: not yet
  double rate;       ///< of it, smoothed over RATE_STEPS [1/time]
  double out;        ///< what it has taken and not kept, as it holds its temperature [energy]
  double growth;     ///< see thermal_growth(), that pairs have

  static constexpr const char *NAME = "heat";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  // waiting and out are of the account of the fix, which bond files do not have
  static constexpr SphereValue TABLE[] = {
      {"waiting_heat", "energy", 0.0, Range::NOT_IN_FILES, false},
      {"latent_heat", "energy", 0.0, Range::NOT_NEGATIVE, true},
      {"limit_factor", "1", 1.0, Range::POSITIVE, true},
      {"strain_at_update", "1", -1.0, Range::NOT_NEGATIVE, false},
      {"strain_rate", "1/time", 0.0, Range::ANY, true},
      {"heat_out", "energy", 0.0, Range::NOT_IN_FILES, false},
      {"thermal_growth", "1", 1.0, Range::POSITIVE, true}};
};
inline const bool has_heat_table = add_table<HeatRecord>();

}    // namespace EVP
