// SPDX-License-Identifier: GPL-2.0-only
//
// Powers known to the compiler, whole ones found at run time, and real ones.

#include "core/powers.h"

#include <cmath>
#include <gtest/gtest.h>

using EVP::AnyPowers;
using EVP::FixedPowers;

namespace {

// Products of at most 12 factors, each rounded once.
constexpr double POWERS = 1e-14;

template <int M, int N> void expect_fixed_equals_any()
{
  const FixedPowers<M, N> fixed;
  const AnyPowers any = {M, N};
  for (double s = 0.05; s < 20.0; s *= 1.07) {
    EXPECT_NEAR(fixed(s).sm, any(s).sm, POWERS * any(s).sm) << M << " at s = " << s;
    EXPECT_NEAR(fixed(s).sn, any(s).sn, POWERS * any(s).sn) << N << " at s = " << s;
    EXPECT_NEAR(fixed(s).sm, std::pow(s, M), POWERS * std::pow(s, M)) << M << " at s = " << s;
    EXPECT_NEAR(fixed(s).sn, std::pow(s, N), POWERS * std::pow(s, N)) << N << " at s = " << s;
  }
}

}    // namespace

TEST(Powers, KnownToTheCompilerOrNotTheyAgree)
{
  expect_fixed_equals_any<8, 4>();
  expect_fixed_equals_any<6, 3>();
  expect_fixed_equals_any<4, 2>();
  expect_fixed_equals_any<2, 1>();
  expect_fixed_equals_any<12, 6>();
}

TEST(Powers, AreExactForPowersOfTwoWhateverTheExponents)
{
  const double exponents[][2] = {{8, 4}, {6, 3}, {4, 2}, {2, 1}, {12, 6}, {5, 1}, {200, 199}};
  for (const auto &[m, n] : exponents) {
    const EVP::PowerPair q = EVP::with_powers(m, n, [](auto p) {
      return p(2.0);
    });
    EXPECT_EQ(q.sm, std::ldexp(1.0, (int) m));
    EXPECT_EQ(q.sn, std::ldexp(1.0, (int) n));
  }
}

TEST(Powers, RealExponentsAreThoseOfPow)
{
  const EVP::PowerPair q = EVP::with_powers(7.5, 3.2, [](auto p) {
    return p(1.3);
  });
  EXPECT_NEAR(q.sm, std::pow(1.3, 7.5), POWERS * q.sm);
  EXPECT_NEAR(q.sn, std::pow(1.3, 3.2), POWERS * q.sn);
}
