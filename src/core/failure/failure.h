// SPDX-License-Identifier: GPL-2.0-only
//
// Ductile failure of a sphere: when it begins (Johnson and Cook), and how it goes on until the sphere has parted.
#pragma once

#include "core/bonds/sphere_table.h"
#include "core/law/row.h"

#include <algorithm>
#include <cmath>

namespace EVP {

/// What a sphere keeps, as of the last update.
struct FailureRecord {
  double omega;    ///< share of the way to its initiation, 1 from there on
  double
      opening;    ///< its plastic strain since then, times the thickness of a layer of failed spheres [length]
  double damage;         ///< share of its limit that is lost, 1: it has parted
  double triaxiality;    ///< mean over von Mises' stress of the mean around it
  double strain;         ///< plastic, at its initiation: beyond it nothing hardens it
  double stress;         ///< von Mises' around it, at its initiation [pressure]
  double growth;         ///< of its plastic strain at the last update, which waits for the stress

  static constexpr const char *NAME = "failure";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  static constexpr SphereValue TABLE[] = {
      {"omega", "1", 0.0, Range::NOT_NEGATIVE, true},
      {"opening", "distance", 0.0, Range::NOT_NEGATIVE, true},
      {"damage", "1", 0.0, Range::NOT_NEGATIVE, true},
      {"mean_triaxiality", "1", 0.0, Range::ANY, true},
      {"strain_at_initiation", "1", 0.0, Range::NOT_NEGATIVE, true},
      {"stress_at_initiation", "pressure", 0.0, Range::NOT_NEGATIVE, false},
      {"strain_growth", "1", 0.0, Range::ANY, false}};
};
inline const bool has_failure_table = add_table<FailureRecord>();

namespace failing {
  constexpr double LAYER =
      1.6;    ///< thickness of a layer of spheres that have parted, in diameters: measured 1.61 +- 0.33
  constexpr double LEAST_LIMIT =
      0.001;    ///< share of the limit that stays until a sphere has parted
  constexpr double LEAST_TRIAXIALITY = -1.0 / 3.0;    ///< at or below it nothing fails
  constexpr double MOST_TRIAXIALITY = 3.0;
  constexpr double OF_TENSION = 1.0 / 3.0;

  /// Plastic strain at which a metal fails: (D1 + D2 exp(D3 s)) (1 + D4 ln(rate/RATE0)) (1 + D5 T*). heat: T*, 0 to 1.
  inline double strain_at_failure(const Row &row, double triaxiality, double rate, double heat)
  {
    const double s = std::min(triaxiality, MOST_TRIAXIALITY);
    const double by_rate =
        rate > row.rate_rate0 ? 1.0 + row.damage_d4 * std::log(rate / row.rate_rate0) : 1.0;
    return (row.damage_d1 + row.damage_d2 * std::exp(row.damage_d3 * s)) * std::max(by_rate, 0.0) *
        std::max(1.0 + row.damage_d5 * heat, 0.0);
  }

  /// How far the opening goes [length]; 0: the sphere parts at once.
  inline double full_opening(const Row &row, double stress)
  {
    if (row.rupture >= 0.0) return row.rupture;
    return stress > 0.0 ? 2.0 * row.rupture_energy / stress : 0.0;
  }

  /// Once it has begun.
  inline double damage_of(const FailureRecord &own, const Row &row)
  {
    const double full = full_opening(row, own.stress);
    return own.opening >= full ? 1.0 : own.opening / full;
  }
}    // namespace failing

}    // namespace EVP
