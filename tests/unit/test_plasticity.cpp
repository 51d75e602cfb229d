// SPDX-License-Identifier: GPL-2.0-only
//
// Plasticity of one pair against a map of its own, written as model and manual state it: long double, iteration and
// quadrature. deq is 1.

#include "pair_cases.h"

#include <algorithm>
#include <cmath>

using namespace EVP;
using namespace pair_cases;
using Exact = long double;

namespace {

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
  Exact q = 0, k = 0, work = 0;    // work: dissipated so far

  Exact energy(Exact strain) const
  {
    const Exact m = row.m1, n = row.n1;
    return row.e1 * (1 + (n * std::pow(1 + strain, -m) - m * std::pow(1 + strain, -n)) / (m - n));
  }
  Exact force(Exact strain) const
  {
    const Exact m = row.m1, n = row.n1;
    return row.e1 * m * n / (m - n) * (std::pow(1 + strain, -m - 1) - std::pow(1 + strain, -n - 1));
  }
  Exact limit(Exact sum) const
  {
    const Exact ratio = (Exact) row.m2 * row.n2 * row.e2 / (row.m1 * row.n1 * row.e1);
    const Exact saturated = row.saturation * (1 - std::exp(-sum / row.saturation));
    return row.xi_s + ratio / (1 - ratio) * (row.saturation > 0.0 ? saturated : sum);
  }
  Exact slip(Exact d) const
  {
    const Exact size = is_contact ? 1 + q - d : std::fabs(d - 1 - q);
    Exact delta = 0;
    for (int it = 0; it < 200 && size > limit(k); it++) delta = size - limit(k + delta);
    return delta;
  }

  // as if d were reached in one go
  Exact elastic(Exact d) const
  {
    const Exact strain = d - 1 - q - std::copysign(slip(d), d - 1 - q);
    return is_contact && strain > 0 ? 0 : strain;
  }
  Exact force_at(Exact d) const { return force(elastic(d)); }
  Exact stored_at(Exact d) const { return energy(elastic(d)); }
  Exact dissipated_to(Exact d) const
  {
    const Exact sign = std::copysign((Exact) 1, d - 1 - q);
    const auto at_limit = [&](Exact sum) {
      return std::fabs(force(sign * limit(sum)));
    };
    return integral(at_limit, k, k + slip(d));
  }

  /// The work from d0 to d1, by parts between the bends of the force.
  Exact work_done(Exact d0, Exact d1) const
  {
    std::vector<Exact> ends = {d0, d1};
    for (const Exact bend : {1 + q - limit(k), 1 + q, 1 + q + limit(k)})
      if ((bend - d0) * (bend - d1) < 0) ends.push_back(bend);
    std::sort(ends.begin(), ends.end());
    Exact sum = 0;
    const auto pull = [this](Exact d) {
      return -force_at(d);
    };
    for (size_t part = 1; part < ends.size(); part++)
      sum += integral(pull, ends[part - 1], ends[part]);
    return d1 > d0 ? sum : -sum;
  }

  void move_to(Exact d, Exact dissipated)
  {
    const Exact by = slip(d);
    work += dissipated;
    q += std::copysign(by, d - 1 - q);
    k += by;
    if (is_contact && d > 1) q = k = work = 0;    // parted
  }
};

struct Found {
  double force, stored, dissipated, q, k;
};

/// One pair in the time-step loop.
class OnePair {
 public:
  PairList list;

  OnePair(const Row &row, bool is_contact) : list(!is_contact)
  {
    list.clear(0.0, is_contact ? Flow::COMPRESSES : Flow::STAYS);
    add_row(list, 0, {{1, 1.0, is_contact ? 1.0 : 1.5}});
    law.assign({PairLaw(row)}, {0}, list.flow());
  }
  Found move_to(double d)
  {
    const double x[2][3] = {{d, 0, 0}, {0, 0, 0}};
    double f[2][3] = {};
    Tally tally;
    accumulate_forces<false>(list, law, {x, x, f, 2}, tally);
    list.commit();
    tally.found.q = list.q[0];
    tally.found.k = list.k[0];
    return tally.found;
  }

 private:
  BlockLaw law;
  struct Tally {
    static constexpr bool stored = true, potential = true;
    Found found = {};
    void operator()(const PairRange &, const PairBlock &block)
    {
      found.force = block.force[0] * std::sqrt(block.distance_squared(0));
      found.stored = block.potential[0];
      found.dissipated = *block.flow.any_flow ? block.flow.dissipated[0] : 0.0;
    }
  };
};

Row softer_by(double factor, Row row)
{
  row.e2 *= factor;
  return row;
}

// linear ones harden little, so that flow goes on
const std::vector<Row> ROWS = {
    softer_by(0.1, with_exponents(8, 4, 8, 4)),
    softer_by(0.1, with_exponents(7.5, 3.2, 7.5, 3.2)),
    softer_by(0.0, with_exponents(6, 3, 6, 3)),
    with_exponents(12, 6, 12, 6, 0.1),
    with_exponents(9, 5, 2, 1, 0.1),
};

}    // namespace

// to and fro between -12 % and 12 %, up to three increments each way
TEST(Plasticity, TwoThousandReversalsFollowTheNaiveMap)
{
  for (const Row &row : ROWS)
    for (const bool is_contact : {false, true}) {
      SCOPED_TRACE(name_of(row) + (is_contact ? "contact" : "bond"));
      std::mt19937 random(5);
      std::uniform_real_distribution<double> unit(0.0, 1.0);
      NaiveMap naive{row, is_contact};
      OnePair kernel(row, is_contact);
      const double begin = row.m1 * row.n1 * row.e1;
      Exact work = 0, spent = 0, all_work = 0;
      int flowed = 0, parted = 0;
      double d = 1.0;
      for (int reversal = 0; reversal < 2000; reversal++) {
        const double target = 1.0 + (reversal % 2 ? -0.12 : 0.12) * unit(random);
        const int steps = 1 + (int) (3 * unit(random));
        for (int step = 1; step <= steps; step++) {
          const double to = step == steps ? target : d + (target - d) * unit(random);
          const Exact step_work = reversal < 200 ? naive.work_done(d, to) : 0;
          const Exact force = naive.force_at(to), stored = naive.stored_at(to);
          const Exact dissipated = naive.dissipated_to(to);
          naive.move_to(d = to, dissipated);
          const bool is_apart = is_contact && d > 1.0;
          const Found now = kernel.move_to(d);
          ASSERT_NEAR(now.force, (double) force, 1e-12 * begin);
          ASSERT_NEAR(now.stored, (double) stored, 1e-12 * row.e1);
          ASSERT_NEAR(now.dissipated, (double) dissipated, 1e-12 * row.e1);
          ASSERT_GE(now.dissipated, 0.0);
          ASSERT_NEAR(now.q, (double) naive.q, 1e-12);
          ASSERT_NEAR(now.k, (double) naive.k, 1e-12 * (1.0 + now.k));
          if (is_contact) { ASSERT_TRUE(now.force >= -EPSILON * begin && now.q <= 0.0); }
          if (is_apart) { ASSERT_TRUE(now.stored == 0.0 && now.q == 0.0 && now.k == 0.0); }
          spent += now.dissipated;
          const Found again = kernel.move_to(d);    // as after a restart
          ASSERT_TRUE(again.dissipated == 0.0);
          const double own = kernel.list.work[0];
          ASSERT_NEAR(own, (double) naive.work, 1e-12 * (row.e1 + own));
          work += step_work;
          all_work += std::fabs(step_work);
          if (reversal < 200) {
            ASSERT_NEAR((double) work, (double) (stored + spent), 1e-10 * (double) all_work);
          }
          flowed += dissipated > 0;
          parted += is_apart;
        }
      }
      EXPECT_GT(flowed, 400);
      EXPECT_EQ(parted > 900, is_contact);
    }
}

TEST(Plasticity, OneWayIncrementsOfAnySizeDoTheSame)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Row> rows = ROWS;
  for (const double saturation : {0.03, 0.004, 1e-5})
    rows.push_back(with_exponents(8, 4, 8, 4, saturation));
  rows.push_back(with_exponents(60, 30, 60, 30));
  rows.back().e2 = 0.5 * rows.back().e1;    // hardens much
  for (const Row &row : rows)
    for (const double end : {-0.3, -0.13, 0.1}) {
      SCOPED_TRACE(name_of(row));
      const PairLaw law(row);
      const PairState at_once = law.state(1.0 + end, {1.0, Flow::STAYS});
      for (const int steps : {2, 7, 300}) {
        Offset offset;
        double dissipated = 0.0, strain = 0.0;
        for (int step = 1; step <= steps; step++) {
          strain = step == steps ? end
                                 : std::min(1.0, strain / end + 2.0 * unit(random) / steps) * end;
          const PairState now = law.state(1.0 + strain, {1.0, Flow::STAYS, offset});
          offset = now.offset;
          dissipated += now.dissipated;
        }
        EXPECT_NEAR(offset.q, at_once.offset.q, 1e-13);
        EXPECT_NEAR(offset.k, at_once.offset.k, 1e-13);
        EXPECT_NEAR(dissipated, at_once.dissipated, 1e-11 * dissipated);
      }
    }
}
