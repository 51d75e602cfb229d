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
  double omega;          ///< share of the way to its initiation, 1 from there on
  double opening;        ///< its plastic strain since then, times the thickness of a layer [length]
  double damage;         ///< share of its limit that is lost, 1: it has parted
  double triaxiality;    ///< mean stress around it over von Mises' of the same
  double strain;         ///< plastic, at its initiation, beyond which nothing hardens it; 0: before
  double stress;         ///< von Mises' around it, at its initiation [pressure]
  double growth;         ///< of its plastic strain, which waits for the stress

  bool has_begun() const { return strain > 0.0; }
  bool has_parted() const { return damage >= 1.0; }

  static constexpr const char *NAME = "failure";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  static constexpr SphereValue TABLE[] = {
      {"omega", "1", 0.0, Range::NOT_NEGATIVE, true},
      {"opening", "distance", 0.0, Range::NOT_NEGATIVE, false},
      {"damage", "1", 0.0, Range::NOT_NEGATIVE, true},
      {"triaxiality_at_update", "1", 0.0, Range::ANY, false},
      {"strain_at_initiation", "1", 0.0, Range::NOT_NEGATIVE, false},
      {"stress_at_initiation", "pressure", 0.0, Range::NOT_NEGATIVE, false},
      {"strain_growth", "1", 0.0, Range::NOT_NEGATIVE, false}};
};
inline const bool has_failure_table = add_table<FailureRecord>();

/// The rule by which spheres fail (Johnson and Cook).
namespace failing {
  /// Thickness of a layer of spheres that part, in diameters: measured 1.61 +- 0.33.
  constexpr double LAYER = 1.6;
  constexpr double LEAST_LIMIT = 0.001;    ///< share of the limit that stays
  /// At or below it nothing fails: that of a pressed pair of spheres, with its round-off.
  constexpr double LEAST_TRIAXIALITY = -1.0 / 3.0 + 1e-9;
  constexpr double MOST_TRIAXIALITY = 3.0;
  constexpr double OF_TENSION = 1.0 / 3.0;
  constexpr double LEAST_STRESS = 0.1;    ///< share of the flow stress, at initiation
  constexpr double LEAST_BY_RATE =
      0.1;    ///< share of the strain at failure that is left, of D4 below 0

  inline bool fails(const Row &row)
  {
    return row.damage_d1 >= 0.0;
  }

  /// T* of Johnson and Cook.
  inline double homologous(const Row &row, double temperature)
  {
    const double share = (temperature - row.soften_tref) / (row.soften_tmelt - row.soften_tref);
    return std::max(0.0, std::min(1.0, share));
  }

  /// Plastic strain at which a metal fails: (D1 + D2 exp(D3 s)) (1 + D4 ln(rate/RATE0)) (1 + D5 T*).
  inline double strain_at_failure(const Row &row, double triaxiality, double rate, double heat)
  {
    constexpr double MOST_EXPONENT = 500.0;    // of a number that is finite
    const double s = std::min(triaxiality, MOST_TRIAXIALITY);
    const double grown = std::exp(std::min(row.damage_d3 * s, MOST_EXPONENT));
    const double by_rate = row.damage_d4 != 0.0 && rate > row.rate_rate0
        ? std::max(LEAST_BY_RATE, 1.0 + row.damage_d4 * std::log(rate / row.rate_rate0))
        : 1.0;
    return (row.damage_d1 + row.damage_d2 * grown) * by_rate * (1.0 + row.damage_d5 * heat);
  }

  /// Share of the way to its initiation by which a sphere moves on, as the plastic strain around it grows; the stress is that around
  /// it. Infinite where a metal fails at no strain.
  inline double progress(const Row &row, double growth, double triaxiality, double rate,
                         double heat)
  {
    if (!(growth > 0.0) || triaxiality <= LEAST_TRIAXIALITY) return 0.0;
    return growth / strain_at_failure(row, triaxiality, rate, heat);
  }

  /// Of a sphere that has begun to fail; none heals, whatever row comes later. By the energy nothing is known before the stress.
  inline double damage_of(const FailureRecord &own, const Row &row)
  {
    const double share = row.rupture == 0.0 ? 1.0
        : row.rupture > 0.0                 ? own.opening / row.rupture
                                            : 0.5 * own.opening * own.stress / row.rupture_energy;
    return std::max(own.damage, std::min(1.0, share));
  }
}    // namespace failing

}    // namespace EVP
