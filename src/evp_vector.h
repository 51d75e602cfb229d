// SPDX-License-Identifier: GPL-2.0-only
//
// The vector loops of one iteration of conjugate gradients. Pure C++17.
// Each runs once through its arrays of n values, which must not overlap.

#ifndef EVP_VECTOR_H
#define EVP_VECTOR_H

#include <algorithm>
#include <cstddef>

#if defined(__clang__)
#define EVP_NO_OVERLAP _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define EVP_NO_OVERLAP _Pragma("GCC ivdep")
#else
#define EVP_NO_OVERLAP
#endif

namespace EVP {

/// Sum of term(k) over k < n. Four sums side by side: one addition need not wait for the last.
template <class F> double sum_of(std::size_t n, F &&term)
{
  double part[4] = {0.0, 0.0, 0.0, 0.0};
  std::size_t k = 0;
  for (; k + 4 <= n; k += 4)
    for (int c = 0; c < 4; c++) part[c] += term(k + c);
  for (; k < n; k++) part[0] += term(k);
  return (part[0] + part[1]) + (part[2] + part[3]);
}

/// The arrays of a solve of (M + h C) v = b by conjugate gradients, preconditioned by M.
struct CgArrays {
  const double *mobility, *inertia;    ///< M^-1 and M, both zero where v is prescribed
  double *change;                      ///< v minus a first guess of it
  double *residual;
  double *direction, *direction_product;    ///< and its product with M + h C
  double *z;                                ///< M^-1 residual
  double *product;                          ///< in: C z; out of cg_products(): (M + h C) z
};

/// Values that pass through all loops of a step while they are in the nearest cache.
constexpr std::size_t CG_CHUNK = 256;

/// Sums over the values of this process.
struct CgProducts {
  double norm, curvature;    ///< r.z and z.(M + h C) z
};

inline CgProducts cg_products(const CgArrays &a, std::size_t n, double h)
{
  CgProducts sums = {0.0, 0.0};
  for (std::size_t first = 0; first < n; first += CG_CHUNK) {
    const std::size_t length = std::min(CG_CHUNK, n - first);
    const double *residual = a.residual + first, *z = a.z + first;
    double *product = a.product + first;
    EVP_NO_OVERLAP
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

/// change.M change
inline double cg_change(const CgArrays &a, std::size_t n)
{
  const double *inertia = a.inertia, *change = a.change;
  return sum_of(n, [=](std::size_t k) {
    return inertia[k] * change[k] * change[k];
  });
}

/// The next iterate, its residual and z. Returns cg_change().
inline double cg_update(const CgArrays &a, std::size_t n, double alpha, double beta)
{
  double sum = 0.0;
  for (std::size_t first = 0; first < n; first += CG_CHUNK) {
    const std::size_t length = std::min(CG_CHUNK, n - first);
    const CgArrays b = {a.mobility + first, a.inertia + first,   a.change + first,
                        a.residual + first, a.direction + first, a.direction_product + first,
                        a.z + first,        a.product + first};
    EVP_NO_OVERLAP
    for (std::size_t k = 0; k < length; k++) {
      b.direction[k] = b.z[k] + beta * b.direction[k];
      b.change[k] += alpha * b.direction[k];
      b.direction_product[k] = b.product[k] + beta * b.direction_product[k];
      b.residual[k] -= alpha * b.direction_product[k];
      b.z[k] = b.mobility[k] * b.residual[k];
    }
    sum += cg_change(b, length);
  }
  return sum;
}

}    // namespace EVP

#endif
