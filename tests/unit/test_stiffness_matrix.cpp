// SPDX-License-Identifier: GPL-2.0-only
// Matrices of small networks against closed forms.

#include "core/stiffness_matrix.h"
#include "one_rank.h"

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <vector>

using EVP::StiffnessMatrix;

namespace {

constexpr double MASS = 2.0, AXIAL = 7.0, ACROSS = 0.5, DAMPING = 3.0;

double top(StiffnessMatrix &network, const StiffnessMatrix::Mix &mix)
{
  const EVP::LanczosResult found = network.largest_eigenvalue(mix, 1e-6, 100);
  EXPECT_TRUE(found.converged);
  return found.eigenvalue;
}

double largest(const std::vector<double> &values)
{
  return *std::max_element(values.begin(), values.end());
}

/// Two particles, the pair along u; the second one is free or held.
StiffnessMatrix pair_of(bool both_free, const std::array<double, 3> &u)
{
  static OneRank alone;
  StiffnessMatrix network(alone);
  network.nreact = 2;
  network.inverse_mass = {1.0 / MASS, both_free ? 1.0 / MASS : 0.0};
  network.start = {0.3, -0.2, 0.9, 0.5, 0.1, -0.4};
  if (!both_free) std::fill(network.start.begin() + 3, network.start.end(), 0.0);
  network.links = {{0, 1, {u[0], u[1], u[2]}, AXIAL, ACROSS, DAMPING}};
  return network;
}

}    // namespace

TEST(StiffnessMatrix, OneOscillator)
{
  StiffnessMatrix network = pair_of(false, {0.6, 0.0, 0.8});
  EXPECT_TRUE(network.is_free(0));
  EXPECT_FALSE(network.is_free(1));
  EXPECT_NEAR(top(network, {1, 1, 0}), AXIAL / MASS, 1e-9);
  EXPECT_NEAR(top(network, {0, 1, 0}), ACROSS / MASS, 1e-9);
  EXPECT_NEAR(top(network, {0, 0, 1}), DAMPING / MASS, 1e-9);
  EXPECT_EQ(top(network, {0, 0, 0}), 0.0);
}

TEST(StiffnessMatrix, TwoFreeParticlesHaveTwiceTheEigenvalue)
{
  StiffnessMatrix network = pair_of(true, {0.6, 0.0, 0.8});
  EXPECT_NEAR(top(network, {1, 1, 0}), 2.0 * AXIAL / MASS, 1e-9);
  EXPECT_NEAR(top(network, {0.5, 0.5, 4}), 2.0 * (0.5 * AXIAL + 4.0 * DAMPING) / MASS, 1e-9);
}

TEST(StiffnessMatrix, RowSumsAreExactAlongAnAxisAndNeverBelow)
{
  for (const bool both_free : {false, true})
    for (const auto &u : {std::array<double, 3>{1, 0, 0}, {0.6, 0, 0.8}, {0.48, -0.6, 0.64}}) {
      StiffnessMatrix network = pair_of(both_free, u);
      for (const StiffnessMatrix::Mix &mix : {StiffnessMatrix::Mix{1, 1, 0}, {0, 0, 1}}) {
        const std::vector<double> sums = network.row_sums(mix);
        const double exact = top(network, mix);
        EXPECT_GE(largest(sums), exact * (1.0 - 1e-12));
        if (u[0] == 1.0) { EXPECT_NEAR(largest(sums), exact, 1e-9); }
        if (!both_free) { EXPECT_EQ(sums[3] + sums[4] + sums[5], 0.0); }
      }
    }
}
