// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <algorithm>

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

}    // namespace EVP
