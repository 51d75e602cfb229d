// SPDX-License-Identifier: GPL-2.0-only
//
// Looks the records of one atom up by partner, for neighbor after neighbor.
// Pure C++17.

#ifndef EVP_PARTNERS_H
#define EVP_PARTNERS_H

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace EVP {

/// The records of one atom, in any order, and the one that is expected next.
///
/// Each that is found takes its turn in the order of the records. Neighbor lists hardly change their
/// order from one build to the next, so that one comparison then finds it. Neighbors without a record
/// mostly fail at a filter, made where the first of them turns up: the time of a row is linear.
///
/// Bond has a member partner, an integer, unlike in all records.
template <class Bond> class Partners {
 public:
  using ID = decltype(Bond::partner);

  explicit Partners(std::vector<Bond> &records) :
      begin(records.data()), end(begin + records.size()), next(begin), filtered(false)
  {
  }

  /// The record with that partner, nullptr if there is none. Stays in place from now on. Asked again,
  /// as for another image of the same partner, it is found again.
  const Bond *find(ID partner)
  {
    if (next != end && next->partner == partner) return next++;
    return begin == end ? nullptr : search(partner);
  }

 private:
  Bond *const begin, *const end;
  Bond *next;    // those before it were found
  bool filtered;
  std::array<uint64_t, 8> filter;    // of 512 bits, those that the partners' hashes name

  static unsigned hash(ID partner)
  {
    return (unsigned) (((uint64_t) partner * 0x9E3779B97F4A7C15ULL) >> 55);    // golden ratio
  }
  uint64_t &word(unsigned bit) { return filter[bit / 64]; }
  static uint64_t mask(unsigned bit) { return (uint64_t) 1 << bit % 64; }

  const Bond *search(ID partner)
  {
    if (!filtered) make_filter();
    const unsigned bit = hash(partner);
    if (!(word(bit) & mask(bit))) return nullptr;
    for (Bond *at = next; at != end; at++)
      if (at->partner == partner) {
        std::swap(*at, *next);
        return next++;
      }
    for (const Bond *at = begin; at != next; at++)
      if (at->partner == partner) return at;
    return nullptr;
  }

  void make_filter()
  {
    filtered = true;
    filter.fill(0);
    for (const Bond *at = begin; at != end; at++) {
      const unsigned bit = hash(at->partner);
      word(bit) |= mask(bit);
    }
  }
};

}    // namespace EVP

#endif
