// SPDX-License-Identifier: GPL-2.0-only
// The volume energy by hand, its forces against its slope, its stiffness against dense sums.

#include "core/timestep/stiffness_matrix.h"
#include "core/volume/volume_energy.h"
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
constexpr VolumeReference INSIDE = {{2.0, 4.0}, 0.0, 0.0}, SURFACE = {{1.0, 2.0}, 0.7, 0.0},
                          TORN = {{1.0, 2.0}, 0.7, 1.0};

/// All pairs of a cloud up to REACH and some beyond it, bonds and unbonded ones; densities at rest are up to twice as large or small.
struct Volume {
  const Cloud cloud{{TABLE2}, 0, false};
  EVP::PairList pairs[2] = {EVP::PairList(true), EVP::PairList(false)};
  std::vector<VolumeReference> references;
  VolumeLaw law;
  std::vector<double> densities, pulls;

  Volume()
  {
    const int n = (int) cloud.x.size();
    std::vector<EVP::NeighborDensity> now(n, EVP::NeighborDensity{});
    for (EVP::PairList &list : pairs) list.clear(EVP::BOND_MARGIN, EVP::Flow::REVERSIBLE);
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
      references.push_back({{rest, now[i].slope}, i % 2 ? 0.2 * rest : 0.0, 0.0});
    }
  }

  double evaluate(const Vectors &x)
  {
    const EVP::ParticleView view = {rows_of(x), nullptr, nullptr, (int) x.size()};
    densities.assign(2 * x.size(), 0.0);
    for (int of : {0, 1})
      VolumePasses::add_densities(pairs[of], pairs[of].inv_deq, view, {densities.data() + of, 2});
    pulls.assign(2 * x.size(), 0.0);
    double energy = 0.0;
    for (size_t i = 0; i < x.size(); i++) {
      const EVP::VolumeState state =
          law.state(3.0, references[i], {densities[2 * i], densities[2 * i + 1]});
      pulls[2 * i] = state.bonded;
      pulls[2 * i + 1] = state.pulling;
      energy += state.energy;
    }
    return energy;
  }

  Vectors forces()
  {
    Vectors f(cloud.x.size(), {0, 0, 0});
    evaluate(cloud.x);
    for (int of : {0, 1}) {
      VolumePasses::Forces added(pairs[of].inv_deq.data(), {pulls.data() + of, 2});
      accumulate_forces(pairs[of], {}, cloud.view(f, (int) cloud.x.size(), false), {&added});
    }
    return f;
  }
};

/// Densities at a volume strain, of which a part is unbonded.
EVP::DensityNow at(const VolumeReference &reference, double theta, double unbonded = 0.0)
{
  return {reference.own.rho - theta * reference.own.slope - unbonded, unbonded};
}

/// No other MPI rank, and no ghost.
class OneRank : public EVP::PerAtomComm {
 public:
  void forward_comm(EVP::AtomValues &) override {}
  void reverse_comm(EVP::AtomValues &) override {}
  double sum(double here) override { return here; }
};

}    // namespace

TEST(VolumeEnergy, ADensityByHand)
{
  EVP::NeighborDensity density{};
  density.add(1.0, 1.5);
  density.add(1.5, 1.5);
  density.add(1.5 * (1.0 + 1e-9), 1.5);    // recorded by the margin
  EXPECT_DOUBLE_EQ(density.rho, 1.0 / 9.0);
  EXPECT_DOUBLE_EQ(density.slope, 4.0 / 27.0);
  EXPECT_NEAR(
      VolumeLaw().state(1.0, {density, 0.0, 0.0}, {std::pow(1.0 - 1.001 / 1.5, 2), 0.0}).strain,
      3e-3, 4e-6)
      << "the trace of a uniform strain";
}

TEST(VolumeEnergy, AParticleWithoutBondsHasNone)
{
  const EVP::VolumeState state = VolumeLaw().state(100.0, VolumeReference{}, {0.7, 0.1});
  EXPECT_EQ(state.energy, 0.0);
  EXPECT_EQ(state.bonded, 0.0);
  EXPECT_EQ(state.pulling, 0.0);
  EXPECT_EQ(state.pushing, 0.0);
  EXPECT_EQ(state.stiffness.total, 0.0);
  EXPECT_EQ(state.strain, 0.0);
}

TEST(VolumeEnergy, TheLawByHand)
{
  const VolumeLaw law;    // cavitation 0.15
  const double c = law.cavitation, kv = 7.0;
  const auto energy = [&](const VolumeReference &reference, double theta, double unbonded = 0.0) {
    return law.state(kv, reference, at(reference, theta, unbonded)).energy;
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
  for (const EVP::TakenOver &taken : {EVP::TakenOver{}, EVP::TakenOver{40.0, 0.01}})
    for (const VolumeReference &reference : {INSIDE, SURFACE, TORN})
      for (const double pushing : {0.0, 0.15, 0.6})
        for (double unbonded = 0.0; unbonded < 1.2; unbonded += 0.1)
          for (double bonded = 0.0; bonded < 3.0; bonded += step) {
            const auto state = [&](double a, double b, double c) {
              return law.state(kv, reference, {bonded + a, unbonded + b, pushing + c}, taken);
            };
            const EVP::VolumeState now = state(0.0, 0.0, 0.0), next = state(step, 0.0, 0.0),
                                   above = state(0.0, step, 0.0);
            const auto slope = [&](double a, double b, double c) {
              return (state(a, b, c).energy - state(-a, -b, -c).energy) / (2.0 * h);
            };
            EXPECT_NEAR(now.bonded, -slope(h, 0.0, 0.0), 2e-5) << bonded;
            EXPECT_NEAR(now.pulling, -slope(0.0, h, 0.0), 2e-5) << bonded;
            EXPECT_TRUE(pushing == 0.0 || std::fabs(now.pushing + slope(0.0, 0.0, h)) < 2e-5)
                << bonded;
            const auto most = [&](const EVP::VolumeState &then, double of_bonds) {
              return 1.001 * step *
                  (std::max(now.stiffness.total, then.stiffness.total) +
                   of_bonds * std::max(now.stiffness.bonded, then.stiffness.bonded));
            };
            EXPECT_LE(std::fabs(next.bonded - now.bonded), most(next, 1.0))
                << bonded << " " << unbonded;
            EXPECT_LE(std::fabs(above.pulling - now.pulling), most(above, 0.0))
                << bonded << " " << unbonded;
          }
}

TEST(VolumeEnergy, WhatIsTakenOverByHand)
{
  const VolumeLaw law;
  const EVP::TakenOver taken = {40.0, 0.01};
  const auto added = [&](double theta) {
    return law.state(7.0, INSIDE, at(INSIDE, theta), taken).energy -
        law.state(7.0, INSIDE, at(INSIDE, theta)).energy;
  };
  EXPECT_NEAR(added(-0.05), 20.0 * 0.04 * 0.04, 1e-12);
  EXPECT_NEAR(added(0.014), 20.0 * 0.004 * 0.004, 1e-12);
  EXPECT_NEAR(added(0.1), 40.0 * 0.006 * (0.09 - 0.003), 1e-12) << "the pull does not grow further";
  EXPECT_NEAR(added(0.3), 40.0 * 0.006 * (0.14 - 0.003 + 0.075), 1e-12) << "and ends";
  EXPECT_EQ(added(0.01), 0.0);
  EXPECT_EQ(added(-0.01), 0.0);
}

TEST(VolumeEnergy, NewPairsOfTornParticlesOnlyPush)
{
  const VolumeLaw law;
  bool pulls = false;
  for (double bonded = 0.0; bonded < 3.0; bonded += 0.01)
    for (double unbonded = 0.0; unbonded < 3.0; unbonded += 0.01) {
      const double torn = law.state(7.0, TORN, {bonded, unbonded}).pulling;
      EXPECT_LE(torn, 0.0);
      EXPECT_EQ(torn<0.0, bonded + unbonded> 1.7) << "denser than the interior at rest";
      pulls = pulls || law.state(7.0, SURFACE, {bonded, unbonded}).pulling > 0.0;
    }
  EXPECT_TRUE(pulls) << "control";
}

TEST(VolumeEnergy, BondsThatBreakLeaveWithoutAJump)
{
  const VolumeLaw law;
  const double kv = 7.0;
  for (VolumeReference reference : {INSIDE, SURFACE, TORN})
    for (double bonded = 0.5; bonded < 1.5 * reference.own.rho; bonded += 0.01)
      for (const double unbonded : {0.0, 0.1, 0.4}) {
        const EVP::DensityNow before = {bonded, unbonded}, after = {bonded - 0.05, unbonded + 0.05};
        const VolumeReference left = VolumeLaw::without(reference, before, 0.05);
        const EVP::VolumeState then = law.state(kv, reference, before),
                               now = law.state(kv, left, after);
        EXPECT_NEAR(now.energy, then.energy, 1e-13) << bonded << " " << unbonded;
        EXPECT_NEAR(now.bonded, then.bonded, 1e-13) << bonded << " " << unbonded;
        EXPECT_LE(now.pulling, 0.0);
        EXPECT_NEAR(left.own.rho + left.gap, reference.own.rho + reference.gap, 1e-14);
      }
}

/// What is the same before and after an event, on a grid of densities at it.
template <class F> void expect_no_jump(F &&event)
{
  const VolumeLaw law;
  const double kv = 7.0;
  for (const VolumeReference &reference : {INSIDE, SURFACE, TORN})
    for (double bonded = 0.5; bonded < 1.5 * reference.own.rho; bonded += 0.01)
      for (const double pulling : {0.06, 0.1, 0.4})
        for (const double pushing : {0.0, 0.3}) {
          const EVP::DensityNow before = {bonded, pulling, pushing};
          const auto [left, after] = event(reference, before);
          const EVP::VolumeState then = law.state(kv, reference, before),
                                 now = law.state(kv, left, after);
          EXPECT_NEAR(now.energy, then.energy, 1e-13) << bonded << " " << pulling;
          EXPECT_NEAR(now.bonded, then.bonded, 1e-13) << bonded << " " << pulling;
          EXPECT_NEAR(now.pushing, then.pushing, 1e-13) << bonded << " " << pulling;
          if (then.strain > 0.0) { EXPECT_NEAR(now.strain, then.strain, 1e-14); }
          EXPECT_NEAR(
              left.own.rho + left.gap,
              reference.own.rho + reference.gap +
                  (after.bonded + after.pulling + after.pushing - bonded - pulling - pushing),
              1e-14);
        }
}

TEST(VolumeEnergy, AParticleIsTornOpenWithoutAJump)
{
  expect_no_jump([](const VolumeReference &reference, const EVP::DensityNow &now) {
    const VolumeReference left = VolumeLaw::opened(reference, now);
    EXPECT_LE(VolumeLaw().state(7.0, left, now).pulling, 0.0) << "its new pairs do not pull";
    return std::pair(left, now);
  });
}

TEST(VolumeEnergy, PairsBesideATornOneCeaseToPullWithoutAJump)
{
  constexpr double SHARE = 0.05;
  bool pulls = false;
  expect_no_jump([&](const VolumeReference &reference, const EVP::DensityNow &now) {
    const VolumeReference left = VolumeLaw::beside_open(reference, now, SHARE);
    const EVP::DensityNow after = {now.bonded, now.pulling - SHARE, now.pushing + SHARE};
    pulls = pulls || VolumeLaw().state(7.0, left, after).pulling > 0.0;
    EXPECT_LE(VolumeLaw().state(7.0, left, after).pushing, 0.0);
    return std::pair(left, after);
  });
  EXPECT_TRUE(pulls) << "control: the others do";
}

TEST(VolumeEnergy, PairsThatWereThereBeforeCountWithoutAJump)
{
  constexpr double SHARE = 0.05;
  expect_no_jump([](const VolumeReference &reference, const EVP::DensityNow &now) {
    return std::pair(VolumeLaw::beside(reference, now, SHARE),
                     EVP::DensityNow{now.bonded, now.pulling + SHARE, now.pushing});
  });
}

TEST(VolumeEnergy, ForcesAreTheSlopeOfTheEnergy)
{
  Volume volume;
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
        Vectors moved = volume.cloud.x;
        moved[i][c] += shift * h;
        slope += weight * volume.evaluate(moved) / (12.0 * h);
      }
      EXPECT_NEAR(forces[i][c], -slope, 1e-8 * largest);
    }
}

TEST(VolumeEnergy, TheSameBitsOnEveryInstructionSet)
{
  Volume volume;
  std::vector<std::vector<double>> densities;
  std::vector<Vectors> forces;
  on_each_instruction_set([&] {
    forces.push_back(volume.forces());
    densities.push_back(volume.densities);
  });
  for (size_t k = 0; k < forces.size(); k++) {
    EXPECT_EQ(densities[k], densities[0]);
    EXPECT_EQ(forces[k], forces[0]);
  }
}

TEST(VolumeEnergy, ReactionsOfOthersAreLeftOut)
{
  Volume volume;
  volume.evaluate(volume.cloud.x);
  const std::vector<double> all = volume.densities;
  const int nreact = 20;
  const EVP::ParticleView view = {rows_of(volume.cloud.x), nullptr, nullptr, nreact};
  std::vector<double> own(all.size(), 0.0), rows_only(all.size(), 0.0);
  VolumePasses::add_densities(volume.pairs[0], volume.pairs[0].inv_deq, view, {own.data(), 2});
  EVP::for_each_pair(volume.pairs[0], rows_of(volume.cloud.x), [&](const EVP::PlacedPair &p) {
    if (!p.is_past_cutoff()) rows_only[2 * p.i] += std::pow(1.0 - p.distance() * p.inv_deq, 2);
  });
  for (size_t k = 0; k < own.size(); k += 2)
    EXPECT_NEAR(own[k], k < 2 * nreact ? all[k] : rows_only[k], 1e-13);
}

TEST(VolumeEnergy, APairCountsForOneOfItsParticles)
{
  Volume volume;
  const int n = (int) volume.cloud.x.size();
  const EVP::ParticleView view = {rows_of(volume.cloud.x), nullptr, nullptr, n};
  std::vector<double> both(n, 0.0), ends(n, 0.0), pulls(n, 0.5), of_row(n, 0.0);
  const EVP::PairList &list = volume.pairs[0];
  VolumePasses::add_densities(list, list.inv_deq, view, {both.data(), 1});
  for (const auto end : {VolumePasses::ROW, VolumePasses::PARTNER})
    VolumePasses::add_densities(list, list.inv_deq, view, {ends.data(), 1}, end);
  VolumePasses::add_densities(list, list.inv_deq, view, {of_row.data(), 1}, VolumePasses::ROW);
  for (int i = 0; i < n; i++) EXPECT_NEAR(ends[i], both[i], 1e-13);
  EXPECT_NE(of_row, both) << "control";

  const auto forces = [&](VolumePasses::Ends end) {
    Vectors f(n, {0, 0, 0});
    VolumePasses::Forces added(list.inv_deq.data(), {pulls.data(), 1}, end);
    accumulate_forces(volume.pairs[0], {}, volume.cloud.view(f, n, false), {&added});
    return f;
  };
  const Vectors whole = forces(VolumePasses::BOTH), row = forces(VolumePasses::ROW),
                partner = forces(VolumePasses::PARTNER);
  for (int i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) EXPECT_NEAR(row[i][c] + partner[i][c], whole[i][c], 1e-12);
}

// A chain of three along x, springs k, its middle with volume energy: K (x3 - x1)^2 v^2 / 2, of which one is held.
TEST(VolumeEnergy, HeldNeighborsTakeNoPart)
{
  const double v = 0.7, stiffness = 20.0;
  OneRank alone;
  EVP::StiffnessMatrix network(alone);
  network.nreact = 3;
  network.inverse_mass = {1.0, 1.0, 0.0};
  const double start[] = {0.3, 0.1, 0.2, -0.5, 0.4, 0.1, 0.0, 0.0, 0.0};
  network.start.resize(3);
  network.start.set_first(3, start);
  network.links = {{0, 1, {-1, 0, 0}, 2.0, 0.0, 0.5}, {1, 2, {-1, 0, 0}, 2.0, 0.0, 0.5}};
  network.densities = {{{{v}, {v}}, {{}, {0.0, stiffness}, {}}}};
  EXPECT_NEAR(network.largest_eigenvalue({0, 0, 0, 1.0}, 1e-8, 100).eigenvalue, v * v * stiffness,
              1e-7 * stiffness);
}
