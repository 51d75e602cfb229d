// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"

#include <cmath>

namespace EVP {

/// s^m and s^n, from which force, energy and stiffness are all made.
struct PowerPair {
  double sm, sn;
};

/// s^k by repeated squaring; exact order of operations independent of the compiler.
constexpr double integer_power(double s, int k)
{
  double result = 1.0;
  for (; k > 0; k >>= 1, s *= s)
    if (k & 1) result *= s;
  return result;
}

/// (1 + x)^K - 1 for x > -1, to the last digits where x is near 0.
template <int K> EVP_INLINE double power_minus_1(double x)
{
  if constexpr (K == 1)
    return x;
  else if constexpr (K % 2 == 0) {
    const double half = power_minus_1<K / 2>(x);
    return half * (2.0 + half);
  } else {
    const double lower = power_minus_1<K - 1>(x);
    return x + lower * (1.0 + x);
  }
}

/// s^K
template <int K> double fixed_power(double s)
{
  if constexpr (K == 1)
    return s;
  else if constexpr (K % 2 == 0) {
    const double half = fixed_power<K / 2>(s);
    return half * half;
  } else
    return s * fixed_power<K - 1>(s);
}

/// Exponents known to the compiler: straight multiplications, no loop, no branch.
template <int M, int N> struct FixedPowers {
  static constexpr bool are_fixed = true;
  static constexpr int lower = N;
  static constexpr double m = M;
  static_assert(M == 2 * N, "Regime::stored() is a square");
  FixedPowers(double = M, double = N) {}
  PowerPair operator()(double s) const { return {fixed_power<M>(s), fixed_power<N>(s)}; }
};

/// Calls f with the powers for (m, n) that the compiler knows, or with `other`, so that every caller is written once.
template <class Other, class F> auto with_powers(double m, double n, const Other &other, F &&f)
{
  if (m == 8.0 && n == 4.0) return f(FixedPowers<8, 4>{});
  if (m == 6.0 && n == 3.0) return f(FixedPowers<6, 3>{});
  if (m == 4.0 && n == 2.0) return f(FixedPowers<4, 2>{});
  if (m == 2.0 && n == 1.0) return f(FixedPowers<2, 1>{});
  if (m == 12.0 && n == 6.0) return f(FixedPowers<12, 6>{});
  return f(other);
}

/// Any real m > n > 0; integers are multiplied out, others take pow(). The bits are those of FixedPowers where there
/// are such.
struct AnyPowers {
  static constexpr bool are_fixed = false;
  double m, n;
  PowerPair operator()(double s) const
  {
    const auto other = [this](double x) {
      return PowerPair{power(x, m), power(x, n)};
    };
    return with_powers(m, n, other, [s](const auto &powers) -> PowerPair {
      return powers(s);
    });
  }

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
