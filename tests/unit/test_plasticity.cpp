// SPDX-License-Identifier: GPL-2.0-only
//
// Plasticity of one pair against a map of its own, written as model and manual state it: long double, and quadrature
// along the way. How far spheres hold.

#include "core/law/limit.h"
#include "pair_cases.h"

#include <cmath>

using namespace EVP;
using namespace pair_cases;
using Exact = long double;

namespace {

constexpr double SUM_RADII = 1.02;    // up to there a contact acts
constexpr double CUTOFF = 10.0;       // of a bond

/// Three points of Gauss in each of 24 panels.
template <class F> Exact integral(F f, Exact a, Exact b)
{
  Exact sum = 0, half = (b - a) / 48;
  for (int panel = 0; panel < 24; panel++) {
    const Exact middle = a + (2 * panel + 1) * half, off = half * std::sqrt(0.6L);
    sum += half * (5 * f(middle - off) + 8 * f(middle) + 5 * f(middle + off)) / 9;
  }
  return sum;
}

struct NaiveMap {
  Row row;
  bool is_contact;
  Exact deq;

  struct Now {
    Exact force = 0, stored = 0, dissipated = 0, work = 0;    // work: done on the pair
  };

  Exact force_at(Exact d, Exact rest) const
  {
    const Exact m = row.m1, n = row.n1, s = rest / d;
    return row.e1 * m * n / (m - n) / rest * (std::pow(s, m + 1) - std::pow(s, n + 1));
  }
  Exact stored_at(Exact d, Exact rest) const
  {
    const Exact m = row.m1, n = row.n1, s = rest / d;
    return row.e1 * (1 + (n * std::pow(s, m) - m * std::pow(s, n)) / (m - n));
  }

  /// From d0, where the pair is within its limit, to d.
  Now move_to(Exact d0, Exact d, Exact y)
  {
    const Exact low = (1 - y) * deq, high = is_contact ? deq : (1 + y) * deq;
    const bool flows = d < low || (!is_contact && d > high);
    const Exact edge = d < low ? low : high;    // where it begins to
    const auto pull_elastic = [&](Exact at) {
      return is_contact && at > deq ? 0 : -force_at(at, deq);
    };
    const auto force_flowing = [&](Exact at) {
      return force_at(at, deq * at / edge);
    };
    Now now;
    const Exact end = flows ? edge : d;
    // a contact has a bend at its deq
    if (is_contact && (d0 - deq) * (end - deq) < 0)
      now.work = integral(pull_elastic, d0, deq) + integral(pull_elastic, deq, end);
    else
      now.work = integral(pull_elastic, d0, end);
    if (flows) {
      const Exact work = -integral(force_flowing, edge, d), before = stored_at(edge, deq);
      deq *= d / edge;
      now.work += work;
      now.dissipated = work + before - stored_at(d, deq);
    }
    if (is_contact && d > SUM_RADII) deq = SUM_RADII;
    if (!is_contact || d < deq) {
      now.force = force_at(d, deq);
      now.stored = stored_at(d, deq);
    }
    return now;
  }
};

struct Found {
  double force, stored, dissipated;
};

/// One pair in the time-step loop.
class OnePair {
 public:
  PairLists lists;
  FlowSums sums;

  OnePair(const Row &row, bool is_contact) : list(is_contact ? lists.contacts : lists.bonds)
  {
    list.clear(0.0, is_contact ? Flow::PLASTIC_CONTACT : Flow::PLASTIC);
    add_row(list, 0, {{1, is_contact ? SUM_RADII : 1.0, is_contact ? SUM_RADII : CUTOFF}});
    law.assign({PairLaw(row)}, {0}, list.flow());
    sums.reset(2);
  }
  double deq() const { return 1.0 / list.inv_deq[0]; }

  Found move_to(double d, double limit)
  {
    const double x[2][3] = {{d, 0, 0}, {0, 0, 0}};
    double f[2][3] = {};
    list.limit[0] = limit;
    Tally tally;
    accumulate_forces(list, law, {x, nullptr, f, 2}, {&tally});
    commit_flow(list, 2, sums);
    return tally.found;
  }

 private:
  PairList &list;
  BlockLaw law;
  struct Tally final : PairConsumer {
    Found found = {};
    void ask(const PairList &, BlockLaw::Asked &asked) const override { asked.potential = true; }
    void operator()(const PairRange &, PairBlock &block) override
    {
      found.force = block.force[0] * std::sqrt(block.distance_squared(0));
      found.stored = block.potential[0];
      found.dissipated = *block.flow.any_flow ? block.flow.dissipated[0] : 0.0;
    }
  };
};

const std::vector<Row> ROWS = {with_exponents(8, 4, 8, 4), with_exponents(7.5, 3.2, 7.5, 3.2),
                               with_exponents(6, 3, 6, 3), with_exponents(12, 6, 2, 1)};

}    // namespace

// increments of all sizes, up to halving and doubling the distance; the limit grows from 0.004 to 0.06
TEST(Plasticity, TwoThousandIncrementsFollowTheNaiveMap)
{
  for (const Row &row : ROWS)
    for (const bool is_contact : {false, true}) {
      SCOPED_TRACE(name_of(row) + (is_contact ? "contact" : "bond"));
      std::mt19937 random(5);
      std::uniform_real_distribution<double> unit(-1.0, 1.0);
      NaiveMap naive{row, is_contact, is_contact ? SUM_RADII : 1.0};
      OnePair kernel(row, is_contact);
      Exact work = 0, spent = 0, all_work = 0, slips = 0;
      int flowed = 0, far = 0, parted = 0;
      double d = is_contact ? SUM_RADII : 1.0;
      for (int step = 0; step < 2000; step++) {
        const double limit = 0.004 + 0.056 * step / 2000, before = d;
        const Exact deq_before = naive.deq;
        const double size = std::pow(10.0, -5.0 + 4.7 * std::fabs(unit(random)));
        d *= 1.0 + (d > 1.5 ? -1 : d < 0.5 ? 1 : unit(random) < 0.0 ? -1 : 1) * size;
        const NaiveMap::Now expected = naive.move_to(before, d, limit);
        const Found now = kernel.move_to(d, limit);
        const double begin = row.m1 * row.n1 * row.e1 / (double) naive.deq;
        ASSERT_NEAR(now.force, (double) expected.force, 1e-12 * begin) << step;
        ASSERT_NEAR(now.stored, (double) expected.stored, 1e-12 * row.e1);
        ASSERT_NEAR(now.dissipated, (double) expected.dissipated, 1e-12 * begin);
        ASSERT_GE(now.dissipated, 0.0);
        ASSERT_NEAR(kernel.deq(), (double) naive.deq, 1e-12 * (1 + step / 100));
        work += expected.work;
        all_work += std::fabs(expected.work);
        spent += now.dissipated;
        slips += is_contact ? 0 : std::fabs(std::log(naive.deq / deq_before));
        ASSERT_NEAR((double) work, (double) (now.stored + spent), 1e-10 * (double) all_work);

        const double deq = kernel.deq();    // as after a restart
        const Found again = kernel.move_to(d, limit);
        ASSERT_TRUE(again.dissipated == 0.0 && kernel.deq() == deq);
        ASSERT_NEAR(again.force, now.force, 1e-12 * begin);
        for (const int i : {0, 1}) {
          ASSERT_NEAR(kernel.sums.of(i, FlowSums::WORK), 0.5 * (double) spent,
                      1e-12 * (double) spent);
          ASSERT_NEAR(kernel.sums.of(i, FlowSums::SLIP), (double) slips, 1e-12 * (double) slips);
        }
        flowed += expected.dissipated > 0;
        far += size > 0.1 && expected.dissipated > 0;
        parted += is_contact && d > naive.deq;
      }
      EXPECT_GT(flowed, is_contact ? 50 : 400);
      EXPECT_GT(far, is_contact ? 10 : 40);
      EXPECT_EQ(parted > 100, is_contact);
    }
}

TEST(Plasticity, IncrementsOfAnySizeOneWayDoTheSame)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const Row &row : ROWS)
    for (const double end : {-0.9, -0.13, 0.1, 3.0}) {
      SCOPED_TRACE(name_of(row));
      const PairLaw law(row);
      const PairState at_once = law.state(1.0 + end, {1.0, Flow::PLASTIC, 0.01, CUTOFF});
      EXPECT_EQ(at_once.regime, 2);
      for (const int steps : {2, 7, 300}) {
        double inv_deq = 1.0, dissipated = 0.0, strain = 0.0;
        for (int step = 1; step <= steps; step++) {
          strain = step == steps ? end
                                 : std::min(1.0, strain / end + 2.0 * unit(random) / steps) * end;
          const PairState now =
              law.state((1.0 + strain) * inv_deq, {inv_deq, Flow::PLASTIC, 0.01, CUTOFF});
          inv_deq = now.inv_deq;
          dissipated += now.dissipated;
        }
        EXPECT_NEAR(inv_deq, at_once.inv_deq, 1e-13 * inv_deq);
        EXPECT_NEAR(dissipated, at_once.dissipated, 1e-12 * dissipated);
      }
    }
}

// F d and the energy of a bond do not change as it flows.
TEST(Plasticity, ElasticCyclesLeaveNothingAndFlowKeepsForceTimesDistance)
{
  for (const Row &row : ROWS) {
    OnePair pair(row, false);
    for (int cycle = 0; cycle < 100; cycle++)
      for (const double d : {1.0 + 0.0099, 1.0 - 0.0099}) {
        EXPECT_EQ(pair.move_to(d, 0.01).dissipated, 0.0);
        EXPECT_EQ(pair.deq(), 1.0);
      }
    const Found first = pair.move_to(1.2, 0.01);
    for (const double d : {1.3, 2.0, 9.0}) {
      const Found now = pair.move_to(d, 0.01);
      EXPECT_NEAR(now.force * d, first.force * 1.2, 1e-12 * std::fabs(first.force));
      EXPECT_NEAR(now.stored, first.stored, 1e-12 * first.stored);
    }
  }
}

TEST(Limit, IsTheTableOfTheRowOrThatOfTheSecondRegime)
{
  Row row = TABLE2;
  const double h = (3.0 / 80.0) / (1.0 - 3.0 / 80.0);
  const Limit linear(row);
  EXPECT_EQ(linear(0.0), 0.005);
  EXPECT_NEAR(linear(0.1), 0.005 + h * 0.31 * 0.1, 1e-16);
  EXPECT_NEAR(linear(1e6), std::pow(2.0, 0.25) - 1.0, 1e-15);
  row.e2 = row.e1;
  EXPECT_THROW(Limit{row}, BadInput) << "flow would not end";
  row.flow = {3, {0.0, 0.1, 0.3}, {1.0, 2.0, 0.5}};
  const Limit table(row);
  for (const auto &[p, y] :
       {std::pair(0.0, 1.0), {0.05, 1.5}, {0.1, 2.0}, {0.2, 1.25}, {0.3, 0.5}, {7.0, 0.5}})
    EXPECT_NEAR(table(p), 0.005 * y, 1e-17) << p;
  row.flow = {1, {0.0}, {1.0}};
  EXPECT_EQ(Limit(row)(3.0), 0.005);
  row.xi_s = 0.19;
  EXPECT_THROW(Limit{row}, BadInput) << "beyond the strongest strain";
  EXPECT_EQ(Limit()(0.5), std::numeric_limits<double>::infinity());
}

TEST(Limit, TimesAFactorStaysAtTheStrongestStrain)
{
  const double strongest = std::pow(2.0, 0.25) - 1.0;
  Row row = TABLE2;
  EXPECT_EQ(Limit(row)(0.0, 0.5), 0.0025);
  EXPECT_EQ(Limit(row)(0.0, 2.0), 0.01);
  EXPECT_EQ(Limit(row)(1e6, 0.5), 0.5 * Limit(row)(1e6));
  EXPECT_DOUBLE_EQ(Limit(row)(1e6, 1.5), strongest);
  row.xi_s = 0.15;
  row.flow = {2, {0.0, 0.1}, {1.0, 1.2}};
  EXPECT_DOUBLE_EQ(Limit(row)(0.1, 1.2), strongest);
  EXPECT_EQ(Limit()(0.5, 0.1), std::numeric_limits<double>::infinity());
}
