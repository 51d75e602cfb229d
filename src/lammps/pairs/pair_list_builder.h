// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"
#include "core/bonds/bond_store.h"
#include "core/law/coefficients.h"
#include "core/pairs/contacts.h"
#include "lammps/base/lammps_names.h"

#include "error.h"

#include <vector>

namespace EVP {

/// Room for n more pairs of a list; stops where there are too many.
inline void demand_room(PairList &list, size_t n, Error *error)
{
  if (!list.make_room(n))
    error->one(FLERR, "Pair evp/lj: more than {} pairs on one MPI rank: use more ranks",
               PairList::MOST);
}

/// Of a pair of a neighbor list: is it far beyond this distance until the next list? LAMMPS has one cutoff for two types, by the
/// largest radii. Both particles are within half a skin from where they were at the build, now and later. Pairs not that
/// far cost little, and without them the sums over similar spheres would be rounded otherwise.
inline bool stays_beyond(double dsq, double distance, double skin)
{
  constexpr double FAR_BEYOND = 1.25;
  const double edge = FAR_BEYOND * distance + 2.0 * skin;
  return dsq > edge * edge;
}

/// Packs the pairs of a neighbor list: from (i, j) to deq of the record, cutoff and law.
class PairListBuilder : protected Pointers {
 public:
  struct Input {
    const NeighList *neighbors;
    const Coefficients *coefficients;
    const BondStore *bonds;    ///< nullptr without
    PairRules rules;
    BodyRule within;    ///< see fix evp/bonds
    bool any_damping;
    int implicit_groupbit;    ///< pairs with an atom of it have the law without gamma
    bool looks_first;         ///< no pair has been looked at that may join: which are inside?
  };

  /// Pairs that overlap beyond the limit; the first of them.
  struct Overlaps {
    bigint count;
    tagint id_i, id_j;
    double d, deq;
  };

  struct Found {
    bool damped;          ///< a pair has damping of its own
    bigint bond_sides;    ///< atoms of bonds whose pairs this rank has, each once over all ranks
    Overlaps overlaps;
  };

  explicit PairListBuilder(LAMMPS *lmp) : Pointers(lmp) {}

  /// Fills the list in time linear in the neighbors. Of the periodic images of a partner, which share its ID, one is
  /// bonded: fix evp/bonds ensures that no two of them are within dlim, and past dlim it is the minimum image.
  Found build(const Input &, PairLists &);

 private:
  struct View;
  void pack_row(const Input &, const View &, int i, PairLists &, Found &);
  void count_overlap(int i, int j, double dsq, double deq, Overlaps &) const;
};

}    // namespace EVP
