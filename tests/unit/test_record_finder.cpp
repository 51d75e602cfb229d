// SPDX-License-Identifier: GPL-2.0-only
//
// Looking up the records of an atom: always those of a plain search, whatever the hints say.

#include "core/bond_store.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>

namespace {

using Bonds = EVP::BondStore::Bonds;

double deq_of(int64_t partner)
{
  return 1.0 + 1e-3 * (double) (partner % 1000);
}

/// In the order of the partners, as the store keeps them.
Bonds bonds_with(std::vector<int64_t> partners)
{
  std::sort(partners.begin(), partners.end());
  Bonds bonds;
  for (const int64_t partner : partners) bonds.push_back({partner, deq_of(partner)});
  return bonds;
}

/// The hints end with NO_SLOT, and must outlive the finder.
EVP::RecordFinder finder_of(const Bonds &bonds, const std::vector<int> &hints)
{
  return {bonds, {hints.data(), hints.data() + hints.size() - 1}};
}

TEST(RecordFinder, NothingIsFoundWithoutRecords)
{
  const Bonds none;
  const std::vector<int> hints = {0, 3, EVP::RecordFinder::NO_SLOT};
  EVP::RecordFinder finder = finder_of(none, hints);
  for (const int partner : {0, 1, 7}) EXPECT_EQ(finder.find(partner), -1);
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
    const Bonds bonds = bonds_with({ids.begin(), ids.begin() + nrecords});
    std::map<int64_t, int> plain;
    for (int slot = 0; slot < nrecords; slot++) plain[bonds[slot].partner] = slot;

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

// A neighbor list in which one neighbor left and another came needs no search but for these.
TEST(RecordFinder, HintsAreTakenUpAgainBehindAChange)
{
  const Bonds bonds = bonds_with({10, 20, 30, 40, 50});
  const std::vector<int> hints = {4, 0, 2, 1, 3, EVP::RecordFinder::NO_SLOT};
  EVP::RecordFinder finder = finder_of(bonds, hints);
  const std::vector<std::pair<int64_t, int>> asked = {{50, 4}, {30, 2}, {7, -1},
                                                      {20, 1}, {40, 3}, {10, 0}};
  for (const auto &[partner, slot] : asked) EXPECT_EQ(finder.find(partner), slot);
}

}    // namespace
