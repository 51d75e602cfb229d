// SPDX-License-Identifier: GPL-2.0-only
//
// Sums of what pairs hold: their changes keep their digits, whatever the order of the pairs.

#include "core/stored_energy.h"
#include "kernel_cases.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

using EVP::Law;
using EVP::PackedPair;
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

/// What the pair style offers.
struct Packed {
  PairList list;
  std::vector<double> deq;
  const PairList &packed_pairs() const { return list; }
  const std::vector<double> &rest_distances() const { return deq; }
  const Law &law_of(const PackedPair &) const { return LAW; }
};

class Sums {
 public:
  StoredEnergy stored;

  StoredEnergy::Sums of(const std::vector<Pair> &pairs)
  {
    Packed packed;
    PairList &list = packed.list;
    for (int k = 0; k < builds; k++) list.clear();
    builds++;
    for (const Pair &pair : pairs) {
      kernel_cases::push_back(list.pairs, pair.deq, pair.cut, 0, 0, pair.is_bond);
      packed.deq.push_back(pair.deq);
    }
    EXPECT_TRUE(stored.is_due(list));
    stored.assign(packed);
    EXPECT_FALSE(stored.is_due(list));
    if (builds == 1) stored.set_largest_depth(stored.total_depth());
    StoredEnergy::Sums sums{};
    for (size_t n = 0; n < pairs.size(); n++)
      if (pairs[n].d() <= pairs[n].cut)
        stored.add(sums, n, list.pairs[n], LAW, pairs[n].d(), n % 2 ? 0.5 : 1.0);
    return sums;
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
