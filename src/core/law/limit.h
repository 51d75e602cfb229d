// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law/row.h"

#include <algorithm>
#include <limits>

namespace EVP {

/// The mean of |ln(deq_new/deq_old)| over the bonds of a sphere, over its plastic strain. Measured: with it the mean of p
/// over a body is the macroscopic plastic strain within 5 %. If bonds were stretched alike it would be 0.385.
constexpr double SLIP_PER_STRAIN = 0.31;

/// How far the bonds of a sphere hold, by its plastic strain p: y = xi_s Y(p) of the row of its type. Y is the table of the
/// row, constant beyond its last point. Without one it is linear, with the slope of the second regime where bonds flow
/// alike, and constant once y has reached the strongest strain.
class Limit {
 public:
  Limit() = default;    ///< holds for ever

  /// Throws BadInput where flow would not end.
  explicit Limit(const Row &row) : xi_s(row.xi_s), most(strongest_strain(row)), flow(row.flow)
  {
    if (!(xi_s < most))
      throw BadInput("plasticity isotropic needs xi_s below " + rounded(most) +
                     ", where a bond is strongest, got " + rounded(xi_s));
    if (flow.n > 0) return;
    const double ratio = row.m2 * row.n2 * row.e2 / (row.m1 * row.n1 * row.e1);
    if (!(ratio < 1.0))
      throw BadInput("plasticity isotropic needs a 'flow' table, or a second regime less stiff "
                     "than the first, got m2 n2 e2 = " +
                     rounded(row.m2 * row.n2 * row.e2) + " and m1 n1 e1 = " +
                     rounded(row.m1 * row.n1 * row.e1) + ": flow would not end");
    slope = SLIP_PER_STRAIN * ratio / (1.0 - ratio);
  }

  /// factor: by temperature and strain rate. Never beyond the strongest strain: flow would not end.
  double operator()(double p, double factor = 1.0) const
  {
    const double y = flow.n > 0 ? xi_s * flow(p) : std::min(xi_s + slope * p, most);
    return std::min(factor * y, most);
  }

 private:
  double xi_s = std::numeric_limits<double>::infinity(), slope = 0.0, most = xi_s;
  FlowTable flow;
};

}    // namespace EVP
