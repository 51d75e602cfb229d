// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_CORE_STORED_ENERGY_H
#define EVP_CORE_STORED_ENERGY_H

#include "core/force_loop.h"

#include <cmath>
#include <numeric>
#include <vector>

namespace EVP {

/// Energies of the pairs of one list, summed so that the change between two instants keeps its digits
/// however small it is beside the depth of the pairs.
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

  /// Has the list changed since assign()?
  bool is_due(const PairList &list) const { return build != list.build; }

  /// pairs: what has packed_pairs(), rest_distances() and law_of(pair), as the pair style does.
  template <class Pairs> void assign(const Pairs &pairs)
  {
    const PairList &list = pairs.packed_pairs();
    build = list.build;
    deq = pairs.rest_distances();
    depth.resize(deq.size());
    for (size_t n = 0; n < deq.size(); n++) {
      const PackedPair pair = list.pairs[n];
      depth[n] = pairs.law_of(pair).stored(pair.cut, deq[n]).total();
    }
  }

  /// Of all pairs of the list, those beyond their cut-off too [energy].
  double total_depth() const { return std::accumulate(depth.begin(), depth.end(), 0.0); }

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

  double memory_usage() const { return bytes_of(deq, depth); }

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

/// The pairs of one rank in the energy balance: the sums of what they store, and the forces from which
/// works and dissipation follow.
struct PairWork {
  StoredEnergy stored;

  /// Three values per particle and ghost: that the damping of the laws sees, to be set by the caller.
  std::vector<double> velocity;
  /// What evaluate() finds, on ghosts reactions [force]: of the laws, and of their damping.
  std::vector<double> force, damping;

  /// Returns the sums of this rank. pairs: see StoredEnergy::assign(), which is called where it is due.
  /// nreact: particles below this index take the reaction.
  template <class Pairs>
  StoredEnergy::Sums evaluate(const Pairs &pairs, const double (*x)[3], int nreact)
  {
    const PairList &list = pairs.packed_pairs();
    if (stored.is_due(list)) stored.assign(pairs);
    force.assign((size_t) 3 * list.nall, 0.0);
    damping.assign((size_t) 3 * list.nall, 0.0);
    StoredEnergy::Sums sums{};
    for_each_pair(list, x, [&](const PlacedPair &p) {
      if (p.is_beyond()) return;
      const bool reacts = p.j < nreact;
      const double d = p.distance();
      const Law &law = pairs.law_of(p);
      // without newton both owners of a pair across MPI ranks hold it
      stored.add(sums, p.index, p, law, d, reacts ? 1.0 : 0.5);

      const auto add = [&](std::vector<double> &forces, double over_d) {
        const double f[] = {over_d * p.g.dx, over_d * p.g.dy, over_d * p.g.dz};
        for (int c = 0; c < 3; c++) {
          forces[(size_t) 3 * p.i + c] += f[c];
          if (reacts) forces[(size_t) 3 * p.j + c] -= f[c];
        }
      };
      add(force, law.force(d, stored.deq_of(p.index)) / d);
      const double gamma = law.parameters().gamma;
      if (gamma > 0.0)
        add(damping,
            damping_over_distance(gamma, p.g, &velocity[(size_t) 3 * p.i],
                                  &velocity[(size_t) 3 * p.j]));
    });
    return sums;
  }

  double memory_usage() const { return stored.memory_usage() + bytes_of(velocity, force, damping); }
};

}    // namespace EVP

#endif
