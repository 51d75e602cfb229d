// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/block_energy.h"
#include "core/force_loop.h"

#include <numeric>
#include <vector>

namespace EVP {

/// Energies of the pairs of one list, found block by block in the force loop, and summed so that the
/// change between two instants keeps its digits however small it is beside the depth of the pairs.
///
/// Each pair counts from its rest at deq. What it takes from there to its cut-off, the depth, is
/// thousands of times what a working body stores. So depths are summed apart, each in two parts: one
/// rounded to a unit that makes any sum of them exact, in any order, and what is left of it. That sum
/// is touched only where a pair passes its cut-off.
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

  /// Over the pairs within their cut-off, those with a partner that takes no reaction by half; doubles
  /// only, to be added over MPI ranks [energy].
  struct Sums {
    double first, second;    ///< of bonds, up to xi_s and beyond
    double contacts;         ///< of new pairs
    double hardening;        ///< of bonds, by their offset
    double plastic;          ///< dissipated as offsets move on to the next ones
    double ended;            ///< beside their depths, of pairs that passed their cut-offs since
    double born;             ///< less what their offsets made of the depth of bonds that broke
    Depth bonds_depth, contacts_depth;
    Depth broken;    ///< of bonds that broke, since the start
  };

  /// The next list may have the number of the last one.
  void forget() { build = -1; }

  /// Has the list changed since assign()? flows: see there.
  bool is_due(const PairList &list, bool flows) const
  {
    return build != list.build || flows != energies.flows;
  }

  /// A new list. deq: of its pairs, as recorded [length]: 1/deq of the list has lost its last bit.
  /// law: of its pairs. nreact: see ParticleView. flows: pairs have offsets, at Block::flow.
  /// breaks: bonds beyond their cut-off break.
  void assign(const PairList &list, const BlockLaw &law, std::vector<double> deq, int nreact,
              bool flows, bool breaks);

  /// Of all pairs of the list, those beyond their cut-off too [energy].
  double total_depth() const { return std::accumulate(depth.begin(), depth.end(), 0.0); }

  /// The total over all MPI ranks that sums are to be exact up to, from now on.
  void set_largest_depth(double sum);

  /// Before the first block of an evaluation.
  void begin()
  {
    found = {};
    ended = passed;
    plastic = flowed;
    passed = flowed = 0.0;
    changed = finds_anew = is_new;
    is_new = false;
  }

  /// May pairs be beyond their cut-off that were within it at the evaluation before, or the reverse?
  bool has_changed() const { return changed; }

  /// Adds the pairs of a block. damps: their damping is asked for, at Block::approach. Returns what
  /// each holds, until the next call.
  const BlockEnergy::Values &add(const PairList &list, const PairRange &range, const Block &block,
                                 bool damps);

  /// Before the list is built anew, at the positions of the next evaluation: which bonds have passed
  /// their cut-offs since the last one, that evaluation does not know.
  void note_passed(const PairList &list, const double (*x)[3]);

  /// Bond k of the list has flowed, and its offset is in force already [energy].
  void note_flow(const PairList &list, size_t k, double spent);

  /// Pair k of the list is a bond that has broken, with the offset p, and will be a contact that is at
  /// rest at this distance [length], 0 where none is left.
  void note_broken(const PairList &list, size_t k, double p, double rest);

  /// After the last block.
  Sums sums() const
  {
    return {found.first.total(),
            found.second.total(),
            found.contacts.total(),
            found.hardening.total(),
            plastic + found.plastic.total(),
            ended,
            born,
            bonds_depth,
            contacts_depth,
            broken};
  }

  /// Spent on bonds that have left since, but did not break: what it took to pull them from deq to
  /// their cut-off.
  static double lost(const Sums &start, const Sums &now)
  {
    return (start.bonds_depth - now.bonds_depth) - (now.broken - start.broken);
  }

  /// The same of those that broke, less what the contacts hold that they became.
  static double of_broken(const Sums &start, const Sums &now)
  {
    return (now.broken - start.broken) - (now.born - start.born);
  }

  /// Change of the energy of new pairs, which is zero at the cut-off.
  static double of_contacts(const Sums &start, const Sums &now)
  {
    return (now.contacts - start.contacts) - (now.contacts_depth - start.contacts_depth);
  }

  double memory_usage() const { return bytes_of(deq, depth, weight, energies.forms); }

 private:
  struct LaneSums {
    LaneSum first, second, contacts, hardening, plastic, passes;
  };

  long build = -1;
  double unit = 0.0;    // a power of two above any sum of depths
  BlockEnergy energies;
  std::vector<double> deq, depth, weight;    // of each pair: depth is times its PairWeight
  Depth bonds_depth{}, contacts_depth{}, broken{};
  double ended = 0.0, born = 0.0;
  double plastic = 0.0;                    // before the evaluation
  double passed = 0.0, flowed = 0.0;       // what `ended` and `plastic` of the next one begin with
  bool breaks = false;                     // do bonds break where they pass their cut-off?
  bool changed = false, is_new = false;    // see has_changed(); was the list assigned since?
  bool finds_anew = false;                 // which pairs are beyond their cut-offs?
  LaneSums found;
  BlockEnergy::Values values;

  void add_up(int n);    // the values of n pairs
  // back: takes it out again
  void add_depth(bool is_bond, double x, bool back)
  {
    add_depth(is_bond ? bonds_depth : contacts_depth, x, back);
  }
  void add_depth(Depth &sum, double x, bool back)
  {
    const double rounded = (x + unit) - unit;
    sum.rounded += back ? -rounded : rounded;
    sum.rest += back ? rounded - x : x - rounded;
  }
};

}    // namespace EVP
