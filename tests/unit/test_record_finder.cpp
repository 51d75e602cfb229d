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

/// The hints end with NO_SLOT, and must outlive the finder.
EVP::RecordFinder finder_of(const Bonds &bonds, const std::vector<int> &hints)
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
    Bonds bonds;
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
