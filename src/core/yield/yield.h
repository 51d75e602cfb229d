// SPDX-License-Identifier: GPL-2.0-only
//
// The yield condition of von Mises, which a sphere meets as it flows: what it keeps for that, and by which rule.
#pragma once

#include "core/base/text.h"
#include "core/bonds/sphere_table.h"

#include <algorithm>

namespace EVP {

/// What a sphere keeps, as of the last update. Stresses: 0 before the first one.
struct YieldRecord {
  double factor;           ///< of its limit, and so of the forces of its bonds as they flow
  double factor_around;    ///< the mean of it and of those that it is bonded to
  double stress;           ///< see equivalent_along() [pressure]
  double stress_around;    ///< von Mises' of the mean over both [pressure]
  double pressed;          ///< 1: by what is no pair, see yielding::is_pressed(); else 0

  static constexpr const char *NAME = "yield";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  static constexpr SphereValue TABLE[] = {
      {"yield_factor", "1", 1.0, Range::POSITIVE, true},
      {"yield_factor_around", "1", 1.0, Range::POSITIVE, false},
      {"equivalent_stress", "pressure", 0.0, Range::ANY, true},
      {"equivalent_stress_around", "pressure", 0.0, Range::NOT_NEGATIVE, false},
      {"pressed", "1", 0.0, Range::COUNT, false}};
};
inline const bool has_yield_table = add_table<YieldRecord>();

/// The rule by which spheres of a row with `yield S0` flow at its flow stress, S0 Y(p), whatever the load and the texture of their
/// bonds: the factor of their limit follows the ratio of both stresses. Measured with it (doc/metals.md): bodies are within 5 % of
/// the flow curve in tension, compression and shear, without it within 20 %.
namespace yielding {
  constexpr double SETTLING = 1e-4;    ///< plastic strain in which a factor comes to that around it
  constexpr double STEERING =
      0.6;                        ///< share of a deviation of the stress that is corrected in it
  constexpr double MOST = 2.0;    ///< of a factor, and 1/MOST at least
  constexpr double MOST_DEVIATION = 1.5;    ///< of the stress that is taken, and 1/MOST_DEVIATION
  constexpr double FLOW_STRESS_SHARE =
      1.02;    ///< the mean of `stress` over that of a body: its scatter adds
  constexpr double HARDENING =
      0.5;    ///< share of the flow stress below which flow is by pressure: it hardens nothing
  constexpr double UNBALANCED = 0.2;    ///< see is_pressed()

  /// Is a sphere pressed or held by what is no pair, such as a tool? Then its pairs say less than all of its stress, and it follows
  /// those around it. force: of others than its pairs; stress: around it.
  inline bool is_pressed(double force, double radius, double volume, double stress)
  {
    return force * radius > UNBALANCED * stress * volume;
  }

  /// Does flow harden the sphere? flow_stress: of now [pressure].
  inline bool hardens(const YieldRecord &own, double flow_stress)
  {
    return own.stress_around >= HARDENING * flow_stress;
  }

  /// The factor after the plastic strain has grown by this.
  inline double next_factor(const YieldRecord &own, double growth, double flow_stress)
  {
    const double share = std::min(0.5, growth / SETTLING);
    const double ratio = own.stress / (FLOW_STRESS_SHARE * flow_stress);
    const double taken =
        own.pressed != 0.0 ? 1.0 : std::max(1.0 / MOST_DEVIATION, std::min(MOST_DEVIATION, ratio));
    const double aim = own.factor_around * (1.0 - STEERING * (taken - 1.0));
    return std::max(1.0 / MOST, std::min(MOST, own.factor + share * (aim - own.factor)));
  }
}    // namespace yielding

}    // namespace EVP
