// SPDX-License-Identifier: GPL-2.0-only
// The block of pairs whose flow stays against the law pair by pair, and what any history of one pair keeps.

#include "core/block_law.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

using namespace EVP;

namespace {

constexpr double ROUND_OFF = 1e-13;    // of the largest term of a sum

Row with_exponents(double m1, double n1, double m2, double n2, double gamma = 1000.0)
{
  return {80, m1, n1, 3, m2, n2, 0.005, gamma, 1.5};
}

const Row TABLE2 = with_exponents(8, 4, 8, 4);

const std::vector<std::vector<Row>> LAWS = {
    {TABLE2},
    {with_exponents(6, 3, 6, 3)},
    {with_exponents(4, 2, 4, 2)},
    {with_exponents(9, 5, 9, 5)},
    {with_exponents(8, 4, 6, 3)},
    {with_exponents(8.5, 4.25, 7.5, 2.5)},
    {TABLE2, with_exponents(8, 4, 8, 4, 0), {40, 8, 4, 5, 8, 4, 0.01, 300, 1.5}},
    {TABLE2, {40, 6, 3, 5, 4, 2, 0.01, 300, 1.5}},
};

std::vector<Level> levels()
{
  std::vector<Level> all = {Level::BASE};
  if (best_level() >= Level::AVX2) all.push_back(Level::AVX2);
  if (best_level() >= Level::AVX512) all.push_back(Level::AVX512);
  return all;
}

enum Kind { BOND, LITERAL, REPULSIVE, LEFT_OF_A_BOND, NOTHING_LEFT, KINDS };

/// Pairs of all kinds that have flowed either way, within their cuts and beyond.
struct Pairs {
  std::vector<Law> laws;
  std::vector<double> inv_deq, cutsq, cut, offset, work, cap, next_offset, spent, next_work;
  char moves = 0;
  std::vector<int> kind, sort;
  double margin_removed[2] = {1.0 / (1.0 + NEW_PAIR_MARGIN), 1.0 / (1.0 + BOND_MARGIN)};
  Block block;

  Pairs(const std::vector<Row> &rows, int n, int kinds)
  {
    for (const Row &row : rows) laws.emplace_back(row);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    block.n = n;
    for (int k = 0; k < n; k++) {
      const int law = k % (int) rows.size(), of = (k / 3) % kinds;
      const bool bond = of == BOND, repels = of > LITERAL;
      const double deq = 0.8 + 0.4 * unit(random);
      cut.push_back(of == NOTHING_LEFT ? 0.0 : deq * (repels ? 1.0 : (k % 2 ? 1.5 : 1.04)));
      inv_deq.push_back(1.0 / deq);
      cutsq.push_back(
          of == NOTHING_LEFT ? 0.0 : reach_squared(cut[k], bond ? BOND_MARGIN : NEW_PAIR_MARGIN));
      kind.push_back(2 * law + bond);
      sort.push_back(of);
      cap.push_back(laws[law].cap(bond, repels));
      const double p = 0.12 * (unit(random) - 0.5), within = std::min(p, cap[k]);
      offset.push_back(k % 4 == 0 ? 0.0 : within);
      work.push_back(unit(random));
      const double d = deq * (1.0 + 0.16 * (unit(random) - 0.5)), a = 6.3 * unit(random),
                   b = 3.1 * unit(random);
      block.xy[2 * k] = d * std::cos(a) * std::sin(b);
      block.xy[2 * k + 1] = d * std::sin(a) * std::sin(b);
      block.z[k] = d * std::cos(b);
      block.approach[k] = unit(random) - 0.5;
    }
    next_offset.resize(n);
    spent.resize(n);
  }

  void run(Level level, bool damping, bool energy, bool incremental)
  {
    std::vector<int> used;
    for (size_t k = 0; k < laws.size(); k++) used.push_back((int) k);
    BlockLaw law;
    law.assign(laws, used, true, level);
    block.inv_deq = inv_deq.data();
    block.cutsq = cutsq.data();
    block.margin_removed = margin_removed;
    block.kind = kind.data();
    block.flow = {offset.data(), work.data(), cap.data(), next_offset.data(), spent.data(), &moves};
    block.incremental = incremental;
    law(block, {damping, energy, false});
    next_work = work;
    for (int k = 0; moves && k < block.n; k++) next_work[k] += spent[k];
  }
};

}    // namespace

TEST(FlowKernel, EqualsTheLawPairByPair)
{
  int flowed = 0, ended = 0, pulled = 0, capped = 0;
  for (const auto &rows : LAWS)
    for (const Level level : levels())
      for (const bool damping : {false, true})
        for (const bool incremental : {false, true})
          for (const int n : {1, 7, 8, Block::SIZE}) {
            Pairs pairs(rows, n, KINDS);
            pairs.run(level, damping, true, incremental);
            for (int k = 0; k < n; k++) {
              SCOPED_TRACE("level " + std::to_string((int) level) + ", pair " + std::to_string(k) +
                           " of sort " + std::to_string(pairs.sort[k]));
              const Law &law = pairs.laws[pairs.kind[k] / 2];
              const Row &row = law.parameters();
              const double dsq = pairs.block.distance_squared(k), d = std::sqrt(dsq),
                           deq = 1.0 / pairs.inv_deq[k];
              const double p = pairs.offset[k], cap = pairs.cap[k];
              const bool bond = pairs.sort[k] == BOND, beyond = dsq > pairs.cutsq[k];
              const double reached = std::min(d, std::sqrt(pairs.cutsq[k]));
              const double now = law.flowed(reached, deq, p), keeps = law.kept(now, p, cap);
              const double scale = row.m1 * row.n1 * row.e1;

              double force = beyond ? 0.0 : law.flow_force(d, deq, now);
              if (cap < 0.0) force = std::max(force, 0.0);
              if (damping && !beyond) force -= row.gamma * pairs.block.approach[k] / d;
              EXPECT_NEAR(pairs.block.force[k] * d, force, ROUND_OFF * (scale / deq + row.gamma));
              const double next = pairs.next_offset[k];
              if (beyond && !bond) {
                EXPECT_TRUE(has_ended(next));
                EXPECT_EQ(pairs.next_work[k], 0.0);
                ended++;
              } else {
                EXPECT_NEAR(next, keeps, 1e-15);
                EXPECT_NEAR(pairs.next_work[k], pairs.work[k] + law.dissipated(p, keeps),
                            ROUND_OFF * scale);
                EXPECT_GE(pairs.next_work[k], pairs.work[k] - ROUND_OFF * row.e1);
                flowed += bond && next != p;
                capped += keeps != now;
                pulled += !bond && now > 0.0;
              }
              double energy = 0.0;
              if (pairs.sort[k] != NOTHING_LEFT && (!beyond || incremental))
                energy = law.flow_energy(std::min(d, pairs.cut[k]), deq, p, pairs.cut[k], cap,
                                         incremental);
              // a bond beyond its cut has flowed up to the edge of the margin
              const double margin = bond && beyond ? 2.0 * BOND_MARGIN * row.xi_s : 0.0;
              EXPECT_NEAR(pairs.block.energy[k], energy,
                          (1e-12 + margin * row.n1) * row.m1 * row.e1);
            }
          }
  EXPECT_GT(flowed, 1000);
  EXPECT_GT(ended, 1000);
  EXPECT_GT(pulled, 500);
  EXPECT_GT(capped, 500);
}

TEST(FlowKernel, TheSameBitsWithEnergyAndOnEveryInstructionSet)
{
  for (const auto &rows : LAWS)
    for (const bool damping : {false, true}) {
      Pairs plain(rows, Block::SIZE, KINDS);
      plain.run(Level::BASE, damping, true, false);
      for (const Level level : levels())
        for (const bool energy : {false, true}) {
          Pairs pairs(rows, Block::SIZE, KINDS);
          pairs.run(level, damping, energy, false);
          EXPECT_EQ(pairs.next_offset, plain.next_offset);
          EXPECT_EQ(pairs.next_work, plain.next_work);
          for (int k = 0; k < Block::SIZE; k++) {
            EXPECT_EQ(pairs.block.force[k], plain.block.force[k]);
            if (energy) { EXPECT_EQ(pairs.block.energy[k], plain.block.energy[k]); }
          }
        }
    }
}

// A pair that only ever stretches, or is only ever pushed, follows eq. 8, whatever its steps.
TEST(Flow, MonotonicCurvesAreThoseOfTheReversibleLaw)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const auto &rows : LAWS)
    for (const Row &row : rows)
      for (const double side : {1.0, -1.0})
        for (int way = 0; way < 20; way++) {
          const Law law(row);
          double p = 0.0, work = 0.0;
          for (double xi = 0.0; xi < 0.2; xi += 0.02 * unit(random)) {
            const double d = 1.0 + side * xi;
            EXPECT_NEAR(law.force(d, 1.0, p), law.force(d, 1.0), 1e-12 * row.m1 * row.n1 * row.e1);
            const double next = law.flowed(d, 1.0, p);
            work += law.dissipated(p, next);
            p = next;
          }
          EXPECT_NEAR(work, law.dissipated(0.0, p), 1e-12 * row.m1 * row.e1);
        }
}

// 2000 histories to and fro, with steps of all sizes: the force takes no step, neither on the way nor when
// the offset is taken over, and no flow sets energy free.
TEST(Flow, ForceIsContinuousOverRandomHistories)
{
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int through_compression = 0;
  for (int history = 0; history < 2000; history++) {
    const Law law(LAWS[history % LAWS.size()][0]);
    const Row &row = law.parameters();
    const int of = history / 8 % 3;    // bond, literal, repulsive
    const bool repels = of == REPULSIVE;
    const double cap = law.cap(of == BOND, repels), scale = row.m1 * row.n1 * row.e1;
    const auto force = [&](double d, double p) {
      const double f = law.force(d, 1.0, p);
      return repels ? std::max(f, 0.0) : f;
    };
    double d = 1.0, p = 0.0;
    bool compressed = false;
    for (int turn = 0; turn < 12; turn++) {
      const double target = 1.0 + (turn % 2 ? -0.12 : 0.12) * unit(random);
      const int steps = 1 + (int) (60 * unit(random) * unit(random));
      for (int step = 1; step <= steps; step++) {
        const double to = d + (target - d) * step / steps;
        for (const double tiny : {1e-9, -1e-9}) {
          const double rise = std::fabs(force(to + tiny, p) - force(to, p));
          ASSERT_LE(rise, 1.01e-9 * law.stiffness_ahead(to, 1.0, p) * 3.0 + 1e-12 * scale);
        }
        const double keeps = law.kept(law.flowed(to, 1.0, p), p, cap);
        ASSERT_NEAR(force(to, keeps), force(to, p), 1e-12 * scale);
        ASSERT_GE(law.dissipated(p, keeps), -1e-15 * row.e1);
        compressed = compressed || keeps < -0.01;
        p = keeps;
      }
      d = target;
    }
    through_compression += compressed;
  }
  EXPECT_GT(through_compression, 1000);
}

// Energy and force of a pair belong together: in a minimization at any d, in a run where nothing is kept; 0 at the cut.
// Some cuts are so near that no pair flows before them.
TEST(Flow, ForceIsMinusTheSlopeOfTheEnergy)
{
  constexpr double STEP = 1e-6;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int stretched = 0, pushed = 0;
  for (const auto &rows : LAWS)
    for (int trial = 0; trial < 3000; trial++) {
      const Law law(rows[0]);
      const Row &row = law.parameters();
      const int of = trial % 3;    // bond, literal, repulsive
      const bool repels = of == REPULSIVE;
      const double cut = repels ? 1.0 : std::array{1.5, 1.04, 1.003}[trial / 3 % 3];
      const double cap = law.cap(of == BOND, repels);
      const double p = trial / 9 % 3 ? std::min(0.12 * (unit(random) - 0.5), cap) : 0.0;
      const double d = cut - (0.002 + 0.1 * unit(random));
      const double scale = row.m1 * row.n1 * row.e1;
      double force = law.force(d, 1.0, p);
      if (repels) force = std::max(force, 0.0);
      const double keeps = law.kept(law.flowed(d, 1.0, p), p, cap);
      for (const bool incremental : {true, false}) {
        if (!incremental && keeps != p) continue;
        const auto energy = [&](double at) {
          return law.flow_energy(at, 1.0, p, cut, cap, incremental);
        };
        // the slope has a kink where a pair begins to flow
        EXPECT_NEAR((energy(d - STEP) - energy(d + STEP)) / (2.0 * STEP), force,
                    2.0 * STEP * 20.0 * scale)
            << "sort " << of << " d " << d << " cut " << cut << " p " << p << " " << incremental;
        if (keeps != p) continue;
        if (!repels && law.kept(law.flowed(cut, 1.0, p), p, cap) == p) {
          EXPECT_NEAR(energy(cut), 0.0, 1e-13 * scale);
        }
        if (of == LITERAL && p == 0.0) {
          EXPECT_NEAR(energy(d), law.energy(d, 1.0, cut), 1e-13 * scale) << d << " " << cut;
        }
      }
      stretched += of == LITERAL && p == 0.0 && d > 1.01;
      pushed += keeps < p;
    }
  EXPECT_GT(stretched, 200);
  EXPECT_GT(pushed, 2000);
}
