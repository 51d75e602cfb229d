// SPDX-License-Identifier: GPL-2.0-only
//
// Looks the records of one atom up by partner, for neighbor after neighbor.
// Pure C++17.

#ifndef EVP_CORE_PARTNERS_H
#define EVP_CORE_PARTNERS_H

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace EVP {

/// The records of one atom, in any order, and the one that is expected next.
///
/// Each that is found takes its turn in the order of the records. Neighbor lists hardly change their
/// order from one build to the next, so that one comparison then finds it. Neighbors without a record
/// mostly fail at a filter, made where the first of them turns up. More than MANY records are kept in
/// the order of their partners instead and searched by halves, so that no row costs the square of it.
///
/// Bond has a member partner, an integer, unlike in all records.
template <class Bond> class Partners {
 public:
  using ID = decltype(Bond::partner);
  static constexpr size_t MANY = 128;

  explicit Partners(std::vector<Bond> &records) :
      begin(records.data()), end(begin + records.size()), next(begin),
      ordered(records.size() > MANY), filtered(false)
  {
    if (ordered && !std::is_sorted(begin, end, precedes)) std::sort(begin, end, precedes);
  }

  /// The record with that partner, nullptr if there is none. Stays in place from now on. Asked again,
  /// as for another image of the same partner, it is found again.
  const Bond *find(ID partner)
  {
    if (next != end && next->partner == partner) return next++;
    if (begin == end) return nullptr;
    return ordered ? search_by_halves(partner) : search(partner);
  }

 private:
  Bond *const begin, *const end;
  Bond *next;    // those before it were found, unless they are ordered
  const bool ordered;
  bool filtered;
  std::array<uint64_t, 8> filter;    // of 512 bits, those that the partners' hashes name

  static unsigned hash(ID partner)
  {
    return (unsigned) (((uint64_t) partner * 0x9E3779B97F4A7C15ULL) >> 55);    // golden ratio
  }
  uint64_t &word(unsigned bit) { return filter[bit / 64]; }
  static uint64_t mask(unsigned bit) { return (uint64_t) 1 << bit % 64; }

  static bool precedes(const Bond &a, const Bond &b) { return a.partner < b.partner; }

  const Bond *search_by_halves(ID partner)
  {
    Bond *const at = std::lower_bound(begin, end, partner, [](const Bond &bond, ID id) {
      return bond.partner < id;
    });
    if (at == end || at->partner != partner) return nullptr;
    next = at + 1;
    return at;
  }

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
