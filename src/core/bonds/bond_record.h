// SPDX-License-Identifier: GPL-2.0-only
//
// What pairs and spheres keep of their bonds.
#pragma once

#include "core/bonds/sphere_table.h"
#include "core/law/limit.h"

#include <cstddef>
#include <cstdint>
#include <iterator>

namespace EVP {

/// A recorded pair, as one of its atoms keeps it: behind the partner numbers, each with a line in BOND_VALUES. What one is at
/// recording is its default here.
struct BondRecord {
  int64_t partner = 0;    ///< ID of the other atom
  double deq = 0.0;       ///< distance at recording [length]
};

struct BondValue {
  const char *name;    ///< in bond files
  double BondRecord::*value;
  Range range;    ///< what a bond file may give
};
constexpr BondValue BOND_VALUES[] = {{"deq", &BondRecord::deq, Range::POSITIVE}};

/// Where its line is.
constexpr int line_of(double BondRecord::*value)
{
  int k = 0;
  while (BOND_VALUES[k].value != value) k++;
  return k;
}

constexpr size_t BOND_WORDS = 1 + std::size(BOND_VALUES);
static_assert(sizeof(BondRecord) == BOND_WORDS * sizeof(double), "each number has its line");

/// What a pair remembers beside the record of a bond, or without one: as one of its atoms keeps it.
struct Remembered {
  enum Kind : int64_t {
    CONTACT,    ///< repels below its deq, as it has flowed: until it has been beyond R_i + R_j
    APART,      ///< what is left of a bond of eq. 8 that broke: repels below its deq, for good
    INSIDE,    ///< the same as a contact, and may become a bond once it has been apart: see PairRules
    JOINED    ///< a bond that began, beside its record: in the volume energy it is as a pair without a bond
  };
  int64_t partner;
  double deq;    ///< [length]
  int64_t kind;
};
constexpr const char *REMEMBERED[] = {"contact", "apart", "inside", "joined"};    ///< for users

/// Bonds that have changed since the recording.
struct BondCounts {
  int64_t ended = 0;     ///< for good
  int64_t failed = 0;    ///< of these, at a strain; the others passed dlim
  int64_t begun = 0;
};

/// What a sphere keeps of the history of its bonds.
struct Sphere {
  double p;           ///< plastic strain
  double work;        ///< half of what its pairs have dissipated by flow [energy]
  double slip;        ///< of its bonds, that p does not have yet: see FlowSums
  double bonds;       ///< how many it had when p last moved on
  double recorded;    ///< how many were recorded

  /// Takes the slips of its bonds into p; bonds_now: how many it has. Without any they are dropped. share: of them that hardens it.
  void move_on(double bonds_now, double share = 1.0)
  {
    if (bonds > 0.0) p += share * slip / (bonds * SLIP_PER_STRAIN);
    slip = 0.0;
    bonds = bonds_now;
  }

  /// Is it as at the recording of this many bonds?
  bool is_new(size_t bonds_now) const
  {
    return p == 0.0 && work == 0.0 && slip == 0.0 && bonds == (double) bonds_now &&
        recorded == (double) bonds_now;
  }

  static constexpr const char *NAME = "history";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  static constexpr SphereValue TABLE[] = {
      {"plastic_strain", "1", 0.0, Range::NOT_NEGATIVE, true},
      {"plastic_work", "energy", 0.0, Range::NOT_NEGATIVE, true},
      {"slip", "1", 0.0, Range::NOT_NEGATIVE, false},
      {"bonds", "1", ITS_BONDS, Range::COUNT, false},
      {"recorded", "1", ITS_BONDS, Range::COUNT, false}};
};
inline const bool has_history_table = add_table<Sphere>();

/// A plastic strain that was given to a sphere, and waits for its limit to move.
struct GivenStrain {
  static constexpr double NONE = -1.0;
  double p;

  static constexpr const char *NAME = "given";
  static constexpr unsigned NEEDS = NOTHING_ELSE;
  static constexpr SphereValue TABLE[] = {{"given_strain", "1", NONE, Range::NOT_NEGATIVE, false}};
};
inline const bool has_given_table = add_table<GivenStrain>();

}    // namespace EVP
