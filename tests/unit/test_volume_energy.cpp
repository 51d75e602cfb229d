// SPDX-License-Identifier: GPL-2.0-only
// The volume energy of small networks by hand, its forces against its slope, its stiffness against dense sums.

#include "core/stiffness_matrix.h"
#include "core/volume_energy.h"
#include "one_rank.h"
#include "pair_cases.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using EVP::VolumeEnergy;
using namespace pair_cases;

namespace {

/// Sums of the weights and energies of all particles of a cloud; volumes as fix evp/volume has them.
struct Volume {
  const Cloud &cloud;
  const EVP::PairList &bonds;
  double kv;
  VolumeEnergy energies;
  std::vector<double> weight_sums, sums, pulls;

  Volume(const Cloud &cloud_in, double kv_in) : cloud(cloud_in), bonds(cloud.lists.bonds), kv(kv_in)
  {
    energies.pack(bonds, [](int, const EVP::PackedPair &pair) {
      return pair.cut;
    });
    weight_sums.assign(cloud.x.size(), 0.0);
    EVP::for_each_pair(bonds, rows_of(cloud.x), [&](const EVP::PlacedPair &p) {
      weight_sums[p.i] += energies.weight_of(p.index);
      weight_sums[p.j] += energies.weight_of(p.index);
    });
  }

  double evaluate(const Vectors &x)
  {
    const EVP::ParticleView view = {rows_of(x), nullptr, nullptr, (int) x.size()};
    sums.assign(x.size(), 0.0);
    energies.add_strains(bonds, view, sums.data());
    pulls.assign(x.size(), 0.0);
    double energy = 0.0;
    for (size_t i = 0; i < x.size(); i++) {
      const double strain = VolumeEnergy::strain(sums[i], weight_sums[i]);
      pulls[i] = VolumeEnergy::pull(kv, strain, weight_sums[i]);
      energy += 0.5 * kv * strain * strain;
    }
    return energy;
  }

  Vectors forces()
  {
    Vectors f(cloud.x.size(), {0, 0, 0});
    evaluate(cloud.x);
    energies.add_forces(bonds, cloud.view(f, (int) cloud.x.size()), pulls.data(), EVP::NoTally());
    return f;
  }
};

}    // namespace

TEST(VolumeEnergy, WeightFadesTowardsTheCutOff)
{
  EXPECT_DOUBLE_EQ(VolumeEnergy::weight(1.0, 1.5), 1.0 - 1.0 / 2.25);
  EXPECT_EQ(VolumeEnergy::weight(1.5, 1.5), 0.0);
  EXPECT_EQ(VolumeEnergy::weight(1.5 * (1.0 + 1e-9), 1.5), 0.0);    // recorded by the margin
}

TEST(VolumeEnergy, AParticleWithoutBondsHasNone)
{
  EXPECT_EQ(VolumeEnergy::strain(0.0, 0.0), 0.0);
  EXPECT_EQ(VolumeEnergy::pull(100.0, 0.0, 0.0), 0.0);
  EXPECT_EQ(VolumeEnergy::stiffness(100.0, 0.0), 0.0);
}

TEST(VolumeEnergy, TwoParticles)
{
  Cloud cloud({TABLE2}, 0, false);
  cloud.x = {{0.0, 0.0, 0.0}, {1.02, 0.0, 0.0}, {2.0, 0.0, 0.0}, {0.0, 9.0, 0.0}};
  add_row(cloud.lists.contacts, 0, {{2, 1.0, 3.0}});    // has no weight
  add_row(cloud.lists.bonds, 0,
          {{1, 1.0, 1.5}, {3, 1.0, 1.5}});    // the second is past its cutoff: in W only
  Volume volume(cloud, 7.0);
  const double w = VolumeEnergy::weight(1.0, 1.5);
  EXPECT_DOUBLE_EQ(volume.weight_sums[0], 2.0 * w);
  const double energy = volume.evaluate(cloud.x);
  EXPECT_NEAR(volume.sums[0], w * 0.02, 1e-15);
  EXPECT_NEAR(volume.sums[1], w * 0.02, 1e-15);
  EXPECT_EQ(volume.sums[2], 0.0);
  EXPECT_EQ(volume.sums[3], 0.0);
  EXPECT_NEAR(energy, 0.5 * 7.0 * (0.03 * 0.03 + 0.06 * 0.06), 1e-14);
}

TEST(VolumeEnergy, ForcesAreTheSlopeOfTheEnergy)
{
  const Cloud cloud({TABLE2}, 600, false);
  Volume volume(cloud, 3.0);
  const Vectors forces = volume.forces();
  double largest = 0.0;
  std::array<double, 3> total = {0, 0, 0};
  for (const auto &f : forces)
    for (int c = 0; c < 3; c++) {
      largest = std::max(largest, std::fabs(f[c]));
      total[c] += f[c];
    }
  for (int c = 0; c < 3; c++) EXPECT_NEAR(total[c], 0.0, 1e-12 * largest);

  const double h = 1e-5;
  for (const size_t i : {0, 7, 31})
    for (int c = 0; c < 3; c++) {
      double slope = 0.0;
      for (const auto &[shift, weight] : {std::pair(-2, 1.0), {-1, -8.0}, {1, 8.0}, {2, -1.0}}) {
        Vectors moved = cloud.x;
        moved[i][c] += shift * h;
        slope += weight * volume.evaluate(moved) / (12.0 * h);
      }
      EXPECT_NEAR(forces[i][c], -slope, 1e-8 * largest);
    }
}

TEST(VolumeEnergy, TheSameBitsOnEveryInstructionSet)
{
  const Cloud cloud({TABLE2}, 600, false);
  const EVP::ParticleView view = {rows_of(cloud.x), nullptr, nullptr, 50};
  std::vector<std::vector<double>> found;
  for (const EVP::InstructionSet level : levels()) {
    VolumeEnergy energies(level);
    energies.pack(cloud.lists.bonds, [](int, const EVP::PackedPair &pair) {
      return pair.cut;
    });
    std::vector<double> sums(cloud.x.size(), 0.0);
    energies.add_strains(cloud.lists.bonds, view, sums.data());
    found.push_back(sums);
  }
  for (const auto &sums : found) EXPECT_EQ(sums, found[0]);
}

TEST(VolumeEnergy, ReactionsOfOthersAreLeftOut)
{
  const Cloud cloud({TABLE2}, 600, false);
  Volume volume(cloud, 3.0);
  volume.evaluate(cloud.x);
  const std::vector<double> all = volume.sums;
  const int nreact = 20;
  const EVP::ParticleView view = {rows_of(cloud.x), nullptr, nullptr, nreact};
  std::vector<double> own(cloud.x.size(), 0.0);
  volume.energies.add_strains(cloud.lists.bonds, view, own.data());
  for (int i = 0; i < nreact; i++) EXPECT_NEAR(own[i], all[i], 1e-13 * (1.0 + std::fabs(all[i])));
  std::vector<double> rows_only(cloud.x.size(), 0.0);
  EVP::for_each_pair(cloud.lists.bonds, rows_of(cloud.x), [&](const EVP::PlacedPair &p) {
    if (!p.is_past_cutoff())
      rows_only[p.i] += volume.energies.weight_of(p.index) * (p.distance() * p.inv_deq - 1.0);
  });
  for (size_t i = nreact; i < own.size(); i++) EXPECT_NEAR(own[i], rows_only[i], 1e-13);
}

namespace {

OneRank alone;

/// A chain of three along x, springs k, its middle with volume energy: K (x3 - x1)^2 v^2 / 2.
EVP::StiffnessMatrix chain(double v, double stiffness)
{
  EVP::StiffnessMatrix network(alone);
  network.nreact = 3;
  network.inverse_mass = {1.0, 1.0, 1.0};
  network.start = {0.3, 0.1, 0.2, -0.5, 0.4, 0.1, 0.6, -0.2, 0.7};
  network.links = {{0, 1, {-1, 0, 0}, 2.0, 0.0, 0.5}, {1, 2, {-1, 0, 0}, 2.0, 0.0, 0.5}};
  network.with_volume = true;
  network.openings = {v, v};
  network.volume_stiffness = {0.0, stiffness, 0.0};
  return network;
}

}    // namespace

// modes of the chain: (1, 0, -1) with k + 2 v^2 K, which its neighbors share, and (1, -2, 1) with 3 k
TEST(VolumeEnergy, StiffnessOfAChain)
{
  const double v = 0.7;
  for (const double stiffness : {0.0, 1.0, 20.0}) {
    EVP::StiffnessMatrix network = chain(v, stiffness);
    const double expected = std::max(6.0, 2.0 + 2.0 * v * v * stiffness);
    const EVP::StiffnessMatrix::Mix mix = {1.0, 1.0, 0.0, 1.0};
    EXPECT_NEAR(network.largest_eigenvalue(mix, 1e-8, 100).eigenvalue, expected, 1e-7 * expected);
    EXPECT_NEAR(network.largest_eigenvalue({0, 0, 0, 1.0}, 1e-8, 100).eigenvalue,
                2.0 * v * v * stiffness, 1e-7 * (1.0 + stiffness));
    const std::vector<double> sums = network.row_sums(mix);
    EXPECT_NEAR(sums[0], 4.0 + 2.0 * v * v * stiffness, 1e-12 * (1.0 + stiffness));
    EXPECT_GE(*std::max_element(sums.begin(), sums.end()), expected);
  }
}

TEST(VolumeEnergy, HeldNeighborsTakeNoPart)
{
  const double v = 0.7, stiffness = 20.0;
  EVP::StiffnessMatrix network = chain(v, stiffness);
  network.inverse_mass[2] = 0.0;
  std::fill(network.start.begin() + 6, network.start.end(), 0.0);
  EXPECT_NEAR(network.largest_eigenvalue({0, 0, 0, 1.0}, 1e-8, 100).eigenvalue, v * v * stiffness,
              1e-7 * stiffness);
}

// (e1 + e2)^2 v^2 K <= bound1 e1^2 + bound2 e2^2, equal where both bonds are strained alike
TEST(VolumeEnergy, SpringsThatAreStifferInAnyMotion)
{
  const double v = 0.7, stiffness = 20.0;
  EVP::StiffnessMatrix network = chain(v, stiffness);
  const std::vector<double> bound = network.stiffness_above_volume({1.0, 1.0});
  EXPECT_NEAR(bound[0] + bound[1], 4.0 * v * v * stiffness, 1e-12 * stiffness);
  for (const double e : {-2.0, -0.3, 0.5, 1.0, 3.0})
    EXPECT_LE((1.0 + e) * (1.0 + e) * v * v * stiffness,
              (bound[0] + bound[1] * e * e) * (1.0 + 1e-12));
}
