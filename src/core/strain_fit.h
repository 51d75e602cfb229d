// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/pairs.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace EVP {

/// A symmetric tensor: xx, yy, zz, xy, xz, yz.
using SymmetricTensor = std::array<double, 6>;

inline double mean_of(const SymmetricTensor &t)
{
  return (t[0] + t[1] + t[2]) / 3.0;
}

/// Square of the norm of the deviator, s:s.
inline double deviator_squared(const SymmetricTensor &t)
{
  const double mean = mean_of(t);
  double sum = 0.0;
  for (int c = 0; c < 3; c++) sum += (t[c] - mean) * (t[c] - mean) + 2.0 * t[c + 3] * t[c + 3];
  return sum;
}

/// The strain of a particle that fits those of its bonds best: minimizes sum_j w_j (u_j.E.u_j - p_j)^2 over
/// the tensors E, with u the direction of a bond, p its strain, w its weight. It is E itself where p = u.E.u
/// for all bonds and these have six directions that are independent enough. Where they have fewer, it is the
/// smallest of the best ones.
///
/// The sums can be added up in any order, and on several MPI ranks.
class StrainFit {
 public:
  static constexpr int NSUMS = 27;    ///< of w v v^T, its lower half, and of w p v

  /// Of a bond: it fades as deq nears dlim [both lengths], so that none enters or leaves with a jump at rest.
  static double weight(double deq, double dlim)
  {
    const double ratio = deq / dlim;
    return std::max(0.0, 1.0 - ratio * ratio);
  }

  /// Adds a bond to sums [NSUMS].
  static void add(const PairGeometry &u, double weight, double strain, double *sums)
  {
    // v.e = u.E.u with the off-diagonal entries of E times sqrt(2) in e, which keeps its norm
    const double root = std::sqrt(2.0);
    const double v[6] = {u.x * u.x / u.dsq,        u.y * u.y / u.dsq,
                         u.z * u.z / u.dsq,        root * u.x * u.y / u.dsq,
                         root * u.x * u.z / u.dsq, root * u.y * u.z / u.dsq};
    for (int a = 0; a < 6; a++) {
      for (int b = 0; b <= a; b++) *sums++ += weight * v[a] * v[b];
    }
    for (const double component : v) *sums++ += weight * strain * component;
  }

  /// The strain from the sums, 0 where there is no bond.
  static SymmetricTensor solve(const double *sums)
  {
    Matrix m;
    for (int a = 0; a < 6; a++)
      for (int b = 0; b <= a; b++) m[a][b] = m[b][a] = *sums++;
    Matrix axes = diagonalize(m);    // the eigenvalues are on the diagonal of m then
    double largest = 0.0;
    for (int a = 0; a < 6; a++) largest = std::max(largest, m[a][a]);
    SymmetricTensor e = {};
    for (int k = 0; k < 6; k++) {
      if (!(m[k][k] > RANK * largest)) continue;
      double along = 0.0;
      for (int a = 0; a < 6; a++) along += axes[a][k] * sums[a];
      for (int a = 0; a < 6; a++) e[a] += axes[a][k] * along / m[k][k];
    }
    for (int a = 3; a < 6; a++) e[a] /= std::sqrt(2.0);
    return e;
  }

 private:
  using Matrix = std::array<std::array<double, 6>, 6>;

  // Directions that the bonds determine less, compared with the best, are left out: there the strain would be
  // the scatter of the bonds' own, many times enlarged, as in a sphere at an edge of the body.
  static constexpr double RANK = 1e-3;
  static constexpr int MOST_SWEEPS = 20;

  /// Jacobi's rotations: m becomes diagonal; returns its eigenvectors, in columns.
  static Matrix diagonalize(Matrix &m)
  {
    Matrix axes = {};
    double norm = 0.0;
    for (int a = 0; a < 6; a++) {
      axes[a][a] = 1.0;
      for (int b = 0; b < 6; b++) norm += m[a][b] * m[a][b];
    }
    for (int sweep = 0; sweep < MOST_SWEEPS; sweep++) {
      double off = 0.0;
      for (int a = 0; a < 6; a++)
        for (int b = 0; b < a; b++) off += m[a][b] * m[a][b];
      if (!(off > 1e-30 * norm)) break;
      for (int p = 0; p < 5; p++)
        for (int q = p + 1; q < 6; q++) {
          if (m[p][q] == 0.0) continue;
          const double theta = 0.5 * (m[q][q] - m[p][p]) / m[p][q];
          const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::hypot(theta, 1.0));
          const double c = 1.0 / std::hypot(t, 1.0), s = t * c;
          for (int a = 0; a < 6; a++) rotate(m[a][p], m[a][q], c, s);
          for (int a = 0; a < 6; a++) rotate(m[p][a], m[q][a], c, s);
          for (int a = 0; a < 6; a++) rotate(axes[a][p], axes[a][q], c, s);
        }
    }
    return axes;
  }
  static void rotate(double &x, double &y, double c, double s)
  {
    const double before = x;
    x = c * x - s * y;
    y = s * before + c * y;
  }
};

}    // namespace EVP
