// SPDX-License-Identifier: GPL-2.0-only
//
// How fast the distance of a pair grows over a step of constant velocity.
// Pure C++17.

#ifndef EVP_CORE_OPENING_H
#define EVP_CORE_OPENING_H

#include <algorithm>
#include <cmath>

namespace EVP {

/// Mean opening rate (|r + dt v| - d)/dt of a pair over a step of constant relative velocity v from r,
/// d = |r|, times sqrt(gamma). Without the cancellation of the two distances.
///
/// It is u.v + dt (v^2 - o^2)/(2 d): a pair that turns without strain (o = 0) has u.v = -dt v^2/(2 d).
///
/// along: sqrt(gamma) u.v, u the direction of r. speed_sq: v^2. half_step: sqrt(gamma) dt/(2 d),
/// negative for the step that ended at r. inv_gamma: 1/gamma.
inline double opening_rate(double along, double speed_sq, double half_step, double inv_gamma)
{
  const double half_change = along + half_step * speed_sq;                    // of d^2, over d dt
  const double ratio_sq = 1.0 + 4.0 * inv_gamma * half_step * half_change;    // of the distances
  return 2.0 * half_change / (1.0 + std::sqrt(std::max(ratio_sq, 0.0)));
}

}    // namespace EVP

#endif
