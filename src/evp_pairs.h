// SPDX-License-Identifier: GPL-2.0-only
//
// The packed pairs of one process: everything that the time-step loop needs to know of a pair,
// as one array per quantity, so that a step reads no more than it uses.
// Pure C++17.

#ifndef EVP_PAIRS_H
#define EVP_PAIRS_H

#include "evp_prefetch.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace EVP {

/// One pair of the neighbor list, ready for the time-step loop. Its i is that of its PackedRow.
struct PackedPair {
  double inv_deq;    ///< 1/deq [1/length]
  double cutsq;      ///< square of the distance beyond which nothing acts [length^2]
  int j;             ///< partner, local or ghost
  int law;           ///< index of the pair type's Law
  bool is_bond;      ///< deq was recorded at the start
};

/// An array of PackedPair, stored by quantity. Room is kept between builds.
class PackedPairs {
 public:
  size_t size() const { return count; }
  void clear() { count = 0; }

  /// Makes room for n more pairs; those that are there stay.
  void make_room(size_t n)
  {
    n += count;
    if (n <= partner.size()) return;
    n = std::max(n, partner.size() + partner.size() / 2);
    inverse_deq.resize(n);
    cut_squared.resize(n);
    partner.resize(n);
    kind_of.resize(n);
  }

  /// Requires room: see make_room().
  void push_back(const PackedPair &pair)
  {
    inverse_deq[count] = pair.inv_deq;
    cut_squared[count] = pair.cutsq;
    partner[count] = pair.j;
    kind_of[count] = 2 * pair.law + pair.is_bond;
    count++;
  }

  PackedPair operator[](size_t k) const
  {
    return {inverse_deq[k], cut_squared[k], partner[k], kind_of[k] / 2, (kind_of[k] & 1) != 0};
  }

  const double *inv_deq() const { return inverse_deq.data(); }
  const double *cutsq() const { return cut_squared.data(); }
  const int *j() const { return partner.data(); }

  /// 2 law + is_bond of each pair.
  const int *kind() const { return kind_of.data(); }

  /// Asks the memory for what a step with one law reads of pairs [first, first + n), where they exist.
  void prefetch(size_t first, size_t n) const
  {
    if (first >= count) return;
    n = std::min(n, count - first);
    EVP::prefetch(inverse_deq.data() + first, n * sizeof(double));
    EVP::prefetch(cut_squared.data() + first, n * sizeof(double));
    EVP::prefetch(partner.data() + first, n * sizeof(int));
  }

  double memory_usage() const
  {
    return (double) partner.capacity() * (2 * sizeof(double) + 2 * sizeof(int));
  }

 private:
  size_t count = 0;
  std::vector<double> inverse_deq, cut_squared;
  std::vector<int> partner, kind_of;
};

/// The pairs of one particle: [first, last) of PackedList::pairs.
struct PackedRow {
  int i;
  int first, last;
};

/// All pairs of one process, row by row, rebuilt with the neighbor list.
struct PackedList {
  std::vector<PackedRow> rows;
  PackedPairs pairs;
  long build = 0;           ///< counts the packings: indices of pairs hold as long as it does
  long common_build = 0;    ///< counts those that were collective
  int nlocal = 0;           ///< particles that the list was built for: own,
  int nall = 0;             ///< and with ghosts

  void clear()
  {
    build++;
    rows.clear();
    pairs.clear();
  }
  double memory_usage() const
  {
    return (double) (rows.capacity() * sizeof(PackedRow)) + pairs.memory_usage();
  }
};

}    // namespace EVP

#endif
