// SPDX-License-Identifier: GPL-2.0-only
// The loop over packed pairs against a plain sum over pairs written from the law alone.

#include "evp_kernel.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

using namespace EVP;

namespace {

// Both sides add the same terms in another order: a few ulp of the sum of |F|.
constexpr double ROUND_OFF = 1e-13;

using Vectors = std::vector<std::array<double, 3>>;

const Row TABLE2 = {80, 8, 4, 3, 8, 4, 0.005, 1000, 1.5};
const Row OTHER = {40, 6, 3, 5, 4, 2, 0.01, 300, 1.5};

struct Cloud {
  Vectors x, v;
  PackedList list;
  std::vector<Law> laws;
};

/// 40 points in a unit cube, each pair packed with a deq near its distance, so both regimes occur.
Cloud make_cloud(const std::vector<Row> &rows)
{
  Cloud cloud;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const int n = 40;
  for (int i = 0; i < n; i++) {
    cloud.x.push_back({unit(random), unit(random), unit(random)});
    cloud.v.push_back({unit(random), unit(random), unit(random)});
  }
  for (const Row &row : rows) cloud.laws.emplace_back(row);
  for (int i = 0; i < n; i++) {
    const int first = (int) cloud.list.pairs.size();
    for (int j = i + 1; j < n; j++) {
      const PairGeometry g(reinterpret_cast<const double(*)[3]>(cloud.x.data()), i, j);
      const double deq = std::sqrt(g.dsq) * (1.0 + 0.02 * (unit(random) - 0.5));
      const double cut = j % 5 ? 0.6 : 2.0;
      cloud.list.pairs.push_back({1.0 / deq, cut * cut, j, (int) (j % rows.size()), j % 2 == 0});
    }
    cloud.list.rows.push_back({i, first, (int) cloud.list.pairs.size()});
  }
  return cloud;
}

template <bool Damping, class Tally>
Vectors run_kernel(const Cloud &cloud, int nreact, Tally &&tally)
{
  Vectors f(cloud.x.size(), {0, 0, 0});
  const ParticleView view = {reinterpret_cast<const double(*)[3]>(cloud.x.data()),
                             reinterpret_cast<const double(*)[3]>(cloud.v.data()),
                             reinterpret_cast<double(*)[3]>(f.data()), nreact};
  with_common_powers(cloud.laws, [&](const auto &powers) {
    accumulate_forces<Damping>(cloud.list, cloud.laws.data(), view, powers, tally);
  });
  return f;
}

void expect_plain_sum(const Cloud &cloud, const Vectors &f, bool damping, int nreact)
{
  const size_t n = cloud.x.size();
  Vectors expected(n, {0, 0, 0});
  std::vector<double> scale(n, 0.0);
  for (const PackedRow &row : cloud.list.rows)
    for (int k = row.first; k < row.last; k++) {
      const PackedPair &pair = cloud.list.pairs[k];
      double u[3], dsq = 0.0, approach = 0.0;
      for (int c = 0; c < 3; c++) {
        u[c] = cloud.x[row.i][c] - cloud.x[pair.j][c];
        dsq += u[c] * u[c];
      }
      const double d = std::sqrt(dsq);
      if (d > std::sqrt(pair.cutsq)) continue;
      for (int c = 0; c < 3; c++) {
        u[c] /= d;
        approach += u[c] * (cloud.v[row.i][c] - cloud.v[pair.j][c]);
      }
      const Law &law = cloud.laws[pair.law];
      double force = law.force(d, 1.0 / pair.inv_deq);
      if (damping) force -= law.parameters().gamma * approach;
      scale[row.i] += std::fabs(force);
      scale[pair.j] += std::fabs(force);
      for (int c = 0; c < 3; c++) {
        expected[row.i][c] += force * u[c];
        if (pair.j < nreact) expected[pair.j][c] -= force * u[c];
      }
    }
  for (size_t i = 0; i < n; i++)
    for (int c = 0; c < 3; c++)
      // near deq a pair's own force is a difference that carries ulps of the yield force
      EXPECT_NEAR(f[i][c], expected[i][c], ROUND_OFF * (scale[i] + 40 * 1e3));
}

}    // namespace

TEST(Kernel, EqualsThePlainSumWithoutDamping)
{
  const Cloud cloud = make_cloud({TABLE2});
  const int n = (int) cloud.x.size();
  expect_plain_sum(cloud, run_kernel<false>(cloud, n, NoTally()), false, n);
}

TEST(Kernel, EqualsThePlainSumWithDamping)
{
  const Cloud cloud = make_cloud({TABLE2});
  const int n = (int) cloud.x.size();
  expect_plain_sum(cloud, run_kernel<true>(cloud, n, NoTally()), true, n);
}

// Types or regimes with exponents of their own take the other path through the powers.
TEST(Kernel, EqualsThePlainSumForMixedExponents)
{
  const Cloud cloud = make_cloud({TABLE2, OTHER});
  const int n = (int) cloud.x.size();
  expect_plain_sum(cloud, run_kernel<true>(cloud, n, NoTally()), true, n);
}

// newton off: ghosts, here the last ten particles, take no reaction.
TEST(Kernel, LeavesGhostsAloneWithNewtonOff)
{
  const Cloud cloud = make_cloud({TABLE2});
  const int nreact = (int) cloud.x.size() - 10;
  expect_plain_sum(cloud, run_kernel<true>(cloud, nreact, NoTally()), true, nreact);
}

namespace {
struct CountingTally {
  static constexpr bool active = true;
  int *calls;
  void operator()(int, const PackedPair &pair, const PairGeometry &g, double) const
  {
    EXPECT_LE(g.dsq, pair.cutsq);
    (*calls)++;
  }
};
}    // namespace

// Steps with energy and steps without must move the particles alike: the same forces to the last bit.
TEST(Kernel, TallyChangesNoForceAndSeesInteractingPairsOnly)
{
  const Cloud cloud = make_cloud({TABLE2});
  const int n = (int) cloud.x.size();
  int calls = 0;
  const Vectors quiet = run_kernel<true>(cloud, n, NoTally());
  const Vectors tallied = run_kernel<true>(cloud, n, CountingTally{&calls});
  for (int i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) EXPECT_EQ(quiet[i][c], tallied[i][c]);

  int interacting = 0;
  for (const PackedRow &row : cloud.list.rows)
    for (int k = row.first; k < row.last; k++) {
      const PairGeometry g(reinterpret_cast<const double(*)[3]>(cloud.x.data()), row.i,
                           cloud.list.pairs[k].j);
      interacting += g.dsq <= cloud.list.pairs[k].cutsq;
    }
  EXPECT_EQ(calls, interacting);
  EXPECT_LT(interacting, (int) cloud.list.pairs.size());    // control: some pairs are beyond
}

// eq. 4 by hand: 1 m apart along x, closing at 2 m/s: the damper pushes i away from j.
TEST(Kernel, DampingOpposesApproach)
{
  const double x[2][3] = {{1, 0, 0}, {0, 0, 0}};
  const double vi[3] = {-2, 5, 0}, vj[3] = {0, 0, 0};
  const PairGeometry g(x, 0, 1);
  EXPECT_DOUBLE_EQ(damping_over_distance(1000, g, vi, vj) * g.dx, 2000);
}
