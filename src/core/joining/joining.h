// SPDX-License-Identifier: GPL-2.0-only
//
// Where contacts of two bodies become bonds: what a sphere keeps for that, and by which criterion.
#pragma once

#include "core/bonds/sphere_table.h"
#include "core/pairs/contacts.h"
#include "core/pairs/pairs.h"
#include "core/stress/stress.h"

#include <algorithm>
#include <cmath>

namespace EVP {

/// What a sphere keeps, as of the last update.
struct JoiningRecord {
  double
      touched;    ///< 1: it has been within the distance where pairs join of a sphere of another body; else 0
  double exposure;    ///< share of its surface that is new since then

  static constexpr const char *NAME = "joining";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  static constexpr SphereValue TABLE[] = {{"touched", "1", 0.0, Range::COUNT, false},
                                          {"exposure", "1", 0.0, Range::NOT_NEGATIVE, true}};
};
inline const bool has_joining_table = add_table<JoiningRecord>();

/// The same where a pressure is asked for: the stress around the sphere over its flow stress.
struct RelativeStressRecord {
  Tensor stress;

  static constexpr const char *NAME = "relative_stress";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  static constexpr SphereValue TABLE[] = {{"relative_stress_xx", "1", 0.0, Range::ANY, false},
                                          {"relative_stress_yy", "1", 0.0, Range::ANY, false},
                                          {"relative_stress_zz", "1", 0.0, Range::ANY, false},
                                          {"relative_stress_xy", "1", 0.0, Range::ANY, false},
                                          {"relative_stress_xz", "1", 0.0, Range::ANY, false},
                                          {"relative_stress_yz", "1", 0.0, Range::ANY, false}};
};
inline const bool has_relative_stress_table = add_table<RelativeStressRecord>();

/// The criterion by which surfaces bond: they are stretched until their films break, and pressed (Bay, Welding Journal 62 (1983) 137s).
namespace joining {
  /// Exposure (A1 - A0)/A1 of a surface after its plastic strain has grown: that of a body which is compressed by this strain.
  inline double exposed(double before, double growth)
  {
    return 1.0 - (1.0 - before) * std::exp(-std::max(0.0, growth));
  }

  /// Pressure along r.
  inline double pressure_along(const double *stress, const Vector &r)
  {
    const double *const s = stress;
    const double along = r.x * r.x * s[0] + r.y * r.y * s[1] + r.z * r.z * s[2] +
        2.0 * (r.x * r.y * s[3] + r.x * r.z * s[4] + r.y * r.z * s[5]);
    return -along / dot(r, r);
  }

  /// Of two spheres: the means of their exposures, and of their pressures over their flow stresses.
  inline bool is_met(const JoinRule &rule, double exposure, double pressure)
  {
    return exposure >= rule.exposure && (rule.pressure == 0.0 || pressure >= rule.pressure);
  }
}    // namespace joining

}    // namespace EVP
