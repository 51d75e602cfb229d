// SPDX-License-Identifier: GPL-2.0-only
//
// What the tests of the kernel share: clouds of pairs, and the plain sum over them from the law alone.

#ifndef EVP_KERNEL_CASES_H
#define EVP_KERNEL_CASES_H

#include "core/force_loop.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

namespace kernel_cases {

// Both sides add the same terms in another order: a few ulp of the sum of |F|.
constexpr double ROUND_OFF = 1e-13;

using Vectors = std::vector<std::array<double, 3>>;

struct Cloud {
  Vectors x, v;
  EVP::PairList list;
  std::vector<EVP::Law> laws;

  EVP::ParticleView view(Vectors &f, int nreact) const
  {
    return {reinterpret_cast<const double(*)[3]>(x.data()),
            reinterpret_cast<const double(*)[3]>(v.data()),
            reinterpret_cast<double(*)[3]>(f.data()), nreact};
  }
};

/// deq, cut: [length]; the rest as in EVP::PackedPair.
inline void push_back(EVP::PackedPairs &pairs, double deq, double cut, int j, int law, bool is_bond)
{
  const EVP::PackedPairs::Room room = pairs.room(1);
  *room.inv_deq = 1.0 / deq;
  *room.cutsq = pairs.reach_squared(cut, is_bond);
  *room.j = j;
  *room.kind = 2 * law + is_bond;
  *room.slot = is_bond ? 0 : -1;
  pairs.add(1);
}

/// 50 points in a unit cube and the first npairs of their pairs. Each has a deq near its distance,
/// so that both regimes occur, and a tenth of the pairs is beyond the cut.
inline Cloud make_cloud(const std::vector<EVP::Row> &rows, int npairs)
{
  Cloud cloud;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const int n = 50;
  for (int i = 0; i < n; i++) {
    cloud.x.push_back({unit(random), unit(random), unit(random)});
    cloud.v.push_back({unit(random), unit(random), unit(random)});
  }
  for (const EVP::Row &row : rows) cloud.laws.emplace_back(row);
  for (int i = 0; i < n; i++) {
    const int first = (int) cloud.list.pairs.size();
    for (int j = i + 1; j < n && (int) cloud.list.pairs.size() < npairs; j++) {
      const EVP::PairGeometry g(reinterpret_cast<const double(*)[3]>(cloud.x.data()), i, j);
      const double d = std::sqrt(g.dsq), deq = d * (1.0 + 0.04 * (unit(random) - 0.5));
      const double cut = d * (0.9 + unit(random));
      push_back(cloud.list.pairs, deq, cut, j, (int) (j % rows.size()), j % 2 == 0);
    }
    const int last = (int) cloud.list.pairs.size();
    if (last > first) cloud.list.rows.push_back({i, first, last});
  }
  return cloud;
}

inline EVP::BlockLaw block_law(const Cloud &cloud, EVP::Level level = EVP::best_level())
{
  std::vector<int> used;
  for (size_t k = 0; k < cloud.laws.size(); k++) used.push_back((int) k);
  EVP::BlockLaw law;
  law.assign(cloud.laws, used, false, level);
  return law;
}

/// The forces by the kernel.
template <class Tally>
Vectors run_kernel(const Cloud &cloud, const EVP::BlockLaw &law, bool damping, int nreact,
                   Tally &&tally)
{
  Vectors f(cloud.x.size(), {0, 0, 0});
  if (damping)
    EVP::accumulate_forces<true>(cloud.list, law, cloud.view(f, nreact), tally);
  else
    EVP::accumulate_forces<false>(cloud.list, law, cloud.view(f, nreact), tally);
  return f;
}

/// Forces, energy and virial by a plain loop, and the sums of absolute terms to measure errors by.
struct PlainSum {
  Vectors f;
  std::vector<double> force_scale;
  double energy = 0.0, energy_scale = 0.0;
  double virial[6] = {}, virial_scale = 0.0;
  int interacting = 0, second = 0;
};

inline PlainSum plain_sum(const Cloud &cloud, bool damping, int nreact)
{
  const size_t n = cloud.x.size();
  PlainSum sum;
  sum.f.assign(n, {0, 0, 0});
  sum.force_scale.assign(n, 0.0);
  for (const EVP::PackedRow &row : cloud.list.rows)
    for (int k = row.first; k < row.last; k++) {
      const EVP::PackedPair pair = cloud.list.pairs[k];
      double u[3], dsq = 0.0, approach = 0.0;
      for (int c = 0; c < 3; c++) {
        u[c] = cloud.x[row.i][c] - cloud.x[pair.j][c];
        dsq += u[c] * u[c];
      }
      const double d = std::sqrt(dsq), cut = pair.cut;
      if (dsq > pair.cutsq) continue;
      for (int c = 0; c < 3; c++) {
        u[c] /= d;
        approach += u[c] * (cloud.v[row.i][c] - cloud.v[pair.j][c]);
      }
      const EVP::Law &law = cloud.laws[pair.law];
      const EVP::Row &r = law.parameters();
      double force = law.force(d, 1.0 / pair.inv_deq);
      if (damping) force -= r.gamma * approach;
      sum.interacting++;
      sum.second += law.regime(d, 1.0 / pair.inv_deq) == 2;

      // near deq a pair's own force is a difference that carries ulps of a larger one
      const double scale = std::fabs(force) + r.m1 * r.n1 * r.e1 * pair.inv_deq;
      sum.force_scale[row.i] += scale;
      sum.force_scale[pair.j] += scale;
      const double weight = pair.j < nreact ? 1.0 : 0.5;
      sum.energy += weight * law.energy(d, 1.0 / pair.inv_deq, cut);
      sum.energy_scale += r.m1 * r.e1;
      sum.virial_scale += scale * d;
      const int a[6] = {0, 1, 2, 0, 0, 1}, b[6] = {0, 1, 2, 1, 2, 2};
      for (int c = 0; c < 6; c++) sum.virial[c] += weight * force * d * u[a[c]] * u[b[c]];
      for (int c = 0; c < 3; c++) {
        sum.f[row.i][c] += force * u[c];
        if (pair.j < nreact) sum.f[pair.j][c] -= force * u[c];
      }
    }
  return sum;
}

inline void expect_forces(const Vectors &f, const PlainSum &sum)
{
  for (size_t i = 0; i < f.size(); i++)
    for (int c = 0; c < 3; c++)
      EXPECT_NEAR(f[i][c], sum.f[i][c], ROUND_OFF * sum.force_scale[i]) << "particle " << i;
}

}    // namespace kernel_cases

#endif
