// SPDX-License-Identifier: GPL-2.0-only
//
// What is measured of the bonds, and what rows are multiplied by.

#include "core/coefficients.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <string>
#include <vector>

using EVP::BondMeasures;
using EVP::Coefficients;
using Source = EVP::Coefficients::Source;

namespace {

constexpr double EPSILON = std::numeric_limits<double>::epsilon();
const EVP::Row TABLE1 = {80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 50.0, 1.5};
const EVP::Row METAL = {80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 50.0, 1.5, 0.004, 12.0, 700.0};

BondMeasures measures_of(int ntypes, const std::vector<std::vector<EVP::BondMeasure>> &table)
{
  BondMeasures measures(ntypes);
  for (int i = 1; i <= ntypes; i++)
    for (int j = i; j <= ntypes; j++) measures.of(i, j) = table[i - 1][j - i];
  return measures;
}

void expect_factors(const EVP::Factors &found, double energies, double gamma, double kv)
{
  EXPECT_NEAR(found.energies, energies, 8 * EPSILON * energies);
  EXPECT_NEAR(found.gamma, gamma, 8 * EPSILON * gamma);
  EXPECT_NEAR(found.kv, kv, 8 * EPSILON * kv);
}

}    // namespace

// Rules hold for the numbers as given, and for what becomes of them.
TEST(Scaling, IsOfTheLawsAndNotOfTheRows)
{
  Coefficients coefficients;
  coefficients.resize(1);
  coefficients.set(1, 1, METAL);
  EXPECT_EQ(coefficients.make_law(1, 1), METAL);    // nothing is measured yet
  EXPECT_TRUE(coefficients.take_measures(measures_of(1, {{{0.002, 6.0}}})));
  EXPECT_FALSE(coefficients.take_measures(measures_of(1, {{{0.002, 6.0}}})));
  EXPECT_EQ(coefficients.law(coefficients.index(1, 1)).row, METAL);
  EXPECT_EQ(coefficients.make_law(1, 1).e2, 0.75);
  EXPECT_EQ(coefficients.gamma_elsewhere(coefficients.undamped(coefficients.index(1, 1))), 50.0);
  coefficients.table("e1")[1][1] = -1.0;    // as fix adapt does
  EXPECT_THROW(coefficients.make_law(1, 1), EVP::BadInput);
  coefficients.table("e1")[1][1] = 1e150;
  EXPECT_NO_THROW(coefficients.make_law(1, 1));
  coefficients.take_measures(measures_of(1, {{{4e57, 12.0}}}));
  EXPECT_THROW(coefficients.make_law(1, 1), EVP::BadInput);
}

TEST(Scaling, OfTypesWithoutBondsIsThatOfTheLikeTypes)
{
  Coefficients coefficients;
  coefficients.resize(3);
  for (int i = 1; i <= 3; i++)
    for (int j = i; j <= 3; j++) coefficients.set(i, j, METAL);
  coefficients.take_measures(measures_of(
      3, {{{0.002, 12.0}, {0.0, 0.0}, {0.0, 0.0}}, {{0.008, 3.0}, {0.0, 0.0}}, {{0.0, 0.0}}}));
  const auto expect = [&](int i, int j, Source source, double energies, double gamma, double kv) {
    SCOPED_TRACE(std::to_string(i) + " " + std::to_string(j));
    for (const auto &found : {coefficients.scaling(i, j), coefficients.scaling(j, i)}) {
      EXPECT_EQ(found.source, source);
      expect_factors(found.factors, energies, gamma, kv);
    }
  };
  expect(1, 1, Source::OWN_BONDS, 0.125, 0.5, 0.125);
  expect(2, 2, Source::OWN_BONDS, 32.0, 8.0, 8.0);
  expect(1, 2, Source::LIKE_TYPES, 2.0, 2.0, 1.0);
  expect(1, 3, Source::LIKE_TYPES, 0.125, 0.5, 0.125);    // of the one that has bonds
  expect(3, 3, Source::AS_GIVEN, 1.0, 1.0, 1.0);

  coefficients.set(1, 2, TABLE1);
  expect(1, 2, Source::AS_GIVEN, 1.0, 1.0, 1.0);
  coefficients.set(2, 2, TABLE1);
  coefficients.set(1, 2, METAL);
  expect(1, 2, Source::LIKE_TYPES, 0.125, 0.5, 0.125);
}
