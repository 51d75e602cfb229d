// SPDX-License-Identifier: GPL-2.0-only
//
// The records of the bonds: what travels with an atom, and when readers must look again. A look-up
// finds what a plain search finds, whatever the hints say.

#include "core/bond_store.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>

namespace {

using EVP::Bond;
using EVP::BondStore;
using EVP::PairHistory;

/// Three atoms of the IDs 7, 5, 9, each bonded to both others.
BondStore recorded(bool with_history = false)
{
  BondStore store(with_history);
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
  const BondStore store = recorded();
  EXPECT_TRUE(store.has_recorded());
  EXPECT_EQ(store.count(), 3);
  EXPECT_EQ(store.highest_id(), 9);
  EXPECT_EQ(store.most_words(), 6);
  expect_same(store.of(0), {{5, 1.5}, {9, 1.25}});
  EXPECT_EQ(store.find(0, 9)->deq, 1.25);
  EXPECT_EQ(store.find(2, 7)->deq, store.find(0, 9)->deq);
  for (const int stranger : {4, 6, 7, 10}) EXPECT_EQ(store.find(0, stranger), nullptr);

  // atoms under the IDs of others
  const int same[] = {7, 5, 9, 12}, renumbered[] = {7, 6, 9, 12}, newcomer[] = {7, 5, 9, 8};
  EXPECT_FALSE(store.find_misplaced(same, 4));
  EXPECT_EQ(store.find_misplaced(renumbered, 4), 6);
  EXPECT_EQ(store.find_misplaced(newcomer, 4), 8);
  EXPECT_FALSE(BondStore().find_misplaced(newcomer, 4));
}

// An atom that leaves an MPI rank and comes to another brings bonds and history to the last bit.
TEST(BondStore, WordsBringRecordsAndHistoryToAnotherPlace)
{
  for (const bool with_history : {false, true}) {
    BondStore store = recorded(with_history);
    if (with_history) {
      store.take({2, true, 5, {0.1, 0.2, 0.3, 0.0}});
      store.take({2, true, 7, {0.0, 0.0, 0.7, 1.0}});
      store.take({2, false, 12, {-0.2, 0.5, 1.1, 0.0}});
    }
    std::vector<double> words(store.words_of(2));
    ASSERT_EQ(store.pack(2, words.data()), (int) words.size());

    BondStore other(with_history);
    other.grow(2);
    ASSERT_EQ(other.unpack(1, words.data()), (int) words.size());
    other.copy(1, 0);
    other.clear(1);
    EXPECT_TRUE(other.of(1).empty());
    expect_same(other.of(0), store.of(2));
    EXPECT_EQ(other.has_changed(), with_history);
    if (!with_history) continue;
    EXPECT_EQ(other.histories_of(0)[0], (PairHistory{0.1, 0.2, 0.3, 0.0}));
    EXPECT_EQ(other.histories_of(0)[1], (PairHistory{0.0, 0.0, 0.7, 1.0}));
    ASSERT_EQ(other.contacts_of(0).size(), 1u);
    EXPECT_EQ(other.contacts_of(0)[0].partner, 12);
    EXPECT_EQ(other.contacts_of(0)[0].history.q, -0.2);
    EXPECT_TRUE(other.contacts_of(1).empty());
  }
}

// Buffers of migration and of restart files are made for the longest record; history costs nothing where there is none.
TEST(BondStore, RoomGrowsWithTheHistory)
{
  EXPECT_EQ(recorded().words_of(0), 2 + 2 * 2u);
  EXPECT_EQ(recorded(true).words_of(0), 2 + 6 * 2u + 1);
  EXPECT_LT(recorded().memory_usage(), recorded(true).memory_usage());
  BondStore store = recorded(true);
  for (int64_t partner = 100; partner < 120; partner++) {
    store.take({0, false, partner, {-0.1, 0.1, 0.2, 0.0}});
    EXPECT_GE(store.most_words(), (int) store.words_of(0)) << partner;
  }
  BondStore late = recorded();
  late.keep_history(true);
  for (int i = 0; i < 2; i++) EXPECT_GE(late.most_words(), (int) late.words_of(i));
}

// Restart files carry no check of their own: a wrong count would read beyond the words of the atom.
TEST(BondStore, TellsWordsWithAWrongCount)
{
  for (const bool with_history : {false, true}) {
    BondStore store = recorded(with_history);
    if (with_history) store.take({0, false, 12, {-0.2, 0.5, 1.1, 0.0}});
    std::vector<double> words(store.words_of(0));
    const size_t n = store.pack(0, words.data());
    EXPECT_TRUE(store.fits(words.data(), n));
    for (const size_t other : {(size_t) 0, (size_t) 1, n - 1, n + 1})
      EXPECT_FALSE(store.fits(words.data(), other));
    EXPECT_FALSE(BondStore(!with_history).fits(words.data(), n));
    for (const int64_t count : {-1l, 0l, 1l, 3l, 1l << 62}) {
      words[1] = EVP::bits_as<double>(count);
      EXPECT_FALSE(store.fits(words.data(), n)) << count;
    }
  }
}

TEST(BondStore, EveryOtherStateHasAVersionOfItsOwn)
{
  BondStore store = recorded(), another = recorded();
  const long version = store.version();
  EXPECT_NE(version, another.version());
  store.copy(0, 1);    // atoms that come and go
  EXPECT_EQ(store.version(), version);
  store.close();
  EXPECT_NE(store.version(), version);
  EXPECT_TRUE(store.is_closed());
  EXPECT_FALSE(store.has_recorded());
}

/// The hints end with NO_SLOT, and must outlive the finder.
EVP::RecordFinder finder_of(const BondStore::Bonds &bonds, const std::vector<int> &hints)
{
  return {bonds, {hints.data(), hints.data() + hints.size() - 1}};
}

TEST(RecordFinder, FindsWhatAPlainSearchFindsWhateverTheHints)
{
  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; trial++) {
    const int nrecords = (int) (random() % 40) * (trial % 7 == 0 ? 20 : 1);
    std::vector<int64_t> ids(2 * nrecords + 10);
    const int64_t first = trial % 3 ? 1 : std::numeric_limits<int64_t>::max() / 2;
    for (size_t k = 0; k < ids.size(); k++) ids[k] = first + (int64_t) k;
    std::shuffle(ids.begin(), ids.end(), random);
    std::sort(ids.begin(), ids.begin() + nrecords);    // the store keeps the order of the partners
    BondStore::Bonds bonds;
    std::map<int64_t, int> plain;
    for (int slot = 0; slot < nrecords; slot++) {
      plain[ids[slot]] = slot;
      bonds.push_back({ids[slot], 1.0});
    }

    std::vector<int> hints;
    for (int k = 0; k < 30 && trial % 2; k++) hints.push_back((int) (random() % 50) - 5);
    hints.push_back(EVP::RecordFinder::NO_SLOT);
    for (int build = 0; build < 3; build++) {
      if (build != 2) std::shuffle(ids.begin(), ids.end(), random);
      EVP::RecordFinder finder = finder_of(bonds, hints);
      std::vector<int> slots;
      for (const int64_t id : ids) {
        slots.push_back(finder.find(id));
        ASSERT_EQ(slots.back(), plain.count(id) ? plain[id] : -1) << "trial " << trial;
        ASSERT_EQ(finder.find(id), slots.back()) << "another image of the same partner";
      }
      hints = slots;
      hints.push_back(EVP::RecordFinder::NO_SLOT);
    }
  }
}

}    // namespace
