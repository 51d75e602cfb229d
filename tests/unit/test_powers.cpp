// SPDX-License-Identifier: GPL-2.0-only
//
// Powers known to the compiler, whole ones found at run time, and real ones; differences that keep their digits.

#include "core/powers.h"

#include <cmath>
#include <gtest/gtest.h>

using namespace EVP;

namespace {

// Products of at most 12 factors, each rounded once.
constexpr double POWERS = 1e-14;

template <int M, int N> void expect_the_same()
{
  for (double s = 0.05; s < 20.0; s *= 1.07) {
    const PowerPair fixed = FixedPowers<M, N>()(s), any = AnyPowers{M, N}(s);
    EXPECT_EQ(fixed.sm, any.sm) << M << " at s = " << s;
    EXPECT_EQ(fixed.sn, any.sn) << N << " at s = " << s;
    EXPECT_NEAR(fixed.sm, std::pow(s, M), POWERS * std::pow(s, M)) << M << " at s = " << s;
    EXPECT_NEAR(fixed.sn, std::pow(s, N), POWERS * std::pow(s, N)) << N << " at s = " << s;
  }
}

template <int K> void expect_digits(double x)
{
  const double less_one = (double) std::expm1(K * std::log1p((long double) x));
  EXPECT_NEAR(power_minus_1<K>(x), less_one, POWERS * std::fabs(less_one)) << K << " at " << x;
  const double a = 1.3, b = a * (1.0 + x);    // b^K - a^K over b - a as a sum
  long double sum = 0.0L;
  for (int k = 0; k < K; k++)
    sum += std::pow((long double) a, k) * std::pow((long double) b, K - 1 - k);
  EXPECT_NEAR(power_quotient<K>(a, b), (double) sum, POWERS * (double) sum) << K << " at " << x;
}

}    // namespace

TEST(Powers, KnownToTheCompilerOrNotTheyHaveTheSameBits)
{
  expect_the_same<8, 4>();
  expect_the_same<6, 3>();
  expect_the_same<4, 2>();
  expect_the_same<2, 1>();
  expect_the_same<12, 6>();
}

TEST(Powers, DifferencesKeepTheirDigits)
{
  for (double size = 1e-17; size < 0.3; size *= 1.3)
    for (const double x : {size, -size}) {
      expect_digits<1>(x);
      expect_digits<2>(x);
      expect_digits<3>(x);
      expect_digits<4>(x);
      expect_digits<6>(x);
    }
}

TEST(Powers, ExponentialLessItsTangentKeepsItsDigits)
{
  for (double size = 1e-12; size < 20.0; size *= 1.07)
    for (const double x : {size, -size, std::nextafter(0.25, size)}) {
      long double sum = 0.0L, term = (long double) x * x / 2.0L;
      for (int k = 3; k < 40; k++, term *= x / (long double) (k - 1)) sum += term;
      if (std::fabs(x) >= 2.0) sum = std::expm1((long double) x) - x;
      EXPECT_NEAR(expm1_minus_x(x), (double) sum, 4e-15 * (double) sum) << x;
    }
  EXPECT_EQ(expm1_minus_x(0.0), 0.0);
}
