// SPDX-License-Identifier: GPL-2.0-only
//
// Sums of what pairs hold: their changes keep their digits, whatever the order of the pairs.

#include "core/work_tally.h"
#include "kernel_cases.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

using EVP::Law;
using EVP::PairList;
using EVP::StoredEnergy;

namespace {

constexpr double EPSILON = std::numeric_limits<double>::epsilon();
const Law LAW({80, 8, 4, 3, 8, 4, 0.005, 0, 1.5});

struct Pair {
  double deq, cut, strain;
  bool is_bond;
  double d() const { return deq * (1.0 + strain); }
  double depth() const { return LAW.stored(cut, deq).total(); }
};

/// Bonds and new pairs, strained by at most `largest`.
std::vector<Pair> pairs_of(int n, double largest)
{
  std::mt19937_64 random(20170515);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<Pair> pairs;
  for (int k = 0; k < n; k++)
    pairs.push_back({0.008 + 0.004 * share(random), 0.015 + 0.001 * share(random),
                     largest * (2.0 * share(random) - 1.0), share(random) < 0.7});
  return pairs;
}

/// The sums over pairs in the order given; every other one has a partner that takes no reaction.
class Sums {
 public:
  EVP::PairWork work;

  StoredEnergy::Sums of(const std::vector<Pair> &pairs)
  {
    const int n = (int) pairs.size();
    kernel_cases::Cloud cloud;
    PairList &list = cloud.list;
    for (int k = 0; k < builds; k++) list.clear();
    builds++;
    cloud.laws.push_back(LAW);
    // pair k is k and 2n + k, or without a reaction 3n + k
    cloud.x.assign(4 * n, {0.0, 0.0, 0.0});
    std::vector<double> deq;
    for (int k = 0; k < n; k++) {
      const int j = (k % 2 ? 3 : 2) * n + k;
      kernel_cases::push_back(list.pairs, pairs[k].deq, pairs[k].cut, j, 0, pairs[k].is_bond);
      list.rows.push_back({k, k, k + 1});
      cloud.x[k][0] = pairs[k].d();
      deq.push_back(pairs[k].deq);
    }
    list.nall = 4 * n;
    kernel_cases::Vectors f(4 * n);
    const EVP::ParticleView view = cloud.view(f, 3 * n);
    EXPECT_TRUE(work.stored.is_due(list, false));
    work.accumulate_forces<false>(list, kernel_cases::block_law(cloud), view, EVP::NoTally(), [&] {
      return deq;
    });
    EXPECT_FALSE(work.stored.is_due(list, false));
    EXPECT_TRUE(work.take());
    if (builds == 1) work.stored.set_largest_depth(work.stored.total_depth());
    return work.stored.sums();
  }

 private:
  int builds = 0;
};

}    // namespace

TEST(StoredEnergy, NothingIsLostWhereNoBondIsInAnyOrder)
{
  std::vector<Pair> pairs = pairs_of(2000, 1e-9);
  Sums sums;
  const StoredEnergy::Sums start = sums.of(pairs);
  double plain = 0.0, again = 0.0;    // control: the same sum without care
  for (size_t n = 0; n < pairs.size(); n++) plain += (n % 2 ? 0.5 : 1.0) * pairs[n].depth();
  // pairs keep their weights: both kinds are shuffled among themselves
  std::mt19937_64 random(7);
  for (int round = 0; round < 5; round++) {
    for (size_t k = pairs.size() - 1; k > 1; k--)
      std::swap(pairs[k], pairs[k - 2 * (random() % (k / 2 + 1))]);
    const StoredEnergy::Sums now = sums.of(pairs);
    EXPECT_LT(std::fabs(StoredEnergy::lost(start, now)), 1e-23 * plain);
    EXPECT_NEAR(StoredEnergy::of_contacts(start, now), 0.0, 1e-14 * start.contacts + 1e-23 * plain);
    again = 0.0;
    for (size_t n = 0; n < pairs.size(); n++) again += (n % 2 ? 0.5 : 1.0) * pairs[n].depth();
  }
  EXPECT_NE(plain, again);
  EXPECT_GT(start.first, 0.0);
  EXPECT_LT(start.first, 1e-14 * plain);
}

TEST(StoredEnergy, AnEntryChangesByWhatItsPairDoes)
{
  std::vector<Pair> pairs = pairs_of(1001, 1e-8);
  Sums sums;
  const StoredEnergy::Sums start = sums.of(pairs);
  const auto bond = (size_t) (std::find_if(pairs.begin(), pairs.end(),
                                           [](const Pair &pair) {
                                             return pair.is_bond;
                                           }) -
                              pairs.begin());
  const auto contact = (size_t) (std::find_if(pairs.begin(), pairs.end(),
                                              [](const Pair &pair) {
                                                return !pair.is_bond;
                                              }) -
                                 pairs.begin());
  const double weight[] = {bond % 2 ? 0.5 : 1.0, contact % 2 ? 0.5 : 1.0};

  // a bond is pulled beyond its cut-off
  const double before = pairs[bond].strain;
  pairs[bond].strain = 1.0;
  StoredEnergy::Sums now = sums.of(pairs);
  EXPECT_NEAR(StoredEnergy::lost(start, now), weight[0] * pairs[bond].depth(),
              4 * EPSILON * pairs[bond].depth());
  pairs[bond].strain = before;

  // a contact moves by 1e-7 of its deq: 1e-14 of the depths
  const double held = LAW.stored(pairs[contact].d(), pairs[contact].deq).total();
  pairs[contact].strain += 1e-7;
  now = sums.of(pairs);
  const double change =
      weight[1] * (LAW.stored(pairs[contact].d(), pairs[contact].deq).total() - held);
  EXPECT_NEAR(StoredEnergy::of_contacts(start, now), change, 1e-9 * change);
  EXPECT_LT(change, 1e-12 * start.contacts_depth.rounded);
  EXPECT_LT(std::fabs(StoredEnergy::lost(start, now)), 1e-20);
}

// The list keeps 1/deq, from which deq does not come back to its last bit for all pairs.
TEST(StoredEnergy, CountsFromTheRecordedDistance)
{
  std::vector<Pair> pairs = pairs_of(1000, 0.0);
  for (Pair &pair : pairs) {
    pair.deq *= 1.25;
    pair.cut *= 1.25;
  }
  const auto off = std::count_if(pairs.begin(), pairs.end(), [](const Pair &pair) {
    return 1.0 / (1.0 / pair.deq) != pair.deq;
  });
  EXPECT_GT(off, 50);
  Sums sums;
  const StoredEnergy::Sums found = sums.of(pairs);
  EXPECT_EQ(found.first, 0.0);
  EXPECT_EQ(found.second, 0.0);
  EXPECT_EQ(found.contacts, 0.0);
}

TEST(StoredEnergy, WithoutAnyPairAtTheStartSumsArePlain)
{
  Sums sums;
  const StoredEnergy::Sums start = sums.of({});
  const std::vector<Pair> pairs = pairs_of(10, 0.01);
  const StoredEnergy::Sums now = sums.of(pairs);
  double contacts = 0.0;
  for (size_t n = 0; n < pairs.size(); n++)
    if (!pairs[n].is_bond)
      contacts += (n % 2 ? 0.5 : 1.0) * LAW.energy(pairs[n].d(), pairs[n].deq, pairs[n].cut);
  EXPECT_NEAR(StoredEnergy::of_contacts(start, now), contacts, 1e-13 * std::fabs(contacts));
}
