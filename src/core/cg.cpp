// SPDX-License-Identifier: GPL-2.0-only
//
// The vector loops of conjugate gradients, compiled once per instruction set.

#include "core/cg.h"

#include <algorithm>

namespace EVP {

namespace {

  /// Values that pass through all loops of an iteration while they are in the nearest cache.
  constexpr std::size_t CHUNK = 256;

  /// a.b, or a.(b c): sums side by side, so that no addition waits for the last one.
  template <class F> EVP_INLINE double sum_of(std::size_t n, F &&term)
  {
    constexpr std::size_t WIDTH = 8;
    double part[WIDTH] = {};
    std::size_t k = 0;
    for (; k + WIDTH <= n; k += WIDTH)
      for (std::size_t c = 0; c < WIDTH; c++) part[c] += term(k + c);
    for (; k < n; k++) part[0] += term(k);
    return ((part[0] + part[1]) + (part[2] + part[3])) +
        ((part[4] + part[5]) + (part[6] + part[7]));
  }

  EVP_INLINE double changed(const CgArrays &a, std::size_t n)
  {
    const double *inertia = a.inertia, *change = a.change;
    double sum = 0.0;
    for (std::size_t first = 0; first < n; first += CHUNK)
      sum += sum_of(std::min(CHUNK, n - first), [=](std::size_t k) {
        return inertia[first + k] * change[first + k] * change[first + k];
      });
    return sum;
  }

  EVP_INLINE CgProducts products(const CgArrays &a, std::size_t n, double h)
  {
    CgProducts sums = {0.0, 0.0};
    for (std::size_t first = 0; first < n; first += CHUNK) {
      const std::size_t length = std::min(CHUNK, n - first);
      const double *residual = a.residual + first, *z = a.z + first;
      double *product = a.product + first;
      EVP_INDEPENDENT
      for (std::size_t k = 0; k < length; k++) product[k] = residual[k] + h * product[k];
      sums.norm += sum_of(length, [=](std::size_t k) {
        return residual[k] * z[k];
      });
      sums.curvature += sum_of(length, [=](std::size_t k) {
        return product[k] * z[k];
      });
    }
    return sums;
  }

  EVP_INLINE double update(const CgArrays &a, std::size_t n, double alpha, double beta)
  {
    double sum = 0.0;
    for (std::size_t first = 0; first < n; first += CHUNK) {
      const std::size_t length = std::min(CHUNK, n - first);
      const CgArrays b = a.from(first);
      EVP_INDEPENDENT
      for (std::size_t k = 0; k < length; k++) {
        b.direction[k] = b.z[k] + beta * b.direction[k];
        b.change[k] += alpha * b.direction[k];
        b.direction_product[k] = b.product[k] + beta * b.direction_product[k];
        b.residual[k] -= alpha * b.direction_product[k];
        b.z[k] = b.mobility[k] * b.residual[k];
      }
      sum += changed(b, length);
    }
    return sum;
  }

}    // namespace

CgProducts cg_products(const CgArrays &a, std::size_t n, double h, Level level)
{
  return call_at(level, [&]() EVP_KERNEL {
    return products(a, n, h);
  });
}

double cg_update(const CgArrays &a, std::size_t n, double alpha, double beta, Level level)
{
  return call_at(level, [&]() EVP_KERNEL {
    return update(a, n, alpha, beta);
  });
}

double cg_changed(const CgArrays &a, std::size_t n)
{
  return changed(a, n);
}

}    // namespace EVP
