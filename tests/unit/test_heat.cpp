// SPDX-License-Identifier: GPL-2.0-only
// Softening, and temperatures with latent heat.

#include "core/heat/heat.h"

#include <gtest/gtest.h>

#include <cmath>

using EVP::Row;
using EVP::ThermalState;

namespace {

Row metal(double melt = 0.0)
{
  Row row;
  row.capacity = 900.0;
  row.soften_tref = 300.0;
  row.soften_tmelt = 800.0;
  row.soften_m = 1.5;
  row.melt = melt;
  return row;
}

}    // namespace

TEST(Softening, FallsBetweenBothTemperatures)
{
  EXPECT_EQ(EVP::softening(Row{}, 5000.0), 1.0);
  EXPECT_EQ(EVP::softening(metal(), 0.0), 1.0);
  EXPECT_EQ(EVP::softening(metal(), 300.0), 1.0);
  EXPECT_DOUBLE_EQ(EVP::softening(metal(), 425.0), 1.0 - std::pow(0.25, 1.5));
  EXPECT_EQ(EVP::softening(metal(), 799.0), 0.02);
  EXPECT_EQ(EVP::softening(metal(), 900.0), 0.02);
}

TEST(Rate, HardensFromItsReferenceOn)
{
  Row row;
  EXPECT_EQ(EVP::hardening_by_rate(row, 1e9), 1.0);
  row.rate = 0.015;
  row.rate_rate0 = 10.0;
  EXPECT_EQ(EVP::hardening_by_rate(row, 0.0), 1.0);
  EXPECT_EQ(EVP::hardening_by_rate(row, 10.0), 1.0);
  EXPECT_DOUBLE_EQ(EVP::hardening_by_rate(row, 1000.0), 1.0 + 0.015 * std::log(100.0));
}

TEST(ThermalState, TakesLatentHeatBeforeItIsHotter)
{
  constexpr double MASS = 2.0, LATENT = 4e5;
  ThermalState sphere = {799.0, 0.0};
  sphere.take(1800.0 + 0.25 * MASS * LATENT, metal(LATENT), MASS);
  EXPECT_DOUBLE_EQ(sphere.temperature, 800.0);
  EXPECT_DOUBLE_EQ(sphere.latent, 0.25 * MASS * LATENT);
  sphere.take(0.75 * MASS * LATENT + 3600.0, metal(LATENT), MASS);
  EXPECT_DOUBLE_EQ(sphere.temperature, 802.0);
  EXPECT_DOUBLE_EQ(sphere.latent, MASS * LATENT);
  sphere.take(-7200.0 - MASS * LATENT, metal(LATENT), MASS);
  EXPECT_DOUBLE_EQ(sphere.temperature, 798.0);
  EXPECT_EQ(sphere.latent, 0.0);
  sphere.take(3600.0, metal(), MASS);
  EXPECT_DOUBLE_EQ(sphere.temperature, 800.0);
}

TEST(ThermalState, BelievesTheTemperatureThatOthersHaveSet)
{
  ThermalState sphere = {300.0, 1e5};    // was melting, and is cold now
  sphere.settle(metal(4e5), 1.0);
  sphere.take(900.0, metal(4e5), 1.0);
  EXPECT_DOUBLE_EQ(sphere.temperature, 301.0);
  EXPECT_EQ(sphere.latent, 0.0);
  sphere = {900.0, 0.0};
  sphere.settle(metal(4e5), 1.0);
  sphere.take(-900.0 * 100.0 - 1e5, metal(4e5), 1.0);
  EXPECT_DOUBLE_EQ(sphere.temperature, 800.0);
  EXPECT_DOUBLE_EQ(sphere.latent, 3e5);
}

// of two materials in series; not beyond d = (R_i + R_j)/2
TEST(Conductance, IsThatOfTheSeries)
{
  EXPECT_DOUBLE_EQ(EVP::conductance(2.0, 2.0, 3.0, 5.0, 4.0, 1.0), 4.0);
  EXPECT_DOUBLE_EQ(EVP::conductance(2.0, 6.0, 3.0, 5.0, 4.0, 1.0), 6.0);
  EXPECT_EQ(EVP::conductance(2.0, 0.0, 3.0, 5.0, 4.0, 1.0), 0.0);
  EXPECT_DOUBLE_EQ(EVP::conductance(2.0, 2.0, 3.0, 5.0, 1e-9, 1.0), 64.0);
  EXPECT_EQ(EVP::conducting_share(3, 1.0, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(EVP::conducting_share(2, 5.0, 4.0), 2.5);
}
