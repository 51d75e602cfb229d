// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"

#include <cmath>

namespace EVP {

/// s^m and s^n, from which force, energy and stiffness are all made.
struct PowerPair {
  double sm, sn;
};

/// The exponents 8 and 4 of the paper's tables and of all rows in potentials/, as straight multiplications: the blocks of the
/// time-step loop are compiled for them.
struct Powers84 {
  static constexpr bool are_fixed = true;
  static constexpr double m = 8.0, n = 4.0;
  Powers84(double = m, double = n) {}
  static bool are(double m_in, double n_in) { return m_in == m && n_in == n; }

  EVP_INLINE PowerPair operator()(double s) const
  {
    const double square = s * s, sn = square * square;
    return {sn * sn, sn};
  }

  /// s^n ((1 + x)^n - 1), which is 1 - s^n at s = 1/(1 + x), to the last digits where x is near 0.
  EVP_INLINE static double one_minus_sn(double x, double s)
  {
    const double of_square = x * (2.0 + x), square = s * s;
    return of_square * (2.0 + of_square) * (square * square);
  }
};

/// s^k by repeated squaring; exact order of operations independent of the compiler.
constexpr double integer_power(double s, int k)
{
  double result = 1.0;
  for (; k > 0; k >>= 1, s *= s)
    if (k & 1) result *= s;
  return result;
}

/// Any real m > n > 0; integers are multiplied out, others take pow(). The bits are those of Powers84 where it has these.
struct AnyPowers {
  static constexpr bool are_fixed = false;
  double m, n;
  PowerPair operator()(double s) const { return {power(s, m), power(s, n)}; }

 private:
  static double power(double s, double p)
  {
    return p <= 1024.0 && p == std::floor(p) ? integer_power(s, (int) p) : std::pow(s, p);
  }
};

/// e^x - 1 - x [1] to the last digits, where the difference would leave none of them near 0.
inline double expm1_minus_x(double x)
{
  if (std::fabs(x) >= 0.25) return std::expm1(x) - x;
  // the series in two sums, which a processor adds up side by side
  constexpr double EVEN[] = {1.0 / 479001600.0, 1.0 / 3628800.0, 1.0 / 40320.0,
                             1.0 / 720.0,       1.0 / 24.0,      1.0 / 2.0};
  constexpr double ODD[] = {1.0 / 6227020800.0, 1.0 / 39916800.0, 1.0 / 362880.0,
                            1.0 / 5040.0,       1.0 / 120.0,      1.0 / 6.0};
  const double xx = x * x;
  double even = 0.0, odd = 0.0;
  for (int k = 0; k < 6; k++) {
    even = even * xx + EVEN[k];
    odd = odd * xx + ODD[k];
  }
  return xx * (even + x * odd);
}

}    // namespace EVP
