// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace EVP {

template <std::size_t N> using SquareMatrix = std::array<std::array<double, N>, N>;

/// Jacobi's rotations: the symmetric matrix m becomes diagonal, its eigenvalues; returns its eigenvectors, in
/// columns.
template <std::size_t N> SquareMatrix<N> diagonalize(SquareMatrix<N> &m)
{
  constexpr int MOST_SWEEPS = 20;
  const auto rotate = [](double &x, double &y, double c, double s) {
    const double before = x;
    x = c * x - s * y;
    y = s * before + c * y;
  };

  SquareMatrix<N> axes = {};
  double norm = 0.0;
  for (std::size_t a = 0; a < N; a++) {
    axes[a][a] = 1.0;
    for (std::size_t b = 0; b < N; b++) norm += m[a][b] * m[a][b];
  }
  for (int sweep = 0; sweep < MOST_SWEEPS; sweep++) {
    double off = 0.0;
    for (std::size_t a = 0; a < N; a++)
      for (std::size_t b = 0; b < a; b++) off += m[a][b] * m[a][b];
    if (!(off > 1e-30 * norm)) break;
    for (std::size_t p = 0; p + 1 < N; p++)
      for (std::size_t q = p + 1; q < N; q++) {
        if (m[p][q] == 0.0) continue;
        const double theta = 0.5 * (m[q][q] - m[p][p]) / m[p][q];
        const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::hypot(theta, 1.0));
        const double c = 1.0 / std::hypot(t, 1.0), s = t * c;
        for (std::size_t a = 0; a < N; a++) rotate(m[a][p], m[a][q], c, s);
        for (std::size_t a = 0; a < N; a++) rotate(m[p][a], m[q][a], c, s);
        for (std::size_t a = 0; a < N; a++) rotate(axes[a][p], axes[a][q], c, s);
      }
  }
  return axes;
}

}    // namespace EVP
