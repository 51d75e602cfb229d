// SPDX-License-Identifier: GPL-2.0-only
//
// Stresses as tensors, and their invariants.
#pragma once

#include <array>
#include <cmath>

namespace EVP {

/// A symmetric tensor: xx yy zz xy xz yz.
using Tensor = std::array<double, 6>;

inline double mean_stress(const Tensor &stress)
{
  return (stress[0] + stress[1] + stress[2]) / 3.0;
}

inline Tensor deviator(const Tensor &stress)
{
  const double mean = mean_stress(stress);
  return {stress[0] - mean, stress[1] - mean, stress[2] - mean, stress[3], stress[4], stress[5]};
}

inline double contraction(const Tensor &a, const Tensor &b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]);
}

/// Equivalent stress of von Mises.
inline double von_mises(const Tensor &stress)
{
  const Tensor own = deviator(stress);
  return std::sqrt(1.5 * contraction(own, own));
}

/// That of a sphere in the direction of the stress around it, which a sphere alone does not show: 3/2 s : a/von_mises(a), with s and a
/// the deviators of both. Its mean over a body that is stressed uniformly is that of the body; the mean of von_mises(s) is larger by
/// a fifth.
inline double equivalent_along(const Tensor &own, const Tensor &around)
{
  const double size = von_mises(around);
  return size > 0.0 ? 1.5 * contraction(own, deviator(around)) / size : 0.0;
}

}    // namespace EVP
