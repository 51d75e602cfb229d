// SPDX-License-Identifier: GPL-2.0-only
//
// How fast the distance of a pair grows over a step of constant velocity.
// Pure C++17.

#ifndef EVP_OPENING_H
#define EVP_OPENING_H

namespace EVP {

/// What turning adds to the opening rate of a pair, times sqrt(gamma).
///
/// Over a step of constant relative velocity v from r, d = |r|, the mean opening rate
/// o = (|r + dt v| - d)/dt satisfies o = u.v + dt (v^2 - o^2)/(2 d) exactly: a pair that turns without
/// strain (o = 0) has u.v = -dt v^2/(2 d). This returns the second term, where o itself is taken to
/// first order in dt.
///
/// along: sqrt(gamma) u.v, u the direction of r. speed_sq: v^2. half_step: sqrt(gamma) dt/(2 d),
/// negative for the step that ended at r: its opening rate is along plus what this returns, too.
/// inv_gamma: 1/gamma.
inline double turning_rate(double along, double speed_sq, double half_step, double inv_gamma)
{
  const double opening = along + half_step * (speed_sq - along * along * inv_gamma);
  return half_step * (speed_sq - opening * opening * inv_gamma);
}

}    // namespace EVP

#endif
