// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"

#include <algorithm>
#include <array>

namespace EVP {

/// Looks the records of one atom up by partner, for neighbor after neighbor.
///
/// Neighbor lists hardly change their order from one build to the next, so that the slots that the
/// last list found, in its order, mostly name the next one: one comparison then finds it. Neighbors
/// without a record mostly fail at a filter, made where the first of them turns up.
class RecordFinder {
 public:
  static constexpr int NO_SLOT = -1;

  /// Slots that are expected next, in this order; any numbers will do. *end is NO_SLOT.
  struct Hints {
    const int *begin, *end;
  };

  RecordFinder(const BondStore::Bonds &records_in, Hints hints_in) :
      records(records_in.data()), n((int) records_in.size()), hints(hints_in)
  {
  }

  /// Slot of the record with that partner, -1 if there is none. Asked again, as for another image of
  /// the same partner, it is found again.
  int find(int64_t partner)
  {
    const int slot = *hints.begin;
    if ((unsigned) slot < (unsigned) n && records[slot].partner == partner) {
      hints.begin++;
      return slot;
    }
    return n ? search(partner) : -1;
  }

 private:
  const Bond *const records;
  const int n;
  Hints hints;
  bool filtered = false;
  std::array<uint64_t, 8> filter;    // of 512 bits, those that the partners' hashes name

  static unsigned hash(int64_t partner)
  {
    return (unsigned) (((uint64_t) partner * 0x9E3779B97F4A7C15ULL) >> 55);    // golden ratio
  }
  static uint64_t mask(unsigned bit) { return (uint64_t) 1 << bit % 64; }

  int search(int64_t partner)
  {
    if (!filtered) {
      filtered = true;
      filter.fill(0);
      for (int slot = 0; slot < n; slot++) {
        const unsigned bit = hash(records[slot].partner);
        filter[bit / 64] |= mask(bit);
      }
    }
    const unsigned bit = hash(partner);
    if (!(filter[bit / 64] & mask(bit))) return -1;

    const Bond *const at = BondStore::find(records, records + n, partner);
    if (!at) return -1;
    const int slot = (int) (at - records);
    const int *const near_end = hints.begin + std::clamp<ptrdiff_t>(hints.end - hints.begin, 0, 64);
    const int *const hint = std::find(hints.begin, near_end, slot);
    if (hint != near_end) hints.begin = hint + 1;
    return slot;
  }
};

}    // namespace EVP
