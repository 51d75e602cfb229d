// SPDX-License-Identifier: GPL-2.0-only
// The loop over packed pairs against a plain sum over pairs written from the law alone.

#include "kernel_cases.h"
#include "law_cases.h"

#include <limits>
#include <utility>

using namespace EVP;
using namespace kernel_cases;

namespace {

const Row TABLE2 = {80, 8, 4, 3, 8, 4, 0.005, 1000, 1.5};
const Row UNDAMPED = {80, 8, 4, 3, 8, 4, 0.005, 0, 1.5};

Row with_exponents(double m1, double n1, double m2, double n2)
{
  return {80, m1, n1, 3, m2, n2, 0.005, 1000, 1.5};
}

// one law, several with the same exponents, and exponents of their own
const std::vector<std::vector<Row>> LAWS = {
    {TABLE2},
    {with_exponents(6, 3, 6, 3)},
    {with_exponents(4, 2, 4, 2)},
    {with_exponents(2, 1, 2, 1)},
    {with_exponents(12, 6, 12, 6)},
    {with_exponents(9, 5, 9, 5)},
    {with_exponents(8, 4, 6, 3)},
    {with_exponents(8.5, 4.25, 7.5, 2.5)},
    {TABLE2, UNDAMPED, {40, 8, 4, 5, 8, 4, 0.01, 300, 1.5}},
    {TABLE2, {40, 6, 3, 5, 4, 2, 0.01, 300, 1.5}},
    {with_exponents(9, 5, 9, 5), {40, 9, 5, 5, 9, 5, 0.01, 300, 1.5}},
};

std::string names(const std::vector<Row> &rows)
{
  std::string text = std::to_string(rows.size()) + " laws, ";
  return text + law_cases::name_of(rows.back());
}

/// All instruction sets of this machine.
std::vector<Level> levels()
{
  std::vector<Level> all = {Level::BASE};
  if (best_level() >= Level::AVX2) all.push_back(Level::AVX2);
  if (best_level() >= Level::AVX512) all.push_back(Level::AVX512);
  return all;
}

}    // namespace

TEST(Kernel, EqualsThePlainSum)
{
  for (const auto &rows : LAWS)
    for (const bool damping : {false, true}) {
      SCOPED_TRACE(names(rows) + (damping ? ", damped" : ""));
      const Cloud cloud = make_cloud(rows, 1000);
      const int n = (int) cloud.x.size();
      const PlainSum sum = plain_sum(cloud, damping, n);
      expect_forces(run_kernel(cloud, block_law(cloud), damping, n, NoTally()), sum);

      // control: what is tested is there
      EXPECT_LT(sum.interacting, 950);
      EXPECT_GT(sum.second, 300);
      EXPECT_LT(sum.second, sum.interacting - 100);
    }
}

TEST(Kernel, EqualsThePlainSumAtTheEdgesOfBlocks)
{
  const int size = Block::SIZE;
  for (const int npairs :
       {0, 1, 2, 7, 8, 9, size - 1, size, size + 1, 2 * size, 2 * size + 1, 1000}) {
    SCOPED_TRACE(npairs);
    const Cloud cloud = make_cloud({TABLE2}, npairs);
    const int n = (int) cloud.x.size();
    ASSERT_EQ((int) cloud.list.pairs.size(), npairs);
    const PlainSum sum = plain_sum(cloud, true, n);
    SumTally tally(cloud.list, n, true, true);
    expect_forces(run_kernel(cloud, block_law(cloud), true, n, tally), sum);
    EXPECT_NEAR(tally.total_energy(), sum.energy, ROUND_OFF * sum.energy_scale);
  }
}

TEST(Kernel, EqualsThePlainSumWhereTheListIsAskedForAhead)
{
  Cloud cloud = make_cloud({TABLE2}, 1000);
  const PairList once = cloud.list;
  const int repeats = CACHED_PAIRS / 1000 + 1;
  for (int repeat = 1; repeat < repeats; repeat++)
    for (const PackedRow &row : once.rows) {
      const int first = (int) cloud.list.pairs.size();
      for (int k = row.first; k < row.last; k++) {
        const PackedPair p = once.pairs[k];
        push_back(cloud.list.pairs, 1.0 / p.inv_deq, p.cut, p.j, p.law, p.is_bond());
      }
      cloud.list.rows.push_back({row.i, first, (int) cloud.list.pairs.size()});
    }
  ASSERT_GT((int) cloud.list.pairs.size(), CACHED_PAIRS);
  const int n = (int) cloud.x.size();
  const PlainSum sum = plain_sum(cloud, true, n);
  SumTally tally(cloud.list, n, true, true);
  expect_forces(run_kernel(cloud, block_law(cloud), true, n, tally), sum);
  EXPECT_NEAR(tally.total_energy(), sum.energy, ROUND_OFF * sum.energy_scale);
}

// newton off: ghosts, here the last ten particles, take no reaction, and their pairs count half.
TEST(Kernel, EnergyAndVirialEqualThePlainSum)
{
  for (const auto &rows : LAWS)
    for (const bool damping : {false, true})
      for (const int ghosts : {0, 10}) {
        SCOPED_TRACE(names(rows) + (damping ? ", damped" : ""));
        const Cloud cloud = make_cloud(rows, 1000);
        const int nreact = (int) cloud.x.size() - ghosts;
        const PlainSum sum = plain_sum(cloud, damping, nreact);
        SumTally tally(cloud.list, nreact, true, true);
        expect_forces(run_kernel(cloud, block_law(cloud), damping, nreact, tally), sum);
        EXPECT_NEAR(tally.total_energy(), sum.energy, ROUND_OFF * sum.energy_scale);
        for (int c = 0; c < 6; c++)
          EXPECT_NEAR(tally.total_virial(c), sum.virial[c], ROUND_OFF * sum.virial_scale);
      }
}

// Steps with energy and steps without must move the particles alike, and so must all machines.
TEST(Kernel, ForcesAreTheSameBitsWithTallyAndOnEveryInstructionSet)
{
  for (const auto &rows : LAWS)
    for (const bool damping : {false, true}) {
      SCOPED_TRACE(names(rows) + (damping ? ", damped" : ""));
      const Cloud cloud = make_cloud(rows, 1000);
      const int n = (int) cloud.x.size();
      const Vectors plain = run_kernel(cloud, block_law(cloud, Level::BASE), damping, n, NoTally());
      SumTally expected(cloud.list, n, true, true);
      run_kernel(cloud, block_law(cloud, Level::BASE), damping, n, expected);
      for (const Level level : levels()) {
        const BlockLaw law = block_law(cloud, level);
        SumTally tally(cloud.list, n, true, true);
        EXPECT_EQ(run_kernel(cloud, law, damping, n, NoTally()), plain) << (int) level;
        EXPECT_EQ(run_kernel(cloud, law, damping, n, tally), plain) << (int) level;
        EXPECT_EQ(tally.total_energy(), expected.total_energy()) << (int) level;
        for (int c = 0; c < 6; c++) EXPECT_EQ(tally.total_virial(c), expected.total_virial(c));
      }
    }
}

// One law for all pairs is looked up nowhere: the same numbers as when each pair names it.
TEST(Kernel, OneLawGivesTheSameBitsAsTheSameLawForEachPair)
{
  for (const bool damping : {false, true}) {
    Row further = TABLE2;
    further.alpha = 1.6;    // another row, in what the law does not read
    const Cloud cloud = make_cloud({TABLE2, further}, 1000);
    const int n = (int) cloud.x.size();
    BlockLaw one;
    one.assign(cloud.laws, {1});
    EXPECT_EQ(run_kernel(cloud, one, damping, n, NoTally()),
              run_kernel(cloud, block_law(cloud), damping, n, NoTally()));
  }
}

// A blow-up must show: a position that is not a number gives forces that are none.
TEST(Kernel, PositionsThatAreNoNumbersGiveForcesThatAreNone)
{
  Cloud cloud = make_cloud({TABLE2}, 1000);
  const int n = (int) cloud.x.size();
  cloud.x[3][1] = std::nan("");
  for (const Level level : levels())
    EXPECT_TRUE(std::isnan(run_kernel(cloud, block_law(cloud, level), false, n, NoTally())[3][1]));
}

// eq. 4 by hand: 1 m apart along x, closing at 2 m/s: the damper pushes i away from j.
TEST(Kernel, DampingOpposesApproach)
{
  const double x[2][3] = {{1, 0, 0}, {0, 0, 0}};
  const double vi[3] = {-2, 5, 0}, vj[3] = {0, 0, 0};
  const PairGeometry g(x, 0, 1);
  EXPECT_DOUBLE_EQ(damping_over_distance(1000, g, vi, vj) * g.dx, 2000);
}

// Touching spheres in a lattice have neighbors at their cut but for the round-off of the places.
TEST(Kernel, RoundOffAtTheCutDecidesNothing)
{
  const double cut = 2.0, eps = std::numeric_limits<double>::epsilon();
  for (const auto &exponents : {std::pair<double, double>{8, 4}, {9, 5}})
    for (const bool is_bond : {false, true})
      for (const double off : {-8 * eps, 0.0, 8 * eps, 1e-10, 1e-8, 1e-6}) {
        SCOPED_TRACE(std::to_string(is_bond) + " " + std::to_string(off));
        const double m = exponents.first, n = exponents.second, deq = 1.0;
        const Row row = {80, m, n, 3, m, n, 0.005, 0, cut};
        Cloud cloud;
        cloud.laws.emplace_back(row);
        cloud.x = {{0, 0, 0}, {cut * (1.0 + off), 0, 0}};
        cloud.v = cloud.x;
        push_back(cloud.list.pairs, deq, cut, 1, 0, is_bond);
        cloud.list.rows.push_back({0, 0, 1});
        EXPECT_NEAR(cloud.list.pairs[0].cut, cut, 4 * eps * cut);

        SumTally tally(cloud.list, 2, true, false);
        const Vectors f = run_kernel(cloud, block_law(cloud), false, 2, tally);
        if (off < 1e-9)
          EXPECT_NEAR(f[0][0], -Law(row).force(cut, deq), 1e-8);
        else
          EXPECT_EQ(f[0][0], 0.0);
        // the energy is zero at the cut itself, not where the pair ceases to act
        EXPECT_NEAR(tally.total_energy(), off < 1e-9 ? -Law(row).force(cut, deq) * cut * off : 0.0,
                    1e-12);
      }
}

TEST(Margins, LetNoPairFallBetweenTwoDecisions)
{
  EXPECT_LT(NEW_PAIR_MARGIN, RECORD_MARGIN) << "what is just not recorded is no new pair";
  EXPECT_LT(RECORD_MARGIN, BOND_MARGIN) << "what is recorded acts";
  EXPECT_LT(BOND_MARGIN, LIST_MARGIN) << "and the neighbor list holds it";
}

TEST(PackedPairs, AreCountedWithoutAWrap)
{
  constexpr size_t most = PackedPairs::MOST;
  EXPECT_TRUE(PackedPairs::fits(0, most));
  EXPECT_TRUE(PackedPairs::fits(most - 100, 100));
  EXPECT_FALSE(PackedPairs::fits(most - 100, 101));
  EXPECT_FALSE(PackedPairs::fits(1, std::numeric_limits<size_t>::max()));
  EXPECT_LT(most + 4 * Block::SIZE, (size_t) std::numeric_limits<int>::max());
}
