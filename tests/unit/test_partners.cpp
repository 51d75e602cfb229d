// SPDX-License-Identifier: GPL-2.0-only
//
// Looking up the records of an atom: always those of a plain search, whatever was asked before.

#include "core/partners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>

namespace {

/// LAMMPS' IDs have 32 or 64 bits.
template <class ID> struct BondOf {
  ID partner;
  double deq;
};
using Bond = BondOf<int>;
using Bonds = std::vector<Bond>;

double deq_of(double partner)
{
  return 1.0 + 1e-3 * partner;
}

template <class ID> std::vector<BondOf<ID>> bonds_with(const std::vector<ID> &partners)
{
  std::vector<BondOf<ID>> bonds;
  for (const ID partner : partners) bonds.push_back({partner, deq_of((double) partner)});
  return bonds;
}

TEST(Partners, NothingIsFoundWithoutRecords)
{
  Bonds none;
  EVP::Partners<Bond> partners(none);
  for (const int partner : {0, 1, 7}) EXPECT_EQ(partners.find(partner), nullptr);
}

template <class ID> class RandomRows : public testing::Test {
};
using IDs = testing::Types<int, int64_t>;
TYPED_TEST_SUITE(RandomRows, IDs);

TYPED_TEST(RandomRows, FindWhatAPlainSearchFinds)
{
  using ID = TypeParam;
  using OwnBond = BondOf<ID>;
  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; trial++) {
    const int nrecords = (int) (random() % 40) * (trial % 7 == 0 ? 20 : 1);
    std::vector<ID> ids(2 * nrecords + 10);
    const ID first = trial % 3 ? 1 : std::numeric_limits<ID>::max() / 2 - (ID) ids.size();
    for (size_t k = 0; k < ids.size(); k++) ids[k] = first + (ID) k;
    std::shuffle(ids.begin(), ids.end(), random);
    const std::vector<ID> recorded(ids.begin(), ids.begin() + nrecords);
    const std::set<ID> plain(recorded.begin(), recorded.end());
    auto bonds = bonds_with(recorded);

    for (int build = 0; build < 3; build++) {
      std::shuffle(ids.begin(), ids.end(), random);
      EVP::Partners<OwnBond> partners(bonds);
      std::map<const OwnBond *, ID> given;
      for (const ID id : ids) {
        const OwnBond *const found = partners.find(id);
        ASSERT_EQ(found != nullptr, plain.count(id) > 0) << "trial " << trial << ", partner " << id;
        if (found) given[found] = id;
      }
      // found records stay in place: the pointers still show what they were given for
      for (const auto &each : given) {
        ASSERT_EQ(each.first->partner, each.second);
        ASSERT_EQ(each.first->deq, deq_of((double) each.second));
      }
      ASSERT_EQ((int) given.size(), nrecords);
    }
  }
}

TEST(Partners, ImagesOfOnePartnerShareItsRecord)
{
  Bonds bonds = bonds_with<int>({3, 1, 2});
  EVP::Partners<Bond> partners(bonds);
  const Bond *const first = partners.find(2);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(partners.find(3)->partner, 3);
  EXPECT_EQ(partners.find(2), first);
  EXPECT_EQ(partners.find(1)->partner, 1);
  EXPECT_EQ(partners.find(2), first);
}

TEST(Partners, RecordsTakeTheOrderInWhichTheyAreFound)
{
  Bonds bonds = bonds_with<int>({1, 2, 3, 4, 5});
  EVP::Partners<Bond> partners(bonds);
  for (const int partner : {4, 9, 2, 5}) partners.find(partner);
  EXPECT_EQ(bonds[0].partner, 4);
  EXPECT_EQ(bonds[1].partner, 2);
  EXPECT_EQ(bonds[2].partner, 5);
}

}    // namespace
