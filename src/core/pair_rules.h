// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/text.h"

#include <algorithm>
#include <string>

namespace EVP {

/// What acts between two particles that were not recorded as a pair.
enum class Contact : int { LITERAL, REPULSIVE, NONE };
constexpr const char *CONTACTS[] = {"literal", "repulsive", "none"};    ///< for users

/// What the pair style was told of all its pairs.
struct PairRules {
  Contact contact = Contact::LITERAL;
  double overlap = 0.3;         ///< warn below d = (1 - overlap) (R_i + R_j)
  bool flows = false;           ///< unload elastic: flow beyond xi_s stays
  double break_strain = 0.0;    ///< bonds break for good beyond (1 + this) deq; 0: never

  bool breaks() const { return break_strain > 0.0; }

  /// Distance up to which a bond acts [all: length]. dlim: alpha (R_i + R_j).
  double cut_of_bond(double deq, double dlim) const
  {
    return breaks() ? std::min(dlim, (1.0 + break_strain) * deq) : dlim;
  }

  /// Distance below which what is left of a broken bond repels [all: length]: the sum of the radii, or,
  /// where the spheres still overlap when it breaks, where it broke. So breaking makes no force and no
  /// energy.
  double rest_of_broken(double sum_radii, double deq) const
  {
    return breaks() ? std::min(sum_radii, (1.0 + break_strain) * deq) : sum_radii;
  }

  /// Do bonds have values that change?
  bool has_history() const { return flows || breaks(); }
};

/// Which atoms are one body: all, those of one type, or those of one molecule. Pairs of two bodies are
/// not recorded, and only repel.
enum class Within : int { ALL, TYPE, MOLECULE };
constexpr const char *WITHINS[] = {"all", "type", "molecule"};    ///< users give the last two

/// Throws BadInput.
inline Within parse_within(const std::string &word)
{
  for (const Within one : {Within::TYPE, Within::MOLECULE})
    if (word == WITHINS[(int) one]) return one;
  throw BadInput("within must be type or molecule (which atoms are one body), got '" + shown(word) +
                 "'");
}

}    // namespace EVP
