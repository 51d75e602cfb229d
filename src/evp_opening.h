// SPDX-License-Identifier: GPL-2.0-only
//
// How fast the distance of a pair grows over a step of constant velocity.
// Pure C++17.

#ifndef EVP_OPENING_H
#define EVP_OPENING_H

namespace EVP {

/// What turning adds to the opening rate of a pair [velocity].
///
/// Over a step of constant relative velocity v from r, d = |r|, the mean opening rate
/// o = (|r + dt v| - d)/dt satisfies o = u.v + dt (v^2 - o^2)/(2 d) exactly: a pair that turns without
/// strain (o = 0) has u.v = -dt v^2/(2 d). This returns dt (v^2 - o^2)/(2 d) of a known velocity, whose
/// own o is taken to second order in dt.
///
/// speed_sq: v^2. along: u.v, u the direction of r. half_step: dt/(2 d). side: +1 if r is where the step
/// with that velocity begins, -1 where it ends, 0 in its middle.
inline double turning_rate(double speed_sq, double along, double half_step, int side)
{
  const double opening = along + side * half_step * (speed_sq - along * along);
  return half_step * (speed_sq - opening * opening);
}

}    // namespace EVP

#endif
