// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_CORE_LANCZOS_H
#define EVP_CORE_LANCZOS_H

#include <algorithm>
#include <cmath>
#include <vector>

namespace EVP {

/// Largest eigenvalue of the symmetric tridiagonal matrix with the given diagonal and off-diagonal,
/// by bisection on the number of negative pivots (Sturm). off[k] couples k and k + 1.
inline double largest_tridiagonal_eigenvalue(const std::vector<double> &diagonal,
                                             const std::vector<double> &off)
{
  const size_t n = diagonal.size();
  double low = diagonal[0], high = diagonal[0];
  for (size_t k = 0; k < n; k++) {
    const double radius =
        (k > 0 ? std::fabs(off[k - 1]) : 0.0) + (k + 1 < n ? std::fabs(off[k]) : 0.0);
    low = std::max(low, diagonal[k]);    // a Rayleigh quotient, hence no larger than the answer
    high = std::max(high, diagonal[k] + radius);
  }
  const auto all_below = [&](double bound) {
    double pivot = 1.0;
    for (size_t k = 0; k < n; k++) {
      pivot = diagonal[k] - bound - (k > 0 ? off[k - 1] * off[k - 1] / pivot : 0.0);
      if (pivot >= 0.0) return false;
    }
    return true;
  };
  while (high - low > 1e-12 * std::max(std::fabs(high), std::fabs(low))) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (all_below(middle) ? high : low) = middle;
  }
  return high;
}

struct LanczosResult {
  double eigenvalue;    ///< largest Ritz value, approached from below
  int iterations;
  bool converged;
};

/// Largest eigenvalue of the symmetric positive semi-definite operator `apply(in, out)`.
///
/// start is the first vector (any length, may be empty on this rank; overwritten), dot(a, b) the
/// inner product over all ranks. Stops when four iterations in a row together raised the value by less
/// than tolerance of itself, when the Krylov space is exhausted, or after max_iterations.
template <class Apply, class Dot>
LanczosResult largest_eigenvalue(std::vector<double> &start, Apply &&apply, Dot &&dot,
                                 double tolerance, int max_iterations)
{
  const size_t n = start.size();
  std::vector<double> &q = start;
  std::vector<double> previous(n, 0.0), w(n, 0.0), diagonal, off;
  const double norm = std::sqrt(dot(q, q));
  if (!(norm > 0.0)) return {0.0, 0, true};
  for (double &value : q) value /= norm;

  double beta = 0.0;
  std::vector<double> history;
  for (int it = 1; it <= max_iterations; it++) {
    apply(q, w);
    const double alpha = dot(q, w);
    for (size_t k = 0; k < n; k++) w[k] -= alpha * q[k] + beta * previous[k];
    diagonal.push_back(alpha);
    history.push_back(largest_tridiagonal_eigenvalue(diagonal, off));
    const double value = history.back();

    const size_t back = 4;
    if (history.size() > back && value - history[history.size() - 1 - back] <= tolerance * value)
      return {value, it, true};
    beta = std::sqrt(dot(w, w));
    if (beta <= 1e-14 * std::fabs(value) || value == 0.0) return {value, it, true};
    off.push_back(beta);
    for (size_t k = 0; k < n; k++) {
      previous[k] = q[k];
      q[k] = w[k] / beta;
    }
  }
  return {history.empty() ? 0.0 : history.back(), max_iterations, false};
}

}    // namespace EVP

#endif
