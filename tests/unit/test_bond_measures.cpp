// SPDX-License-Identifier: GPL-2.0-only
//
// What is measured of the bonds, and what rows are multiplied by.

#include "core/coefficients.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <string>
#include <vector>

using EVP::BondCensus;
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

TEST(BondCensus, CountsByTypes)
{
  // 1 - 2 - 3 - 4 in a row, types 1 1 2 3; a fifth of type 3 has no bond
  BondCensus census(3);
  const int type[] = {1, 1, 2, 3};
  const double deq[] = {0.01, 0.02, 0.03};
  for (int k = 0; k < 3; k++) {
    census.add_bond(type[k], type[k + 1], deq[k]);
    census.add_bond(type[k + 1], type[k], deq[k]);
  }
  for (int k = 0; k < 4; k++) census.add_particle(type[k], k == 0 || k == 3 ? 1 : 2);
  const BondMeasures found = census.measures();
  EXPECT_DOUBLE_EQ(found.of(1, 1).spacing, 0.01);
  EXPECT_EQ(found.of(1, 1).coordination, 1.5);    // bonds with whatever types count
  EXPECT_DOUBLE_EQ(found.of(2, 1).spacing, 0.02);
  EXPECT_EQ(found.of(1, 2).coordination, 5.0 / 3.0);
  EXPECT_DOUBLE_EQ(found.of(2, 3).spacing, 0.03);
  EXPECT_EQ(found.of(3, 2).coordination, 1.5);
  EXPECT_TRUE(found.any_bonds());
  EXPECT_DOUBLE_EQ(found.of(2, 2).spacing, 0.025);    // none of its own: those with other types
  EXPECT_EQ(found.of(2, 2).coordination, 2.0);
  EXPECT_DOUBLE_EQ(found.of(3, 3).spacing, 0.03);
  EXPECT_EQ(found.of(3, 3).coordination, 1.0);
  EXPECT_EQ(found.of(1, 3).spacing, 0.0);
  EXPECT_EQ(found.of(1, 3).coordination, 0.0);
  EXPECT_FALSE(BondCensus(3).measures().any_bonds());
}

TEST(BondMeasures, GoThroughRestartFiles)
{
  const BondMeasures written = measures_of(2, {{{0.01, 12.0}, {0.02, 1.0 / 3.0}}, {{0.03, 7.0}}});
  std::vector<double> words = written.words();
  BondMeasures read;
  ASSERT_TRUE(read.take(words.data(), 2));
  EXPECT_TRUE(read == written);
  EXPECT_EQ(read.of(2, 1).coordination, 1.0 / 3.0);
  EXPECT_FALSE(BondMeasures().take(words.data(), 1));
  ASSERT_TRUE(read.take(BondMeasures().words().data(), 2));
  EXPECT_TRUE(read.empty());
}

TEST(Scaling, IsOfTheLawsAndNotOfTheRows)
{
  Coefficients coefficients;
  coefficients.resize(1);
  coefficients.set(1, 1, METAL);
  EXPECT_TRUE(coefficients.any_scaled());
  EXPECT_EQ(coefficients.make_law(1, 1), METAL);    // nothing is measured yet
  EXPECT_TRUE(coefficients.take_measures(measures_of(1, {{{0.002, 6.0}}})));
  EXPECT_FALSE(coefficients.take_measures(measures_of(1, {{{0.002, 6.0}}})));
  EXPECT_EQ(coefficients.law(coefficients.index(1, 1)).row, METAL);

  EVP::Row scaled = METAL;
  scaled.e1 = 20.0;
  scaled.e2 = 0.75;
  scaled.gamma = 50.0;
  EXPECT_EQ(coefficients.make_law(1, 1), scaled);
  EXPECT_EQ(coefficients.gamma_elsewhere(coefficients.undamped(coefficients.index(1, 1))), 50.0);
  EXPECT_EQ(coefficients.kv(1), 87.5);
  EXPECT_EQ(coefficients.row(1, 1), METAL);
  EXPECT_EQ(coefficients.table("e1")[1][1], 80.0);
  coefficients.table("e1")[1][1] = 160.0;    // as fix adapt does
  EXPECT_EQ(coefficients.make_law(1, 1).e1, 40.0);

  // rules hold for the numbers as given, and for what becomes of them
  coefficients.table("e1")[1][1] = -1.0;
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

TEST(Coefficients, WithoutKeywordsHasNone)
{
  Coefficients coefficients;
  coefficients.resize(2);
  coefficients.set(1, 2, TABLE1);
  EXPECT_FALSE(coefficients.any_scaled());
  coefficients.take_measures(measures_of(2, {{{0.01, 12.0}, {0.01, 12.0}}, {{0.01, 12.0}}}));
  EXPECT_EQ(coefficients.make_law(1, 2), TABLE1);
  EXPECT_EQ(coefficients.kv(1), 0.0);

  coefficients.set(2, 1, METAL);
  EXPECT_EQ(coefficients.row(1, 2), METAL);
  EXPECT_TRUE(coefficients.any_scaled());
  coefficients.set(1, 2, TABLE1);    // typed anew without
  EXPECT_EQ(coefficients.row(1, 2), TABLE1);
  EXPECT_FALSE(coefficients.any_scaled());
}
