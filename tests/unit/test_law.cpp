// SPDX-License-Identifier: GPL-2.0-only
//
// Eq. 8 of one pair: against 60-digit arithmetic (tests/data/make_law_reference.py), and what the model states of it.
// The stiffness jumps where the regimes meet; no test asks for it there. Powers: known to the compiler, whole ones found
// at run time, and real ones; differences that keep their digits.

#include "pair_cases.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

using namespace EVP;
using pair_cases::EPSILON;
using pair_cases::name_of;
using pair_cases::with_exponents;

namespace {

// Rounding d/deq alone moves the force by EPSILON m n e/deq; at xi_s = 0.005 that is 4e-14 of the
// force at xi_s, so 1e-12 leaves room for the powers and none for a wrong formula.
constexpr double REFERENCE = 1e-12;

const Row TABLE1 = {80, 8, 4, 3, 8, 4, 0.005, 0, 1.5};
constexpr double DEQ = 0.00973;    // [m], of the order of the paper's specimen

const std::vector<Row> ROWS = {
    with_exponents(8, 4, 8, 4),        with_exponents(6, 3, 6, 3),
    with_exponents(4, 2, 4, 2),        with_exponents(2, 1, 2, 1),
    with_exponents(12, 6, 12, 6),      with_exponents(7.5, 3.2, 7.5, 3.2),
    {80, 8, 4, 3, 6, 3, 0.02, 0, 1.5}, {0.5, 12, 6, 50, 2, 1, 0.05, 0, 1.5}};

/// Below it a difference of energies means nothing: round-off grows with the steeper regime.
double energy_scale(const Row &row)
{
  return std::max(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2) * row.xi_s;
}

/// The lines of a table, none where one has not so many columns.
std::vector<std::vector<double>> read_table(const std::string &name, size_t columns)
{
  std::vector<std::vector<double>> lines;
  std::ifstream file(EVP_REPOSITORY "/tests/data/" + name);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream in(line);
    std::vector<double> v;
    for (std::string word; std::getline(in, word, ',');)
      v.push_back(std::strtod(word.c_str(), nullptr));
    if (v.size() != columns) return {};
    lines.push_back(v);
  }
  return lines;
}

Row row_of(const std::vector<double> &v)
{
  return {v[0], v[1], v[2], v[3], v[4], v[5], v[6], 0.0, 1.5};
}

template <class F> double derivative(F f, double x, double h)
{
  const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
  double sum = 0.0;
  for (int k = 1; k <= 4; k++) sum += weight[k - 1] * (f(x + k * h) - f(x - k * h));
  return sum / h;
}

double energy(const PairLaw &law, double d, double deq, double cutoff)
{
  return law.state(d / deq, {1.0 / deq}).stored.total() -
      law.state(cutoff / deq, {1.0 / deq}).stored.total();
}

}    // namespace

TEST(LawReference, ForceEnergyStiffnessAndRegimeHoldToTwelveDigits)
{
  const auto table = read_table("law_reference.csv", 14);
  ASSERT_GT(table.size(), 1000u);
  for (const auto &v : table) {
    const Row row = row_of(v);
    const double d = v[7], deq = v[8], least = energy_scale(row);
    const PairLaw law(row);
    const PairState now = law.state(d / deq, {1.0 / deq});
    SCOPED_TRACE(name_of(row) + "d/deq = " + std::to_string(d / deq));
    EXPECT_NEAR(now.force, v[11], REFERENCE * std::max(std::fabs(v[11]), least / deq));
    EXPECT_NEAR(energy(law, d, deq, v[9]), v[12], REFERENCE * std::max(std::fabs(v[12]), least));
    if (v[10] == 0.0) continue;    // rounding decides which regime it is
    EXPECT_EQ(now.regime, (int) v[10]);
    EXPECT_NEAR(now.stiffness, v[13],
                REFERENCE * std::max(std::fabs(v[13]), least / row.xi_s / (deq * deq)));
  }
}

// Down to strains of one bit of d nothing is lost but a few roundings, times m/(m - n) of the row, and what the roundings
// of d/deq and of the force at xi_s take, which is a difference.
TEST(LawReference, WhatIsStoredHoldsToThirteenDigitsOfItself)
{
  const auto table = read_table("stored_reference.csv", 11);
  ASSERT_GT(table.size(), 1000u);
  int tiny = 0, any_second = 0;
  for (const auto &v : table) {
    const Row row = row_of(v);
    const double d = v[7], deq = v[8], strain = (d - deq) / deq, elastic = v[9], second = v[10];
    const double digits = 1e-14 * std::max(row.m1 / (row.m1 - row.n1), row.m2 / (row.m2 - row.n2));
    const PairLaw law(row);
    SCOPED_TRACE(name_of(row) + "strain " + std::to_string(strain));
    if (std::fabs(strain) < row.xi_s * (1.0 - 1e-6)) {
      EXPECT_NEAR(law.first.stored(strain, 1.0 / (1.0 + strain)), elastic, digits * elastic);
      tiny += std::fabs(strain) < 2e-10 && elastic > 0.0;
    }
    const PairState now = law.state(d / deq, {1.0});
    const double begin = row.m1 * row.n1 * row.e1;
    const double off = EPSILON * (std::fabs(now.force) + begin * (std::fabs(strain) + EPSILON));
    EXPECT_NEAR(now.stored.total(), elastic + second, digits * (elastic + second) + off);
    EXPECT_NEAR(now.stored.elastic, elastic, digits * elastic + off);
    any_second += now.stored.second > 0.0;
  }
  EXPECT_GT(tiny, 100);
  EXPECT_GT(any_second, 100);
}

TEST(Law, FirstRegimeIncludesItsThreshold)
{
  Row row = TABLE1;
  row.xi_s = 0.25;    // thresholds that double holds exactly
  const PairLaw law(row);
  for (const double side : {-1.0, 1.0}) {
    EXPECT_EQ(law.state(1.0 + side * 0.25, {1.0}).regime, 1);
    EXPECT_EQ(law.state(std::nextafter(1.0 + side * 0.25, 1.0 + side), {1.0}).regime, 2);
  }
}

// A body whose bonds have their starting distance as deq must not move by itself (paper 2.2).
TEST(Law, AtRestThereIsNoForceAtAll)
{
  for (const Row &row : ROWS) {
    const PairState rest = PairLaw(row).state(1.0, {1.0 / DEQ});
    EXPECT_EQ(rest.force, 0.0) << name_of(row);
    EXPECT_EQ(rest.stored.total(), 0.0) << name_of(row);
  }
}

// Eighth-order differences, on stencils that lie within one regime or one way of flow. Truncation: h^8 f(9)/630;
// rounding: a few EPSILON e (m + n)/(m - n)/h.
TEST(Law, ForceIsMinusTheSlopeOfTheEnergyAndStiffnessThatOfTheForce)
{
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int flowing = 0, elastic = 0;
  for (const Row &row : ROWS)
    for (const Flow flow : {Flow::REVERSIBLE, Flow::PLASTIC, Flow::PLASTIC_CONTACT})
      for (int trial = 0; trial < 400; trial++) {
        const PairLaw law(row);
        const double y = flow == Flow::REVERSIBLE ? row.xi_s : 0.001 + 0.1 * std::fabs(unit(random));
        const double strain = 3.0 * y * unit(random), h = 0.02 * std::min(row.xi_s, y),
                     r = 1.0 + strain;
        if (std::fabs(std::fabs(strain) - y) < 5 * h) continue;
        if (flow == Flow::PLASTIC_CONTACT && std::fabs(strain) < 5 * h) continue;    // it parts
        const auto energy = [&](double x) {
          const PairState now = law.state(x, {1.0, flow, y});
          return now.stored.total() + now.dissipated;
        };
        const auto force = [&](double x) {
          return law.state(x, {1.0, flow, y}).force;
        };
        const PairState now = law.state(r, {1.0, flow, y});
        const double begin = row.m1 * row.n1 * row.e1;
        SCOPED_TRACE(name_of(row) + "flow " + std::to_string((int) flow) + ", strain " +
                     std::to_string(strain));
        EXPECT_NEAR(now.force, -derivative(energy, r, h), 1e-9 * begin);
        const bool flows = now.dissipated > 0.0;
        if (!flows) {
          EXPECT_NEAR(now.stiffness, -derivative(force, r, h), 1e-7 * now.stiffness_ahead);
        }
        EXPECT_GE(now.dissipated, 0.0);
        EXPECT_GE(now.stiffness_ahead,
                  std::max(begin * (now.inv_deq * now.inv_deq), now.stiffness));
        (flows ? flowing : elastic)++;
      }
  EXPECT_GT(flowing, 1000);
  EXPECT_GT(elastic, 1000);
}

// Whichever regime a pair is in, the timestep must be right for the other too.
TEST(Law, StiffnessAheadIsThatOfTheStifferRegimeAtLeast)
{
  for (const Row &given : ROWS)
    for (const double e2 : {given.e2, 20 * given.e1}) {
      Row row = given;
      row.e2 = e2;
      SCOPED_TRACE(name_of(row));
      const PairLaw law(row);
      const double begin = std::max(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * e2);
      for (const double t : {-20.0, -2.0, -0.9, 0.0, 0.9, 2.0, 20.0}) {
        const PairState now = law.state(1 + t * row.xi_s / (1 + 25 * row.xi_s), {1.0});
        EXPECT_EQ(now.stiffness_ahead, std::max(begin, now.stiffness));
      }
    }
}

// The closest exponents that are taken, whole and not, against the form without a difference.
TEST(Law, ForceOfTheClosestExponentsIsNoRoundOff)
{
  for (const double n : {0.01, 0.3, 0.9, 2.0, 4.0, 7.3, 31.0, 99.7, 199.0}) {
    const double m = n + 1.0001 * EXPONENTS_APART * std::max(1.0, 1.001 * n);
    const Row row = {80, m, n, 3, m, n, 0.5, 0, 1.5};
    const PairLaw law(row);
    for (int k = 100; k <= 200; k++)
      for (const double side : {-1.0, 1.0}) {
        const double r = 1.0 + side * 1e-5 * k, log_s = -std::log1p(r - 1.0);
        const double force =
            m * n * row.e1 / (m - n) * std::exp((n + 1) * log_s) * std::expm1((m - n) * log_s);
        EXPECT_NEAR(law.state(r, {1.0}).force, force, 1e-8 * std::fabs(force)) << name_of(row);
      }
  }
}

TEST(Law, WhatOverflowsIsRefused)
{
  EXPECT_EQ(PairLaw().state(0.5, {1.0}).force, 0.0);    // of types without a row
  Row row = TABLE1;
  row.e1 = 1e199;
  EXPECT_THROW(PairLaw{row}, BadInput);
}

namespace {

// Products of at most 24 factors, each rounded once.
constexpr double POWERS = 1e-14;

}    // namespace

TEST(Powers, KnownToTheCompilerOrNotTheyHaveTheSameBits)
{
  for (double s = 0.05; s < 20.0; s *= 1.07) {
    const PowerPair fixed = Powers84()(s), any = AnyPowers{8, 4}(s);
    EXPECT_EQ(fixed.sm, any.sm) << s;
    EXPECT_EQ(fixed.sn, any.sn) << s;
  }
}

TEST(Powers, HoldToFourteenDigits)
{
  for (const auto &[m, n] :
       {std::pair(8.0, 4.0), {6, 3}, {4, 2}, {2, 1}, {12, 6}, {24, 7}, {7.5, 3.2}})
    for (double s = 0.05; s < 20.0; s *= 1.07) {
      const PowerPair found = AnyPowers{m, n}(s);
      EXPECT_NEAR(found.sm, std::pow(s, m), POWERS * std::pow(s, m)) << m << " at s = " << s;
      EXPECT_NEAR(found.sn, std::pow(s, n), POWERS * std::pow(s, n)) << n << " at s = " << s;
    }
}

TEST(Powers, DifferencesKeepTheirDigits)
{
  for (double size = 1e-17; size < 0.3; size *= 1.3)
    for (const double x : {size, -size}) {
      const double open = (double) -std::expm1(-4 * std::log1p((long double) x));
      EXPECT_NEAR(Powers84::one_minus_sn(x, 1.0 / (1.0 + x)), open, POWERS * std::fabs(open)) << x;
    }
}

TEST(Powers, LogarithmOfARatioKeepsItsDigits)
{
  for (double size = 1e-14; size < 5.0; size *= 1.07)
    for (const double a : {1.3 * (1.0 + size), 1.3 / (1.0 + size)}) {
      const long double exact = std::log1p(((long double) a - 1.3) / 1.3);
      EXPECT_NEAR(log_of_ratio(a, 1.3), (double) exact, 4e-16 * std::fabs((double) exact)) << size;
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
