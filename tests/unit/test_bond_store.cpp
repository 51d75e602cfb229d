// SPDX-License-Identifier: GPL-2.0-only
//
// The records of the bonds: what travels with an atom, and when readers must look again.

#include "core/bond_store.h"

#include <gtest/gtest.h>

namespace {

using EVP::Bond;
using EVP::BondStore;

/// Three atoms of the IDs 7, 5, 9, each bonded to both others.
BondStore recorded(int nvalues)
{
  BondStore store(nvalues);
  store.grow(4);
  std::vector<BondStore::Bonds> made = {
      {{9, 1.25}, {5, 1.5}}, {{7, 1.5}, {9, 1.75}}, {{7, 1.25}, {5, 1.75}}};
  const int ids[] = {7, 5, 9};
  store.record(made, ids, 3, 9);
  return store;
}

void expect_same(const BondStore::Bonds &a, const BondStore::Bonds &b)
{
  ASSERT_EQ(a.size(), b.size());
  for (size_t k = 0; k < a.size(); k++) {
    EXPECT_EQ(a[k].partner, b[k].partner);
    EXPECT_EQ(a[k].deq, b[k].deq);
  }
}

TEST(BondStore, KeepsRecordsInTheOrderOfThePartners)
{
  const BondStore store = recorded(0);
  EXPECT_TRUE(store.has_recorded());
  EXPECT_EQ(store.count(), 3);
  EXPECT_EQ(store.highest_id(), 9);
  EXPECT_EQ(store.most(), 2);
  expect_same(store.of(0), {{5, 1.5}, {9, 1.25}});
  EXPECT_EQ(store.find(0, 9)->deq, 1.25);
  EXPECT_EQ(store.find(2, 7)->deq, store.find(0, 9)->deq);
  for (const int stranger : {4, 6, 7, 10}) EXPECT_EQ(store.find(0, stranger), nullptr);
}

// An atom that leaves an MPI rank and comes to another brings bonds and values to the last bit.
TEST(BondStore, WordsBringRecordsAndValuesToAnotherPlace)
{
  for (const int nvalues : {0, 1, 3}) {
    BondStore store = recorded(nvalues);
    for (int k = 0; k < 2 * nvalues; k++) store.values_of(2)[k] = 0.1 + k;
    std::vector<double> words(store.words(2));
    ASSERT_EQ(store.pack(2, words.data()), (int) words.size());

    BondStore other(nvalues);
    other.grow(2);
    ASSERT_EQ(other.unpack(1, words.data()), (int) words.size());
    EXPECT_EQ(other.recorded_id(1), 9);
    EXPECT_EQ(other.recorded_id(0), 0);
    expect_same(other.of(1), store.of(2));
    for (int k = 0; k < 2 * nvalues; k++) EXPECT_EQ(other.values_of(1)[k], 0.1 + k);

    other.copy(1, 0);
    other.clear(1);
    expect_same(other.of(0), store.of(2));
    EXPECT_TRUE(other.of(1).empty());
    for (int k = 0; k < 2 * nvalues; k++) EXPECT_EQ(other.values_of(0)[k], 0.1 + k);
  }
}

TEST(BondStore, ValuesCostNothingWhereBondsHaveNone)
{
  EXPECT_EQ(recorded(0).words(2), 2 + 2 * 2u);
  EXPECT_EQ(recorded(2).words(2), 2 + 4 * 2u);
  EXPECT_LT(recorded(0).memory_usage(), recorded(1).memory_usage());
}

// Restart files of early versions hold the records of an atom in another order.
TEST(BondStore, WordsInAnyOrderAreSorted)
{
  const BondStore store = recorded(0);
  std::vector<double> words(store.words(2));
  store.pack(0, words.data());
  std::swap_ranges(words.begin() + 2, words.begin() + 4, words.begin() + 4);
  BondStore other;
  other.grow(1);
  other.unpack(0, words.data());
  expect_same(other.of(0), store.of(0));
}

TEST(BondStore, EveryOtherStateHasAVersionOfItsOwn)
{
  BondStore store = recorded(0), another = recorded(0);
  const long version = store.version();
  EXPECT_NE(version, another.version());
  store.copy(0, 1);    // atoms that come and go
  EXPECT_EQ(store.version(), version);
  store.close();
  EXPECT_NE(store.version(), version);
  EXPECT_TRUE(store.is_closed());
  EXPECT_FALSE(store.has_recorded());
}

TEST(BondStore, FindsAtomsUnderTheIDsOfOthers)
{
  const BondStore store = recorded(0);
  const int same[] = {7, 5, 9, 12}, renumbered[] = {7, 6, 9, 12}, newcomer[] = {7, 5, 9, 8};
  EXPECT_FALSE(store.find_misplaced(same, 4));
  EXPECT_EQ(store.find_misplaced(renumbered, 4).renumbered, 6);
  EXPECT_EQ(store.find_misplaced(newcomer, 4).newcomer, 8);
  EXPECT_FALSE(BondStore().find_misplaced(newcomer, 4));
}

}    // namespace
