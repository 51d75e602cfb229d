// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/heat/expansion.h"

#include "lammps/base/collective.h"

#include "comm.h"

#include <map>

namespace EVP {

// what it holds, and will dissipate by the flow that is due at this distance
static double energy_of(const PairData &pairs, const PlacedPair &pair)
{
  const bool is_reversible = pair.flow == Flow::REVERSIBLE;
  if (!pair.is_bond && pair.is_past_cutoff()) return 0.0;
  const PairState now = pairs.state_of(pair);
  if (pair.is_bond || !is_reversible) return now.stored.total() + now.dissipated;
  return now.stored.total() -
      pairs.law_of(pair).state(pair.cut * pair.inv_deq, pair).stored.total();
}

static double energy_of_pairs(PairData &pairs)
{
  const PairLists &lists = pairs.lists();
  double sum = 0.0;
  for_each_pair(lists, pairs.positions(), [&](const PlacedPair &pair) {
    sum += rank_share(pair.j, lists.nreact) * energy_of(pairs, pair);
  });
  pairs.effects.for_each([&](Effect &one) {
    sum += one.energy_of_present_positions();
  });
  return sum;
}

void rest_at_growth(PairData &pairs, const Growth &growth, const std::function<bool(int)> &came)
{
  const Atom *const atom = pairs.atoms();
  PairLists &lists = pairs.lists();
  BondStore &store = pairs.store();
  std::map<tagint, int> places;    // any image will do
  for (int k = lists.nall - 1; k >= 0; k--) places[atom->tag[k]] = k;
  for (int i = 0; i < lists.nlocal; i++)
    for (const BondRecord &bond : store.of(i)) {
      const auto at = places.find((tagint) bond.partner);
      if (at == places.end() || !(came(i) || came(at->second))) continue;
      store.set(i, bond.partner, &BondRecord::deq,
                bond.deq / (0.5 * (growth[i] + growth[at->second])));
    }
  PairList &bonds = lists.bonds;
  for (const PackedRow &row : bonds.rows)
    for (int k = row.first; k < row.last; k++) {
      const int i = row.i, j = bonds.j[k];
      if (!(came(i) || came(j))) continue;
      const double dlim =
          pairs.coefficients().law(bonds.law[k]).row.alpha * (atom->radius[i] + atom->radius[j]);
      const Span span = pairs.rules().of_bond(store.find(i, atom->tag[j])->deq, dlim);
      bonds.set(k, j, span.deq, span.cutoff, bonds.law[k]);
    }
}

void grow_packed_pairs(PairData &pairs, const Growth &growth)
{
  PairLists &lists = pairs.lists();
  lists.growth = growth;
  for (PairList *list : {&lists.bonds, &lists.contacts})
    list->grow([&](int i, int j) {
      return lists.growth_of(i, j);
    });
}

double grow_pairs(PairData &pairs, const Growth &growth)
{
  PairLists &lists = pairs.lists();
  const double before = energy_of_pairs(pairs);
  const Growth had = lists.growth;
  lists.growth = growth;
  const Effect::Ratio ratio = [&](int i, int j) {
    return lists.growth_of(i, j) / (0.5 * (had[i] + had[j]));
  };
  for (PairList *list : {&lists.bonds, &lists.contacts}) list->grow(ratio);
  pairs.effects.for_each([&](Effect &one) {
    one.pairs_grow(ratio);
  });
  return energy_of_pairs(pairs) - before;
}

}    // namespace EVP
