// SPDX-License-Identifier: GPL-2.0-only
//
// The records of the bonds: what travels with an atom, and when readers must look again.

#include "core/bonds/bond_store.h"

#include <gtest/gtest.h>

namespace {

using EVP::BondRecord;
using EVP::BondStore;
using EVP::Remembered;
using EVP::Sphere;

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

// An atom that leaves an MPI rank and comes to another brings all to the last bit.
TEST(BondStore, WordsBringRecordsAndHistoryToAnotherPlace)
{
  for (const bool with_history : {false, true}) {
    BondStore store = recorded(with_history);
    const Sphere own = {0.1, 0.2, 0.3, 2.0, 4.0};
    if (with_history) {
      store.sphere(2) = own;
      store.remembered_of(2).push_back({12, 0.875, Remembered::CONTACT});
    }
    store.keep_given(true);
    store.given(2) = 0.25;
    std::vector<double> words(store.words_of(2));
    ASSERT_EQ(store.pack(2, words.data()), (int) words.size());

    BondStore other(with_history);
    EXPECT_FALSE(other.fits(words.data(), words.size()));
    other.keep_given(true);
    other.grow(2);
    EXPECT_TRUE(other.fits(words.data(), words.size()));
    ASSERT_EQ(other.unpack(1, words.data()), (int) words.size());
    other.copy(1, 0);
    other.clear(1);
    EXPECT_TRUE(other.of(1).empty());
    EXPECT_EQ(other.given(0), 0.25);
    EXPECT_EQ(other.given(1), EVP::GivenStrain::NONE);
    expect_same(other.of(0), store.of(2));
    EXPECT_EQ(other.has_flowed(2), with_history);
    EXPECT_FALSE(recorded(with_history).has_flowed(4));
    if (!with_history) continue;
    const Sphere &found = other.sphere(0);
    EXPECT_TRUE(found.p == own.p && found.work == own.work && found.slip == own.slip &&
                found.bonds == own.bonds && found.recorded == own.recorded);
    ASSERT_EQ(other.remembered_of(0).size(), 1u);
    EXPECT_EQ(other.find_remembered(0, 12)->deq, 0.875);
    EXPECT_EQ(other.find_remembered(0, 12)->kind, Remembered::CONTACT);
    EXPECT_EQ(other.find_remembered(0, 5), nullptr);
    EXPECT_TRUE(other.remembered_of(1).empty());
  }
}

TEST(BondStore, BondsMoveAndEndOnBothSidesAndAreCountedOnce)
{
  BondStore store = recorded(true);
  store.set(0, 9, &BondRecord::deq, 1.375);
  EXPECT_EQ(store.find(0, 9)->deq, 1.375);
  EXPECT_EQ(store.find(2, 7)->deq, 1.25) << "the other side is another record";
  EXPECT_EQ(store.count_sides(3), 6);
  for (int twice = 0; twice < 2; twice++) {    // either copy of a bond may say so
    store.end(0, 9, true);
    store.end(2, 7, true);
    store.set(0, 9, &BondRecord::deq, 1.5);
  }
  EXPECT_EQ(store.counts().ended, 1);
  EXPECT_EQ(store.counts().failed, 1);
  EXPECT_EQ(store.count_sides(3), 4);
  EXPECT_EQ(store.find(0, 9), nullptr);
  expect_same(store.of(0), {{5, 1.5}});
  EXPECT_EQ(store.count(), 3) << "were recorded";
  EXPECT_EQ(store.sphere(0).recorded, 2.0);
}

// p grows by the mean over the bonds that there were before; without any what waits is dropped.
TEST(Sphere, PlasticStrainIsTheMeanOfItsBonds)
{
  Sphere own = {0.5, 0.0, 0.062, 4.0, 4.0};
  own.move_on(0.0);
  EXPECT_DOUBLE_EQ(own.p, 0.5 + 0.062 / 4.0 / 0.31);
  EXPECT_EQ(own.slip, 0.0);
  own.slip = 0.1;
  own.move_on(3.0);
  EXPECT_DOUBLE_EQ(own.p, 0.55) << "it had none";
  own.slip = 0.031;
  own.move_on(3.0);
  EXPECT_DOUBLE_EQ(own.p, 0.55 + 0.031 / 3.0 / 0.31);
}

// Buffers of migration and of restart files are made for the longest record; history costs nothing where there is none.
TEST(BondStore, RoomGrowsWithTheHistory)
{
  EXPECT_EQ(recorded().words_of(0), 2 + 2 * 2u);
  EXPECT_EQ(recorded(true).words_of(0), 2 + 2 * 2u + 5 + 1);
  EXPECT_LT(recorded().memory_usage(), recorded(true).memory_usage());
  BondStore store = recorded(true);
  for (int64_t partner = 100; partner < 120; partner++) {
    store.remembered_of(0).push_back({partner, 0.9, Remembered::CONTACT});
    EXPECT_GE(store.most_words(), (int) store.words_of(0)) << partner;
  }
  BondStore late = recorded();
  late.keep_history(true);
  for (int i = 0; i < 2; i++) {
    EXPECT_GE(late.most_words(), (int) late.words_of(i));
    EXPECT_TRUE(late.sphere(i).is_new(late.of(i).size()));
  }
}

// Restart files carry no check of their own: a wrong count would read beyond the words of the atom.
TEST(BondStore, TellsWordsWithAWrongCount)
{
  for (const bool with_history : {false, true}) {
    BondStore store = recorded(with_history);
    if (with_history) store.remembered_of(0).push_back({12, 0.875, Remembered::CONTACT});
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

/// Values of an effect; one of them is 2 at recording.
struct Example {
  double own, bonds, soon;

  static constexpr const char *NAME = "example";
  static constexpr unsigned NEEDS = EVP::JOINED_BONDS;
  static constexpr EVP::SphereValue TABLE[] = {
      {"example_own", "1", 2.0, EVP::Range::ANY, true},
      {"example_bonds", "1", EVP::ITS_BONDS, EVP::Range::COUNT, false},
      {"example_soon", "1", EVP::BY_BONDS, EVP::Range::ANY, false}};
};
const bool has_example = EVP::add_table<Example>();

// They begin as at recording, whenever that was, go where their atoms go, and go when nobody keeps them any more.
TEST(BondStore, KeepsTheValuesOfAnEffect)
{
  BondStore store = recorded(true);
  EXPECT_FALSE(store.has<Example>());
  store.keep<Example>(true);
  const auto records = store.columns<Example>();
  EXPECT_EQ(records[0].own, 2.0);
  EXPECT_EQ(records[0].bonds, 2.0);
  EXPECT_EQ(records[3].bonds, 0.0) << "an atom without bonds";
  const auto has_changed = [&](int i) {
    return store.all_groups().at("example")->has_changed(i, store.of(i).size());
  };
  records[0].soon = 7.0;
  EXPECT_FALSE(has_changed(0));
  records[0].own = 3.0;
  EXPECT_TRUE(has_changed(0));
  EXPECT_EQ(store.find_value("example_own").of(0), 3.0);
  EXPECT_FALSE(store.find_value("example_else"));

  store.copy(0, 3);
  store.grow(1000);
  EXPECT_EQ(records[3].own, 3.0) << "the same records after they have moved";
  EXPECT_EQ(records[999].own, 2.0);
  store.clear(3);
  EXPECT_EQ(records[3].own, 2.0);

  store.remembered_of(0).push_back({9, 1.0, Remembered::JOINED});
  store.words["example"] = {1.0};
  EXPECT_TRUE(store.notes_joined());
  store.drop_unclaimed();    // it was kept since the last time
  EXPECT_TRUE(store.has<Example>());
  store.drop_unclaimed();
  EXPECT_FALSE(store.has<Example>());
  EXPECT_TRUE(store.words.empty() && store.remembered_of(0).empty());
  EXPECT_TRUE(store.has_history()) << "is of the store";
}

// A restart file says which values it has, also those of an effect that is not there yet, or never.
TEST(BondStore, GroupsComeBackFromRestartFiles)
{
  BondStore store = recorded(true);
  store.keep<Example>(true);
  store.columns<Example>()[1].own = 5.0;
  store.words["example"] = {0.5, 0.25};
  store.words["other"] = {};
  std::vector<double> words(store.words_of(1));
  store.pack(1, words.data());
  const std::vector<double> packed = store.pack_groups();
  const auto into = [](BondStore &other, const std::vector<double> &groups) {
    other.grow(1);
    other.unpack_groups(groups.data());
  };
  BondStore again;
  into(again, packed);
  EXPECT_TRUE(again.has_history());
  EXPECT_EQ(again.words, store.words);
  EXPECT_TRUE(again.fits(words.data(), words.size()));
  again.unpack(0, words.data());
  EXPECT_EQ(again.columns<Example>()[0].own, 5.0);
  EXPECT_EQ(again.pack_groups(), packed);

  const auto renamed = [&](const std::string &from, const std::string &to) {
    std::vector<double> changed;
    const double *at = packed.data();
    std::string text = EVP::take_text(at);
    EVP::put_text(changed, text.replace(text.find(from), from.size(), to));
    changed.insert(changed.end(), at, packed.data() + packed.size());
    return changed;
  };
  BondStore unknown;
  into(unknown, renamed("example ", "absent "));
  EXPECT_TRUE(unknown.fits(words.data(), words.size()));
  unknown.drop_unclaimed();
  EXPECT_EQ(unknown.all_groups().size(), 1u) << "the history";
  for (const char *other : {"deq", "slip", "example_own"})
    EXPECT_THROW(into(unknown, renamed(other, "else")), EVP::BadInput) << other;
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

}    // namespace
