// SPDX-License-Identifier: GPL-2.0-only
//
// What all pairs hold above rest, summed so that the change between two instants keeps its digits
// however small it is beside the depth of the pairs.
// Pure C++17.

#ifndef EVP_CORE_STORED_ENERGY_H
#define EVP_CORE_STORED_ENERGY_H

#include "core/law.h"
#include "core/pair_list.h"

#include <cmath>
#include <utility>
#include <vector>

namespace EVP {

/// Energies of the pairs of one list.
///
/// Each pair counts from its rest at deq. What it takes from there to its cut-off, the depth, is
/// thousands of times what a working body stores. So depths are summed apart, each in two parts: one
/// rounded to a unit that makes any sum of them exact, in any order, and what is left of it.
class StoredEnergy {
 public:
  /// A sum of depths [energy].
  struct Depth {
    double rounded, rest;
    friend double operator-(const Depth &a, const Depth &b)
    {
      return (a.rounded - b.rounded) + (a.rest - b.rest);
    }
  };

  /// Over the pairs within their cut-off; doubles only, to be added over MPI ranks [energy].
  struct Sums {
    double first, second;    ///< of bonds, up to xi_s and beyond
    double contacts;         ///< of new pairs
    Depth bonds_depth, contacts_depth;
  };

  /// The list is another one: assign() is due.
  bool is_due(const PairList &list) const { return build != list.build; }

  /// deq: of each pair of the list, as it was recorded. law_of(pair): its Law.
  template <class LawOf>
  void assign(const PairList &list, std::vector<double> deq_in, LawOf &&law_of)
  {
    build = list.build;
    deq = std::move(deq_in);
    depth.resize(deq.size());
    for (size_t n = 0; n < deq.size(); n++) {
      const PackedPair &pair = list.pairs[n];
      depth[n] = law_of(pair).stored(pair.cut, deq[n]).total();
    }
  }

  /// Of all pairs of the list, those beyond their cut-off too [energy].
  double total_depth() const
  {
    double sum = 0.0;
    for (const double x : depth) sum += x;
    return sum;
  }

  /// The total over all MPI ranks that sums are to be exact up to.
  void set_largest_depth(double sum)
  {
    int exponent;
    std::frexp(sum, &exponent);
    unit = sum > 0.0 ? std::ldexp(1.0, exponent + 1) : 0.0;
  }

  double deq_of(size_t n) const { return deq[n]; }

  /// Adds pair n of the list, at d within its cut-off. weight: 1 or 1/2.
  void add(Sums &sums, size_t n, const PackedPair &pair, const Law &law, double d,
           double weight) const
  {
    const Law::Stored now = law.stored(d, deq[n]);
    if (pair.is_bond()) {
      sums.first += weight * now.first;
      sums.second += weight * now.second;
      add(sums.bonds_depth, weight * depth[n]);
    } else {
      sums.contacts += weight * now.total();
      add(sums.contacts_depth, weight * depth[n]);
    }
  }

  /// Spent on bonds that have left since: what it took to pull them from deq to their cut-off.
  static double lost(const Sums &start, const Sums &now)
  {
    return start.bonds_depth - now.bonds_depth;
  }

  /// Change of the energy of new pairs, which is zero at the cut-off.
  static double of_contacts(const Sums &start, const Sums &now)
  {
    return (now.contacts - start.contacts) - (now.contacts_depth - start.contacts_depth);
  }

  double memory_usage() const
  {
    return (double) (deq.capacity() + depth.capacity()) * sizeof(double);
  }

 private:
  long build = -1;
  double unit = 0.0;    // a power of two above any sum of depths
  std::vector<double> deq, depth;

  void add(Depth &sum, double x) const
  {
    const double rounded = (x + unit) - unit;
    sum.rounded += rounded;
    sum.rest += x - rounded;
  }
};

}    // namespace EVP

#endif
