// SPDX-License-Identifier: GPL-2.0-only
// The volume energy by hand, its forces against its slope, its stiffness against dense sums.

#include "core/stiffness_matrix.h"
#include "core/volume_energy.h"
#include "one_rank.h"
#include "pair_cases.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using EVP::VolumeLaw;
using EVP::VolumePasses;
using EVP::VolumeReference;
using namespace pair_cases;

namespace {

constexpr double REACH = 0.4;
constexpr VolumeReference INSIDE = {{2.0, 4.0}, 0.0}, SURFACE = {{1.0, 2.0}, 0.7};

/// All pairs of a cloud up to REACH and some beyond it, bonds and fresh ones; densities at rest are up to twice as large or small.
struct Volume {
  const Cloud cloud{{TABLE2}, 0, false};
  EVP::PairList pairs[2] = {EVP::PairList(true), EVP::PairList(false)};
  std::vector<VolumeReference> references;
  VolumeLaw law;
  VolumePasses passes;
  std::vector<double> densities;

  Volume()
  {
    const int n = (int) cloud.x.size();
    std::vector<EVP::NeighborDensity> now(n, EVP::NeighborDensity{});
    for (EVP::PairList &list : pairs) list.clear(EVP::BOND_MARGIN, EVP::Flow::FORGETS);
    for (int i = 0; i < n; i++) {
      std::vector<Pair> rows[2];
      for (int j = i + 1; j < n; j++) {
        const double d = std::sqrt(EVP::PairGeometry(rows_of(cloud.x), i, j).dsq);
        if (d > 1.5 * REACH) continue;
        rows[j % 3 == 0].push_back({j, REACH, REACH});
        for (const int own : {i, j}) now[own].add(d, REACH);
      }
      for (int of : {0, 1}) add_row(pairs[of], i, rows[of]);
    }
    for (int i = 0; i < n; i++) {
      const double rest = now[i].rho / (1.0 + 0.3 * (i % 5 - 2) + 0.05);
      references.push_back({{rest, now[i].slope}, i % 2 ? 0.2 * rest : 0.0});
    }
  }

  Vectors forces()
  {
    Vectors f(cloud.x.size(), {0, 0, 0});
    const EVP::ParticleView view = cloud.view(f, (int) f.size());
    densities.assign(2 * f.size(), 0.0);
    for (int of : {0, 1})
      passes.add_densities(pairs[of], pairs[of].inv_deq, view, densities.data() + of);
    std::vector<double> pulls;
    for (size_t i = 0; i < f.size(); i++) {
      const EVP::VolumeState state =
          law.state(3.0, references[i], {densities[2 * i], densities[2 * i + 1]});
      pulls.push_back(state.bonded);
      pulls.push_back(state.fresh);
    }
    for (int of : {0, 1}) passes.add_forces(pairs[of], view, pulls.data() + of, EVP::NoTally());
    return f;
  }
};

/// Densities at a volume strain, of which a part is fresh.
EVP::DensityNow at(const VolumeReference &reference, double theta, double fresh = 0.0)
{
  return {reference.own.rho - theta * reference.own.slope - fresh, fresh};
}

}    // namespace

TEST(VolumeEnergy, ADensityByHand)
{
  EVP::NeighborDensity density{};
  density.add(1.0, 1.5);
  density.add(1.5, 1.5);
  density.add(1.5 * (1.0 + 1e-9), 1.5);    // recorded by the margin
  EXPECT_DOUBLE_EQ(density.rho, 1.0 / 9.0);
  EXPECT_DOUBLE_EQ(density.slope, 4.0 / 27.0);
  EXPECT_NEAR(VolumeLaw().state(1.0, {density, 0.0}, {std::pow(1.0 - 1.001 / 1.5, 2), 0.0}).strain,
              3e-3, 4e-6)
      << "the trace of a uniform strain";
}

TEST(VolumeEnergy, AParticleWithoutBondsHasNone)
{
  const EVP::VolumeState none = VolumeLaw().state(100.0, VolumeReference{}, {0.7, 0.1});
  for (const double value :
       {none.energy, none.bonded, none.fresh, none.stiffness.total, none.strain})
    EXPECT_EQ(value, 0.0);
}

TEST(VolumeEnergy, TheLawByHand)
{
  const VolumeLaw law;    // cavitation 0.15
  const double c = law.cavitation, kv = 7.0;
  const auto energy = [&](const VolumeReference &reference, double theta, double fresh = 0.0) {
    return law.state(kv, reference, at(reference, theta, fresh)).energy;
  };
  for (const VolumeReference &reference : {INSIDE, SURFACE}) {
    EXPECT_NEAR(energy(reference, c), 0.5 * kv * c * c, 1e-15);
    EXPECT_NEAR(energy(reference, 2.0 * c), kv * c * c, 1e-15);
    EXPECT_NEAR(energy(reference, 0.49), kv * c * c, 1e-15) << "torn: no force";
    EXPECT_NEAR(energy(reference, -0.5), 0.5 * kv * 0.25, 1e-14) << "compression has no end";
  }
  EXPECT_NEAR(energy(INSIDE, -0.5, 1.0), 0.5 * kv * 0.25, 1e-14) << "no gap: all pairs alike";
  EXPECT_NEAR(energy(SURFACE, 0.1, 0.5), 0.5 * kv * 0.01, 1e-14)
      << "they take the place of lost ones";
  EXPECT_NEAR(energy(SURFACE, -0.35, 0.7), 0.0, 1e-14) << "they fill the gap";
  EXPECT_NEAR(energy(SURFACE, -0.45, 0.9), 0.5 * kv * 0.01, 1e-14) << "beyond it they count";
  EXPECT_NEAR(energy(SURFACE, -0.45, 0.7), 0.5 * kv * (0.01 + 0.01), 1e-14)
      << "and so do the bonds";
  VolumeLaw endless;
  endless.cavitation = VolumeLaw::NEVER;
  EXPECT_NEAR(endless.state(kv, SURFACE, at(SURFACE, 0.49)).energy, 0.5 * kv * 0.49 * 0.49, 1e-14);
}

TEST(VolumeEnergy, ThePullsAreTheSlopesOfTheEnergyAndNeverJump)
{
  const VolumeLaw law;
  const double kv = 7.0, h = 1e-6, step = 1e-3;
  for (const VolumeReference &reference : {INSIDE, SURFACE})
    for (double fresh = 0.0; fresh < 1.2; fresh += 0.1)
      for (double bonded = 0.0; bonded < 3.0; bonded += step) {
        const auto energy = [&](double more_bonded, double more_fresh) {
          return law.state(kv, reference, {bonded + more_bonded, fresh + more_fresh}).energy;
        };
        const EVP::VolumeState now = law.state(kv, reference, {bonded, fresh}),
                               next = law.state(kv, reference, {bonded + step, fresh}),
                               above = law.state(kv, reference, {bonded, fresh + step});
        EXPECT_NEAR(now.bonded, -(energy(h, 0.0) - energy(-h, 0.0)) / (2.0 * h), 4e-6) << bonded;
        EXPECT_NEAR(now.fresh, -(energy(0.0, h) - energy(0.0, -h)) / (2.0 * h), 4e-6) << bonded;
        const double most = 1.001 * step *
            (std::max(now.stiffness.total, next.stiffness.total) +
             std::max(now.stiffness.bonded, next.stiffness.bonded));
        EXPECT_LE(std::fabs(next.bonded - now.bonded), most) << bonded << " " << fresh;
        EXPECT_LE(std::fabs(above.fresh - now.fresh),
                  1.001 * step * kv / std::pow(reference.own.slope, 2));
      }
}

TEST(VolumeEnergy, TheSameBitsOnEveryInstructionSet)
{
  Volume volume;
  std::vector<std::vector<double>> densities;
  std::vector<Vectors> forces;
  for (const EVP::InstructionSet level : levels()) {
    volume.passes = VolumePasses(level);
    forces.push_back(volume.forces());
    densities.push_back(volume.densities);
  }
  for (size_t k = 0; k < forces.size(); k++) {
    EXPECT_EQ(densities[k], densities[0]);
    EXPECT_EQ(forces[k], forces[0]);
  }
}

// A chain of three along x, springs k, its middle with volume energy: K (x3 - x1)^2 v^2 / 2, of which one is held.
TEST(VolumeEnergy, HeldNeighborsTakeNoPart)
{
  const double v = 0.7, stiffness = 20.0;
  OneRank alone;
  EVP::StiffnessMatrix network(alone);
  network.nreact = 3;
  network.inverse_mass = {1.0, 1.0, 0.0};
  network.start = {0.3, 0.1, 0.2, -0.5, 0.4, 0.1, 0.0, 0.0, 0.0};
  network.links = {{0, 1, {-1, 0, 0}, 2.0, 0.0, 0.5}, {1, 2, {-1, 0, 0}, 2.0, 0.0, 0.5}};
  network.with_volume = true;
  for (auto &link : network.links) link.opening = v;
  network.volume_stiffness = {{}, {0.0, stiffness}, {}};
  EXPECT_NEAR(network.largest_eigenvalue({0, 0, 0, 1.0}, 1e-8, 100).eigenvalue, v * v * stiffness,
              1e-7 * stiffness);
}
