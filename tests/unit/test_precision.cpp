// SPDX-License-Identifier: GPL-2.0-only
//
// The loop of tests/precision is the project's own where it is in double, and its errors in float are
// those that theory gives: a strain xi is a difference of positions, so what rounding does to a
// coordinate comes back divided by xi.

#include "../precision/lattice.h"

#include <gtest/gtest.h>

using namespace precision;
using EVP::Level;

namespace {

constexpr double SAME_LOOP = 1e-13;    // of the largest pair force
constexpr double CORNER = 20.0;        // diameters from the origin, as in a real box
const double FLOAT_ROUNDING = std::ldexp(1.0, -24);
const double DOUBLE_ROUNDING = std::ldexp(1.0, -53);
const double FIRST_REGIME[] = {1e-5, 1e-4, 1e-3};

const Lattice &lattice()
{
  static const Lattice one = make_lattice(5, CORNER);
  return one;
}

/// Error of pair forces.
template <class T> Error pair_error(double xi)
{
  static const Lattice apart = pairs_apart(lattice());
  const Vectors x = apart.stretched(xi);
  return error_of(forces_in<T>(apart, x), plain_sum(apart, x));
}

/// Within an order of magnitude.
void expect_about(double found, double theory)
{
  EXPECT_GT(found, theory / 10);
  EXPECT_LT(found, theory * 10);
}

}    // namespace

TEST(Precision, LatticeIsWhatItIsSaidToBe)
{
  const int cells = 5, spheres = 4 * cells * cells * cells;
  EXPECT_EQ((int) lattice().rest.size(), spheres);
  EXPECT_EQ((int) lattice().list.nall, spheres);
  const double half_pairs = (double) lattice().list.pairs.size() / spheres;
  EXPECT_GT(half_pairs, 6.0);    // 9, less what the surface lacks
  EXPECT_LT(half_pairs, 9.0);
  for (const double xi : {1e-4, 1e-2}) {
    const Vectors x = lattice().stretched(xi);
    double force =
        0.0;    // all pairs are stretched alike, and those with the smallest deq pull most
    for (const double deq : lattice().deq)
      force = std::max(force, std::fabs(lattice().law.force((1.0 + xi) * deq, deq)));
    EXPECT_NEAR(plain_sum(lattice(), x).largest, force, 1e-9 * force);
  }
}

TEST(Precision, DoubleCopyIsTheProjectsOwnLoop)
{
  for (const double xi : {1e-5, 1e-3, 1e-2, -1e-2}) {
    const Vectors x = lattice().stretched(xi);
    const Truth own = {forces_of_kernel(lattice(), x), plain_sum(lattice(), x).largest};
    for (const Level level : {Level::BASE, Level::AVX2, Level::AVX512}) {
      if (level > EVP::best_level()) continue;
      EXPECT_LE(error_of(forces_in<Double>(lattice(), x, level), own).largest, SAME_LOOP) << xi;
    }
  }
}

TEST(Precision, InstructionSetsGiveTheSameBits)
{
  const Vectors x = lattice().stretched(1e-3);
  for (const Level level : {Level::AVX2, Level::AVX512}) {
    if (level > EVP::best_level()) continue;
    EXPECT_EQ(forces_in<Mixed>(lattice(), x, level), forces_in<Mixed>(lattice(), x, Level::BASE));
    EXPECT_EQ(forces_in<Single>(lattice(), x, level), forces_in<Single>(lattice(), x, Level::BASE));
    EXPECT_EQ(forces_in<StrainFirst>(lattice(), x, level),
              forces_in<StrainFirst>(lattice(), x, Level::BASE));
  }
}

TEST(Precision, PositionsInFloatCostTheirRoundingOverTheStrain)
{
  for (const double xi : FIRST_REGIME) {
    SCOPED_TRACE(xi);
    expect_about(pair_error<FloatPositions>(xi).rms, FLOAT_ROUNDING * lattice().reach() / xi);
    expect_about(pair_error<Single>(xi).rms, FLOAT_ROUNDING * lattice().reach() / xi);
  }
}

TEST(Precision, TheLawInFloatCostsRoundingOverTheStrain)
{
  for (const double xi : FIRST_REGIME) {
    SCOPED_TRACE(xi);
    expect_about(pair_error<Mixed>(xi).rms, FLOAT_ROUNDING / xi);
  }
}

TEST(Precision, DoubleCostsRoundingOverTheStrain)
{
  for (const double xi : FIRST_REGIME) {
    SCOPED_TRACE(xi);
    expect_about(pair_error<Double>(xi).rms, DOUBLE_ROUNDING / xi);
  }
}

TEST(Precision, AStrainFormedInDoubleLosesNothingByDivision)
{
  for (const double xi : {1e-5, 1e-4, 1e-3, 1e-2, -1e-3, -1e-2}) {
    SCOPED_TRACE(xi);
    EXPECT_LT(pair_error<StrainFirst>(xi).largest, 10 * FLOAT_ROUNDING);
  }
}
