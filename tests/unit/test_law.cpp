// SPDX-License-Identifier: GPL-2.0-only
//
// The facts that the paper and the model's reading of it state about the law.
// The stiffness jumps where the regimes meet; no test asks for it there.

#include "core/law.h"
#include "law_cases.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using EVP::Law;
using EVP::Row;
using law_cases::energy_scale;
using law_cases::EPSILON;
using law_cases::name_of;
using law_cases::REFERENCE;

namespace {

// (m + 1) - (n + 1) = m - n, rounded a few times.
constexpr double AT_REST = 1e-14;

const Row TABLE1 = {80, 8, 4, 3, 8, 4, 0.005, 0, 1.5};
constexpr double DEQ = 0.00973;    // [m], of the order of the paper's specimen
constexpr double DLIM = 0.0153;

std::vector<Row> rows_of_interest()
{
  return {TABLE1,
          {80, 6, 3, 3, 6, 3, 0.005, 0, 1.5},
          {80, 4, 2, 3, 4, 2, 0.005, 0, 1.5},
          {80, 2, 1, 3, 2, 1, 0.005, 0, 1.5},
          {80, 12, 6, 3, 12, 6, 0.005, 0, 1.5},
          {80, 7.5, 3.2, 3, 7.5, 3.2, 0.005, 0, 1.5},
          {80, 8, 4, 3, 6, 3, 0.02, 0, 1.5},
          {0.5, 12, 6, 50, 2, 1, 0.05, 0, 1.5}};
}

}    // namespace

TEST(Law, RegimeOneIncludesItsThreshold)
{
  Row row = TABLE1;
  row.xi_s = 0.25;    // thresholds of deq = 1 that double holds exactly
  const Law law(row);
  for (const double side : {-1.0, 1.0}) {
    const double ds = 1.0 + side * row.xi_s;
    EXPECT_EQ(law.regime(ds, 1.0), 1);
    EXPECT_EQ(law.regime(std::nextafter(ds, 1.0 + side), 1.0), 2);
    EXPECT_EQ(law.regime(std::nextafter(ds, 1.0), 1.0), 1);
  }
}

// A body whose bonds have their starting distance as deq must not move by itself (paper 2.2).
TEST(Law, ForceIsExactlyZeroAtRestRepelsBelowAndAttractsAbove)
{
  for (const Row &row : rows_of_interest()) {
    const Law law(row);
    for (const double deq : {DEQ, 1.0, 3.7e-6}) {
      EXPECT_EQ(law.force(deq, deq), 0.0) << name_of(row);
      for (const double step : {1e-9, 0.5 * row.xi_s, 2 * row.xi_s, 0.3}) {
        EXPECT_GT(law.force((1 - step) * deq, deq), 0.0) << name_of(row) << " at -" << step;
        EXPECT_LT(law.force((1 + step) * deq, deq), 0.0) << name_of(row) << " at +" << step;
      }
    }
  }
}

TEST(Law, StiffnessAtRestIsTheProductOfExponentsAndDepth)
{
  for (const Row &row : rows_of_interest()) {
    const double expected = row.m1 * row.n1 * row.e1 / (DEQ * DEQ);
    EXPECT_NEAR(Law(row).stiffness(DEQ, DEQ), expected, AT_REST * expected) << name_of(row);
  }
}

// Whichever regime a pair is in, the step must be right for the other too.
TEST(Law, StiffnessAheadIsThatOfTheStifferRegimeAtLeast)
{
  for (const Row &row : rows_of_interest())
    for (const double e2 : {row.e2, 20 * row.e1}) {
      Row changed = row;
      changed.e2 = e2;
      const Law law(changed);
      const double first = row.m1 * row.n1 * row.e1 / (DEQ * DEQ);
      const double second = row.m2 * row.n2 * e2 / (DEQ * DEQ);
      const double begin = std::max(first, second);
      for (const double t : {-20.0, -2.0, -0.9, 0.0, 0.9, 2.0, 20.0}) {
        const double d = (1 + t * row.xi_s / (1 + 25 * row.xi_s)) * DEQ;
        const double now = law.stiffness(d, DEQ);
        EXPECT_NEAR(law.stiffness_ahead(d, DEQ), std::max(begin, now), 4 * EPSILON * begin)
            << name_of(changed) << " at d/deq = " << d / DEQ;
        if (second <= first) { EXPECT_EQ(law.stiffness_ahead(d, DEQ), std::max(first, now)); }
      }
    }
  // K_II just beyond either threshold is what the bound counts with
  Row stiff = TABLE1;
  stiff.e2 = 900;
  for (const double side : {-1.0, 1.0})
    EXPECT_NEAR(Law(stiff).stiffness((1 + side * (stiff.xi_s + 1e-9)) * DEQ, DEQ),
                Law(stiff).stiffness_ahead(DEQ, DEQ), 1e-7 * Law(stiff).stiffness_ahead(DEQ, DEQ));
}

// The closest exponents that are taken, whole and not, against the form without a difference.
TEST(Law, ForceOfTheClosestExponentsIsNoRoundOff)
{
  constexpr double STRAIN = 1e-3, LOST = 1e-8;
  for (const double n : {0.01, 0.3, 0.9, 2.0, 4.0, 7.3, 31.0, 99.7, 199.0}) {
    const double m = n + 1.0001 * EVP::EXPONENTS_APART * std::max(1.0, 1.001 * n);
    const Row row = {80, m, n, 3, m, n, 0.5, 0, 1.5};
    const Law law(row);
    for (int k = -200; k <= 200; k++) {
      if (std::abs(k) < 100) continue;
      const double d = 1.0 + 0.01 * k * STRAIN, log_s = -std::log1p(d - 1.0);
      const double true_force =
          m * n * row.e1 / (m - n) * std::exp((n + 1) * log_s) * std::expm1((m - n) * log_s);
      EXPECT_NEAR(law.force(d, 1.0), true_force, LOST * std::fabs(true_force)) << name_of(row);
    }
  }
}

// Eq. 6 carries the first regime on to 30 % overlap; the second, in force there, is far softer.
TEST(Law, FirstStiffnessIsEquation6WhateverTheRegime)
{
  for (const Row &row : rows_of_interest()) {
    const double d = 0.7 * DEQ;
    const double expected = row.e1 * row.m1 * row.n1 / ((row.m1 - row.n1) * d * d) *
        ((row.m1 + 1) * std::pow(DEQ / d, row.m1) - (row.n1 + 1) * std::pow(DEQ / d, row.n1));
    EXPECT_NEAR(Law(row).first_stiffness(0.7, DEQ), std::fabs(expected), REFERENCE * expected)
        << name_of(row);
  }
  const Law law(TABLE1);
  EXPECT_LT(law.stiffness(0.7 * DEQ, DEQ), 0.1 * law.first_stiffness(0.7, DEQ));
}

TEST(Law, ForceAndEnergyAreContinuousAtBothThresholds)
{
  for (const Row &row : rows_of_interest()) {
    const Law law(row);
    for (const double side : {-1.0, 1.0}) {
      const double ds = (1 + side * row.xi_s) * DEQ;
      double inside = ds, outside = ds;
      while (law.regime(inside, DEQ) != 1) inside = std::nextafter(inside, DEQ);
      while (law.regime(outside, DEQ) != 2) outside = std::nextafter(outside, (1 + side) * DEQ);
      ASSERT_LT(std::fabs(outside - inside), 8 * EPSILON * ds);

      const double df = law.force(outside, DEQ) - law.force(inside, DEQ);
      const double de = law.energy(outside, DEQ, DLIM) - law.energy(inside, DEQ, DLIM);
      EXPECT_LT(std::fabs(df), REFERENCE * energy_scale(row) / DEQ) << name_of(row);
      EXPECT_LT(std::fabs(de), REFERENCE * energy_scale(row)) << name_of(row);

      // Control: a move by 1 % of the threshold's strain is seen a million times over.
      const double df_beyond =
          law.force((1 + 1.01 * side * row.xi_s) * DEQ, DEQ) - law.force(ds, DEQ);
      EXPECT_GT(std::fabs(df_beyond), 1e6 * REFERENCE * energy_scale(row) / DEQ) << name_of(row);
    }
  }
}

// Each new pair would otherwise create energy as it crosses dlim.
TEST(Law, EnergyIsExactlyZeroAtThePairsOwnCut)
{
  for (const Row &row : rows_of_interest()) {
    const Law law(row);
    for (const double cut : {DLIM, DEQ, 1.002 * DEQ}) {
      EXPECT_EQ(law.energy(cut, DEQ, cut), 0.0) << name_of(row);
      EXPECT_NEAR(law.energy(std::nextafter(cut, 0.0), DEQ, cut), 0.0,
                  REFERENCE * energy_scale(row));
    }
    EXPECT_LT(law.energy(DEQ, DEQ, DLIM), 0.0) << "a bond at rest is bound, " << name_of(row);
  }
}

namespace {

/// Derivative of f at x by the eighth-order central formula, step h.
template <class F> double derivative(F f, double x, double h)
{
  const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
  double sum = 0.0;
  for (int k = 1; k <= 4; k++) sum += weight[k - 1] * (f(x + k * h) - f(x - k * h));
  return sum / h;
}

/// Distances whose stencils of half-width 4 h stay within one regime.
struct Stencil {
  double d, h;
};

std::vector<Stencil> stencils(const Row &row)
{
  std::vector<Stencil> points;
  for (const double t : {-0.45, -0.1, 0.0, 0.2, 0.45})
    points.push_back({(1 + t * row.xi_s) * DEQ, 0.1 * row.xi_s * DEQ});
  for (const double away : {0.01, 0.1, 0.3})
    for (const double side : {-1.0, 1.0}) {
      const double t = row.xi_s + away;
      points.push_back({(1 + side * t) * DEQ, std::min(0.2 * away, 0.004 * (1 - t)) * DEQ});
    }
  return points;
}

// Truncation: h^8 f(9)/630 is 20!/12! (h/d)^8/630 of the slope of d^-12: 5e-13 at h = 0.004 d.
// Rounding: EPSILON e (m + n)/(m - n)/h against m n e xi_s/deq at h = 0.1 xi_s deq: 1e-10 at most,
// for (2, 1).
constexpr double FORCE_BY_DIFFERENCE = 1e-9;

}    // namespace

TEST(Law, ForceIsMinusTheSlopeOfTheEnergy)
{
  for (const Row &row : rows_of_interest()) {
    const Law law(row);
    for (const auto &[d, h] : stencils(row)) {
      const double slope = derivative(
          [&](double x) {
            return law.energy(x, DEQ, DLIM);
          },
          d, h);
      const double scale = std::max(std::fabs(law.force(d, DEQ)), energy_scale(row) / DEQ);
      EXPECT_NEAR(law.force(d, DEQ), -slope, FORCE_BY_DIFFERENCE * scale)
          << name_of(row) << ", d/deq = " << d / DEQ;
    }
  }
}

TEST(Law, StiffnessIsMinusTheSlopeOfTheForceWithinEachRegime)
{
  for (const Row &row : rows_of_interest()) {
    const Law law(row);
    for (const auto &[d, h] : stencils(row)) {
      const double slope = derivative(
          [&](double x) {
            return law.force(x, DEQ);
          },
          d, h);
      const double at_rest = energy_scale(row) / row.xi_s / (DEQ * DEQ);
      const double scale = std::max(std::fabs(law.stiffness(d, DEQ)), at_rest);
      EXPECT_NEAR(law.stiffness(d, DEQ), -slope, FORCE_BY_DIFFERENCE * scale)
          << name_of(row) << ", d/deq = " << d / DEQ;
    }
  }
}

TEST(Law, ExponentialLessItsTangentKeepsItsDigits)
{
  for (double x = 1e-12; x < 20.0; x *= 1.07)
    for (const double y : {x, -x, std::nextafter(0.25, x)}) {
      long double sum = 0.0L, term = 1.0L;
      if (std::fabs(y) < 2.0) {
        term = (long double) y * y / 2.0L;
        for (int k = 3; k < 40; k++, term *= y / (long double) (k - 1)) sum += term;
      } else
        sum = std::expm1((long double) y) - y;
      EXPECT_NEAR(EVP::expm1_minus_x(y), (double) sum, 16 * EPSILON * (double) sum) << y;
    }
  EXPECT_EQ(EVP::expm1_minus_x(0.0), 0.0);
}

TEST(Law, PowerLessOneKeepsItsDigits)
{
  for (int k = 0; k <= 8; k++)
    for (double x = 1e-17; x < 0.3; x *= 1.3)
      for (const double y : {x, -x}) {
        const double expected = (double) std::expm1(k * std::log1p((long double) y));
        EXPECT_NEAR(EVP::integer_power_minus_1(y, k), expected, 8 * EPSILON * std::fabs(expected))
            << y << " to " << k;
      }
}

// Its digits are in test_law_reference; here, that it is the energy, rest counted as zero.
TEST(Law, StoredIsTheEnergyAboveRest)
{
  for (const Row &row : rows_of_interest()) {
    const Law law(row);
    EXPECT_EQ(law.stored(DEQ, DEQ).total(), 0.0);
    for (const double t : {-80.0, -2.0, -1.0, -0.6, 0.3, 1.0, 1.3, 80.0}) {
      const double d = (1 + t * row.xi_s / (1 + 90 * row.xi_s)) * DEQ;
      const EVP::Stored found = law.stored(d, DEQ);
      EXPECT_NEAR(found.total(), law.energy(d, DEQ, DEQ), REFERENCE * energy_scale(row))
          << name_of(row) << ", d/deq = " << d / DEQ;
      EXPECT_EQ(found.second > 0.0, law.regime(d, DEQ) == 2);
      EXPECT_GT(found.first, 0.0);
    }
  }
}

// e1 = 0 leaves a gap of 2 xi_s deq without force, e2 = 0 a plateau: both are legal rows.
TEST(Law, FirstRegimeWithoutDepthIsAGap)
{
  Row row = TABLE1;
  row.e1 = 0.0;
  const Law law(row);
  for (const double t : {-0.99, -0.5, 0.0, 0.5, 0.99})
    EXPECT_EQ(law.force((1 + t * row.xi_s) * DEQ, DEQ), 0.0);
  EXPECT_EQ(law.stiffness(DEQ, DEQ), 0.0);
  EXPECT_LT(law.force(1.01 * DEQ, DEQ), 0.0);
  EXPECT_GT(law.force(0.99 * DEQ, DEQ), 0.0);
}

TEST(Law, SecondRegimeWithoutDepthIsAPlateau)
{
  Row row = TABLE1;
  row.e2 = 0.0;
  const Law law(row);
  for (const double side : {-1.0, 1.0}) {
    const double ds = (1 + side * row.xi_s) * DEQ;
    const double plateau = law.force(ds, DEQ);
    for (const double t : {0.01, 0.1, 0.4}) {
      const double d = ds + side * t * DEQ;
      EXPECT_NEAR(law.force(d, DEQ), plateau, REFERENCE * std::fabs(plateau));
      EXPECT_EQ(law.stiffness(d, DEQ), 0.0);
      const double stored = law.energy(d, DEQ, DLIM) - law.energy(ds, DEQ, DLIM);
      EXPECT_NEAR(stored, -plateau * (d - ds), REFERENCE * energy_scale(row));
    }
  }
}

// The law has no hard core: F_II(d - ds + deq) stays finite at d = 0.
TEST(Law, StaysFiniteWhenCentresMeet)
{
  const Law law(TABLE1);
  EXPECT_TRUE(std::isfinite(law.force(0.0, DEQ)));
  EXPECT_TRUE(std::isfinite(law.energy(0.0, DEQ, DLIM)));
  EXPECT_GT(law.force(0.0, DEQ), law.force(1e-3 * DEQ, DEQ));
}

TEST(Law, WithoutARowThereIsNoForce)
{
  const Law law;
  for (const double d : {0.5, 1.0, 1.4}) {
    EXPECT_EQ(law.force(d, 1.0), 0.0);
    EXPECT_EQ(law.energy(d, 1.0, 1.5), 0.0);
  }
}
