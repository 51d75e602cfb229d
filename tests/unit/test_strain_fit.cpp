// SPDX-License-Identifier: GPL-2.0-only
// The strain of a particle from those of its bonds: exact where it is uniform, the smallest where bonds leave a choice.

#include "core/strain_fit.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using EVP::StrainFit;
using EVP::SymmetricTensor;

namespace {

struct Bond {
  double r[3], weight, strain;
};

double along(const SymmetricTensor &e, const double r[3])
{
  const double sum = e[0] * r[0] * r[0] + e[1] * r[1] * r[1] + e[2] * r[2] * r[2] +
      2.0 * (e[3] * r[0] * r[1] + e[4] * r[0] * r[2] + e[5] * r[1] * r[2]);
  return sum / (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
}

SymmetricTensor fit(const std::vector<Bond> &bonds)
{
  double sums[StrainFit::NSUMS] = {};
  for (const Bond &b : bonds) {
    const double x[2][3] = {{b.r[0], b.r[1], b.r[2]}, {0.0, 0.0, 0.0}};
    StrainFit::add(EVP::PairGeometry(x, 0, 1), b.weight, b.strain, sums);
  }
  return StrainFit::solve(sums);
}

std::vector<Bond> random_bonds(int n, const SymmetricTensor &strain)
{
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Bond> bonds(n);
  for (Bond &b : bonds) {
    for (double &c : b.r) c = uniform(generator);
    b.weight = 1.1 + uniform(generator);
    b.strain = along(strain, b.r);
  }
  return bonds;
}

void expect_near(const SymmetricTensor &found, const SymmetricTensor &expected)
{
  for (int c = 0; c < 6; c++) EXPECT_NEAR(found[c], expected[c], 1e-8);
}

const SymmetricTensor STRAIN = {0.01, -0.004, 0.002, 0.003, -0.007, 0.005};

}    // namespace

TEST(StrainFit, OfABodyOfOneBondAndOfNone)
{
  expect_near(fit(random_bonds(8, STRAIN)), STRAIN);
  // one bond strains along itself, and without bonds there is nothing
  expect_near(fit({{{0.0, 3.0, 4.0}, 0.7, 0.01}}), {0.0, 0.0036, 0.0064, 0.0, 0.0, 0.0048});
  EXPECT_EQ(fit({}), SymmetricTensor{});
  EXPECT_EQ(fit({{{1.0, 0.0, 0.0}, 0.0, 0.1}}), SymmetricTensor{});
}

TEST(StrainFit, FewerThanSixBondsAreFittedBySmallest)
{
  const std::vector<Bond> bonds = random_bonds(4, STRAIN);
  const SymmetricTensor found = fit(bonds);
  double size = 0.0, given = 0.0;
  for (int c = 0; c < 6; c++) {
    size += (c < 3 ? 1.0 : 2.0) * found[c] * found[c];
    given += (c < 3 ? 1.0 : 2.0) * STRAIN[c] * STRAIN[c];
  }
  EXPECT_LT(size, given);
  for (const Bond &b : bonds) EXPECT_NEAR(along(found, b.r), b.strain, 1e-8);
}

TEST(StrainFit, BondsNearlyInAPlaneDoNotEnlargeTheirScatter)
{
  std::vector<Bond> bonds;
  for (int k = 0; k < 6; k++)
    bonds.push_back(
        {{std::cos(0.7 * k), std::sin(0.7 * k), 1e-3 * (k % 3)}, 1.0, 0.01 + 0.001 * (k % 2)});
  const SymmetricTensor found = fit(bonds);
  EXPECT_LT(EVP::deviator_squared(found), 1.5 * 0.02 * 0.02);
  EXPECT_NEAR(found[0], 0.0105, 1e-3);
  EXPECT_NEAR(found[1], 0.0105, 1e-3);
}

TEST(StrainFit, DeviatorsOfOneAxisAndOfShear)
{
  EXPECT_NEAR(EVP::deviator_squared({3.0, 0.0, 0.0, 0.0, 0.0, 0.0}), 6.0, 1e-14);
  EXPECT_NEAR(EVP::deviator_squared({5.0, 5.0, 5.0, 10.0, 0.0, 0.0}), 200.0, 1e-12);
  EXPECT_DOUBLE_EQ(EVP::mean_of({1.0, 2.0, 6.0, 9.0, 9.0, 9.0}), 3.0);
}
