// SPDX-License-Identifier: GPL-2.0-only

#include "pair_list_builder.h"

#include "atom_bodies.h"
#include "core/simd.h"
#include "scene.h"

#include "neigh_list.h"

#include <algorithm>
#include <cmath>

namespace EVP {

static constexpr int AHEAD = 4;    // rows: records are prefetched that much earlier

/// What is the same for all rows.
struct PairListBuilder::View {
  const double (*x)[3];
  const double *radius;
  int excluded;    // bit k: special_bonds has weight 0 for neighbors of kind k
  const int *type, *mask;
  const tagint *tag;
  const int *numneigh, *const *firstneigh;
  AtomBodies bodies;
};

PairListBuilder::Found PairListBuilder::build(const Input &input, PairList &list)
{
  return input.within == Within::ALL ? pack_rows<false>(input, list) : pack_rows<true>(input, list);
}

// Divided: there are pairs of two bodies
template <bool Divided>
PairListBuilder::Found PairListBuilder::pack_rows(const Input &input, PairList &list)
{
  std::swap(last, now);
  now.size = 0;
  last.rows.resize(atom->nlocal, {0, 0});
  now.rows.assign(atom->nlocal, {0, 0});
  list.clear(input.new_pair_margin, input.rules.flows);

  Found found{};
  View view = {scene::rows(atom->x),
               atom->radius,
               0,
               atom->type,
               atom->mask,
               atom->tag,
               input.neighbors->numneigh,
               input.neighbors->firstneigh,
               {atom, input.within}};
  for (int kind = 0; kind < 4; kind++)
    if (force->special_lj[kind] == 0.0) view.excluded |= 1 << kind;
  const int *const ilist = input.neighbors->ilist, inum = input.neighbors->inum;
  for (int ii = 0; ii < inum; ii++) {
    const int i = ilist[ii];
    if (input.bonds && ii + AHEAD < inum) input.bonds->prefetch(ilist[ii + AHEAD]);
    if (!PackedPairs::fits(list.pairs.size(), view.numneigh[i]))
      error->one(FLERR, "Pair evp/lj: more than {} pairs on one MPI rank: use more ranks",
                 PackedPairs::MOST);
    const Room room = list.pairs.room(view.numneigh[i]);
    const int n = pack_row<Divided>(input, view, i, room, list.pairs, found);
    if (n == 0) continue;

    const int first = (int) list.pairs.size();
    list.pairs.add(n);
    list.rows.emplace_back();
    PackedRow &row = list.rows.back();    // copying a whole row would wait for its members
    row.i = i;
    row.first = first;
    row.last = first + n;
  }
  return found;
}

// returns the number of pairs
template <bool Divided>
EVP_INLINE int PairListBuilder::pack_row(const Input &input, const View &view, int i,
                                         const Room &room, const PackedPairs &pairs, Found &found)
{
  static const BondStore::Bonds none;
  const PairRules rules = input.rules;    // apart from what is written
  const BondStore::Bonds &own_records = input.bonds ? input.bonds->of(i) : none;
  const Bond *const records = own_records.data();
  const Range hints = last.rows[i];
  RecordFinder finder(own_records,
                      {last.slots.data() + hints.first, last.slots.data() + hints.last});
  const int *const neighbors = view.firstneigh[i], nneighbors = view.numneigh[i];
  int *const slots = now.room(nneighbors + 1);
  const double own_radius = view.radius[i], own_x[3] = {view.x[i][0], view.x[i][1], view.x[i][2]};
  const int first_law = input.coefficients->index(view.type[i], 0);
  const Law *const laws = &input.coefficients->law(first_law);
  const PairHistory *const histories = input.bonds ? input.bonds->histories_of(i) : nullptr;
  const bool with_new_pairs = rules.contact != Contact::NONE;
  const bool new_repel_only = rules.contact == Contact::REPULSIVE;
  const int implicit_bit = input.implicit_groupbit;
  const int nreact = force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
  const double closest = std::max(1.0 - rules.overlap, COINCIDENT);

  int n = 0, nfound = 0;
  for (int jj = 0; jj < nneighbors; jj++) {
    if (view.excluded >> (neighbors[jj] >> SBBITS & 3) & 1) continue;
    const int j = neighbors[jj] & NEIGHMASK;
    const int record = finder.find(view.tag[j]);
    if (record >= 0) slots[nfound++] = record;
    const bool broken = record >= 0 && histories && histories[record].broken != 0.0;
    const bool is_bond = record >= 0 && !broken;
    if (!is_bond && !with_new_pairs) continue;
    const bool apart = Divided && record < 0 && view.bodies.apart(i, j);

    const double dx = own_x[0] - view.x[j][0], dy = own_x[1] - view.x[j][1],
                 dz = own_x[2] - view.x[j][2];
    const double dsq = dx * dx + dy * dy + dz * dz;
    const double sum_radii = own_radius + view.radius[j];

    const int type = view.type[j];
    const Row &row = laws[type].parameters();
    double deq = is_bond ? records[record].deq : sum_radii;
    if (broken) deq = rules.rest_of_broken(sum_radii, records[record].deq);
    const double dlim = row.alpha * sum_radii;
    const double cut = is_bond              ? rules.cut_of_bond(deq, dlim)
        : broken || new_repel_only || apart ? deq
                                            : dlim;
    const bool implicit = implicit_bit && ((view.mask[i] | view.mask[j]) & implicit_bit);
    const int own = first_law + type, law = implicit ? input.coefficients->undamped(own) : own;
    room.inv_deq[n] = 1.0 / deq;
    room.cutsq[n] = apart ? reach_squared(cut, input.repulsive_margin)
                          : pairs.reach_squared(cut, is_bond);
    room.j[n] = j;
    room.kind[n] = 2 * law + is_bond;
    room.slot[n] = broken ? PackedPair::slot_of_broken(record) : record;
    n++;
    if (!implicit && row.gamma > 0.0) found.damped = true;
    if (is_bond) found.bond_sides += j < nreact ? 2 : 1;

    if (!(dsq >= closest * sum_radii * (closest * sum_radii)))
      count_overlap(i, j, dsq, deq, laws[type], found.overlaps);
  }
  if (room.offset) fill_history(input, view, i, room, n);
  slots[nfound] = RecordFinder::NO_SLOT;
  now.rows[i] = {now.size, now.size + nfound};
  now.size += nfound + 1;
  return n;
}

// contacts that have flowed are few
void PairListBuilder::fill_history(const Input &input, const View &view, int i, const Room &room,
                                   int n)
{
  for (int k = 0; k < n; k++) {
    room.take_history(k, {});
    const bool is_bond = room.kind[k] & 1;
    room.cap[k] = input.coefficients->law(room.kind[k] / 2)
                      .cap(is_bond, !is_bond && only_repels(room.cutsq[k], room.inv_deq[k]));
  }
  if (!input.bonds) return;
  const PairHistory *const histories = input.bonds->histories_of(i);
  const auto &contacts = input.bonds->contacts_of(i);
  for (int k = 0; k < n; k++) {
    if (room.slot[k] >= 0) {
      room.take_history(k, histories[room.slot[k]]);
      continue;
    }
    for (const FlowedContact &contact : contacts)
      if (contact.partner == view.tag[room.j[k]]) {
        room.take_history(k, contact.history);
        break;
      }
  }
}

// without newton both owners of a pair across MPI ranks hold it; one of them counts it
void PairListBuilder::count_overlap(int i, int j, double dsq, double deq, const Law &law,
                                    Overlaps &overlaps) const
{
  const double coincident = COINCIDENT * (atom->radius[i] + atom->radius[j]);
  if (!(dsq > coincident * coincident))
    error->one(FLERR,
               "Pair evp/lj: atoms {} and {} coincide, the force has no direction there: move one "
               "or delete it (delete_atoms overlap)",
               atom->tag[i], atom->tag[j]);
  if (!force->newton_pair && j >= atom->nlocal && atom->tag[i] > atom->tag[j]) return;
  if (overlaps.count++) return;
  const double d = std::sqrt(dsq);
  overlaps = {1, atom->tag[i], atom->tag[j], d, deq, law.regime(d, deq)};
}

}    // namespace EVP
