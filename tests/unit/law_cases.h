// SPDX-License-Identifier: GPL-2.0-only
//
// What the tests of the law share: scales of round-off and a row's name in a message.

#ifndef EVP_LAW_CASES_H
#define EVP_LAW_CASES_H

#include "core/law.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>

namespace law_cases {

constexpr double EPSILON = std::numeric_limits<double>::epsilon();

// Rounding d/deq alone moves the force by EPSILON m n e/deq; at xi_s = 0.005 that is 4e-14 of the
// force at xi_s, so 1e-12 leaves room for the powers and none for a wrong formula.
constexpr double REFERENCE = 1e-12;

inline std::string name_of(const EVP::Row &row)
{
  std::ostringstream text;
  text << "(m1, n1) = (" << row.m1 << ", " << row.n1 << "), (m2, n2) = (" << row.m2 << ", "
       << row.n2 << "), e1 = " << row.e1 << ", e2 = " << row.e2 << ", xi_s = " << row.xi_s;
  return text.str();
}

/// The energy below which a difference means nothing: round-off grows with the steeper regime.
inline double energy_scale(const EVP::Row &row)
{
  return std::max(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2) * row.xi_s;
}

}    // namespace law_cases

#endif
