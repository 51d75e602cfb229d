// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/row.h"

#include <iterator>
#include <string>

namespace EVP {

/// What a row may go on with, by keyword; 0 where it does not.
struct RowKeywords {
  double spacing, coordination;    ///< of the bodies that it holds for: core/bond_measures.h
  double kv;                       ///< of fix evp/volume [energy]
  double density;                  ///< of the solid [mass/volume]

  /// Does the row name the bodies that it holds for? Both or none: parse_row() sees to that.
  bool is_scaled() const { return spacing > 0.0; }
};

/// A row as it is given: the coefficients, and what its keywords say.
struct GivenRow {
  Row row;
  RowKeywords keywords;
};

constexpr double HIGHEST_KV = 1.0e100;    // whose squares and forces are finite

struct KeywordMember {
  const char *key;
  double RowKeywords::*value;
  bool (*holds)(double);
  const char *rule;    ///< in messages
};

namespace rule {
  inline bool is_positive(double x)
  {
    return x > 0.0;
  }
  inline bool is_volume_stiffness(double x)
  {
    return x >= 0.0 && x <= HIGHEST_KV;
  }
}    // namespace rule

/// All keywords, in the order in which they are written.
constexpr KeywordMember KEYWORDS[] = {
    {"spacing", &RowKeywords::spacing, rule::is_positive,
     "must be positive (the mean deq of the bonds that the row holds for)"},
    {"coordination", &RowKeywords::coordination, rule::is_positive,
     "must be positive (the bonds per particle that the row holds for)"},
    {"kv", &RowKeywords::kv, rule::is_volume_stiffness,
     "must lie between 0 and 1e100 (an energy per atom, for fix evp/volume row)"},
    {"density", &RowKeywords::density, rule::is_positive,
     "must be positive (the density of the solid)"}};
constexpr int NKEYWORDS = (int) std::size(KEYWORDS);

inline bool operator==(const RowKeywords &a, const RowKeywords &b)
{
  return are_same(KEYWORDS, a, b);
}

inline bool has_any(const RowKeywords &given)
{
  return !(given == RowKeywords{});
}

/// "spacing, coordination, kv, density", for messages.
inline std::string row_keywords()
{
  return keys_of(KEYWORDS, ", ");
}

}    // namespace EVP
