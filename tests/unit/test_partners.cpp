// SPDX-License-Identifier: GPL-2.0-only
//
// Looking up the records of an atom: always those of a plain search, whatever was asked before.

#include "evp_partners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace {

struct Bond {
  int partner;
  double deq;
};
using Bonds = std::vector<Bond>;

double deq_of(int partner)
{
  return 1.0 + 1e-3 * partner;
}

Bonds bonds_with(const std::vector<int> &partners)
{
  Bonds bonds;
  for (const int partner : partners) bonds.push_back({partner, deq_of(partner)});
  return bonds;
}

TEST(Partners, NothingIsFoundWithoutRecords)
{
  Bonds none;
  EVP::Partners<Bond> partners(none);
  for (const int partner : {0, 1, 7}) EXPECT_EQ(partners.find(partner), nullptr);
}

TEST(Partners, RandomRowsFindWhatAPlainSearchFinds)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; trial++) {
    const int nrecords = (int) (random() % 40) * (trial % 7 == 0 ? 20 : 1);
    std::vector<int> ids(2 * nrecords + 10);
    const int first = trial % 3 ? 1 : 2147483000 - (int) ids.size();
    for (size_t k = 0; k < ids.size(); k++) ids[k] = first + (int) k;
    std::shuffle(ids.begin(), ids.end(), random);
    const std::vector<int> recorded(ids.begin(), ids.begin() + nrecords);
    Bonds bonds = bonds_with(recorded);

    for (int build = 0; build < 3; build++) {
      std::shuffle(ids.begin(), ids.end(), random);
      EVP::Partners<Bond> partners(bonds);
      std::map<const Bond *, int> given;
      for (const int id : ids) {
        const bool is_bond = std::count(recorded.begin(), recorded.end(), id) > 0;
        const Bond *const found = partners.find(id);
        ASSERT_EQ(found != nullptr, is_bond) << "trial " << trial << ", partner " << id;
        if (found) given[found] = id;
      }
      // found records stay in place: the pointers still show what they were given for
      for (const auto &each : given) {
        ASSERT_EQ(each.first->partner, each.second);
        ASSERT_EQ(each.first->deq, deq_of(each.second));
      }
      ASSERT_EQ((int) given.size(), nrecords);
    }
  }
}

TEST(Partners, ImagesOfOnePartnerShareItsRecord)
{
  Bonds bonds = bonds_with({3, 1, 2});
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
  Bonds bonds = bonds_with({1, 2, 3, 4, 5});
  EVP::Partners<Bond> partners(bonds);
  for (const int partner : {4, 9, 2, 5}) partners.find(partner);
  EXPECT_EQ(bonds[0].partner, 4);
  EXPECT_EQ(bonds[1].partner, 2);
  EXPECT_EQ(bonds[2].partner, 5);
}

}    // namespace
