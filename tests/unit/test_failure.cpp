// SPDX-License-Identifier: GPL-2.0-only
// The strain at failure of Johnson and Cook by hand, damage, and what of the volume energy is left.

#include "core/failure/failure.h"
#include "core/volume/volume_energy.h"

#include <cmath>
#include <gtest/gtest.h>

using namespace EVP;

namespace {

Row copper()
{
  Row row;
  row.rate = 0.025;
  row.rate_rate0 = 1.0;
  row.soften_tref = 298.0;
  row.soften_tmelt = 1356.0;
  row.damage_d1 = 0.54;
  row.damage_d2 = 4.89;
  row.damage_d3 = -3.03;
  row.damage_d4 = 0.014;
  row.damage_d5 = 1.12;
  return row;
}

TEST(Failure, StrainByHand)
{
  const Row row = copper();
  const double tension = 0.54 + 4.89 * std::exp(-1.01);
  EXPECT_DOUBLE_EQ(failing::strain_at_failure(row, 1.0 / 3.0, 0.0, 0.0), tension);
  EXPECT_DOUBLE_EQ(failing::strain_at_failure(row, 1.0 / 3.0, 0.5, 0.0), tension);
  EXPECT_NEAR(failing::strain_at_failure(row, 1.0 / 3.0, 1000.0, 0.5),
              tension * (1.0 + 0.014 * std::log(1000.0)) * 1.56, 1e-14 * tension);
  Row brittle = row;    // the faster
  brittle.damage_d4 = -0.015;
  EXPECT_NEAR(failing::strain_at_failure(brittle, 1.0 / 3.0, 1000.0, 0.0),
              tension * (1.0 - 0.015 * std::log(1000.0)), 1e-14 * tension);
  EXPECT_DOUBLE_EQ(failing::strain_at_failure(brittle, 1.0 / 3.0, 1e300, 0.0), 0.1 * tension);
  EXPECT_DOUBLE_EQ(failing::strain_at_failure(row, 9.0, 0.0, 0.0), 0.54 + 4.89 * std::exp(-9.09));
  EXPECT_EQ(failing::homologous(row, 100.0), 0.0);
  EXPECT_DOUBLE_EQ(failing::homologous(row, 827.0), 0.5);
  EXPECT_EQ(failing::homologous(row, 2000.0), 1.0);
}

TEST(Failure, NothingFailsUnderPressure)
{
  const Row row = copper();
  EXPECT_EQ(failing::progress(row, 0.1, -1.0 / 3.0, 0.0, 0.0), 0.0);
  EXPECT_GT(failing::progress(row, 0.1, -0.33, 0.0, 0.0), 0.0);
  EXPECT_EQ(failing::progress(row, 0.0, 1.0, 0.0, 0.0), 0.0);
  EXPECT_FALSE(failing::fails(Row()));
}

TEST(Failure, DamageByOpeningAndByEnergy)
{
  Row row = copper();
  FailureRecord own{};
  own.stress = 3e8;
  own.opening = 1e-4;
  row.rupture = 4e-4;
  EXPECT_DOUBLE_EQ(failing::damage_of(own, row), 0.25);
  row.rupture = 0.0;
  EXPECT_EQ(failing::damage_of(own, row), 1.0);
  row.rupture = -1.0;
  row.rupture_energy = 60e3;    // as a full opening of 4e-4
  EXPECT_DOUBLE_EQ(failing::damage_of(own, row), 0.25);
  own.opening = 5e-4;
  EXPECT_EQ(failing::damage_of(own, row), 1.0);
  own.stress = 0.0;    // not known yet
  EXPECT_EQ(failing::damage_of(own, row), 0.0);
}

TEST(Failure, WhatPullsIsLeftInPart)
{
  const VolumeLaw law;
  const VolumeReference reference = {{2.0, 4.0}, 0.0, 0.0};
  const TakenOver taken = {50.0, 0.004};
  for (const double strain : {0.002, 0.05, 0.2, 0.5}) {
    const DensityNow now = {2.0 - 4.0 * strain, 0.0};
    const VolumeState whole = law.state(30.0, reference, now, taken),
                      left = law.state(30.0, reference, now, taken, 0.3);
    EXPECT_DOUBLE_EQ(left.energy, 0.3 * whole.energy);
    EXPECT_DOUBLE_EQ(left.bonded, 0.3 * whole.bonded);
    EXPECT_DOUBLE_EQ(left.pulling, 0.3 * whole.pulling);
    EXPECT_EQ(left.stiffness.total, whole.stiffness.total);
  }
  const DensityNow pressed = {2.4, 0.1};
  const VolumeState whole = law.state(30.0, reference, pressed, taken),
                    left = law.state(30.0, reference, pressed, taken, 0.3);
  EXPECT_EQ(left.energy, whole.energy);
  EXPECT_EQ(left.bonded, whole.bonded);
}

}    // namespace
