// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/pairs/pair_list_builder.h"

#include "lammps/base/scene.h"

#include "domain.h"
#include "neigh_list.h"
#include "neighbor.h"

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
};

PairListBuilder::Found PairListBuilder::build(const Input &input, PairLists &lists)
{
  lists.build++;
  lists.bonds.clear(BOND_MARGIN, input.rules.flow_of_bonds());
  lists.contacts.clear(input.rules.contact_margin(false, input.any_damping),
                       input.rules.flow_of_contacts());
  lists.contacts.joins = input.rules.joins();
  lists.bonds.joins = input.rules.joins() && input.bonds && input.bonds->notes_joined();

  Found found{};
  View view = {scene::rows(atom->x),
               atom->radius,
               0,
               atom->type,
               atom->mask,
               atom->tag,
               input.neighbors->numneigh,
               input.neighbors->firstneigh};
  for (int kind = 0; kind < 4; kind++)
    if (force->special_lj[kind] == 0.0) view.excluded |= 1 << kind;
  const int *const ilist = input.neighbors->ilist, inum = input.neighbors->inum;
  for (int ii = 0; ii < inum; ii++) {
    const int i = ilist[ii];
    if (input.bonds && ii + AHEAD < inum) input.bonds->prefetch(ilist[ii + AHEAD]);
    for (PairList *list : {&lists.bonds, &lists.contacts})
      demand_room(*list, view.numneigh[i], error);
    pack_row(input, view, i, lists, found);
  }
  return found;
}

namespace {

  /// Where the pairs of a row go, apart from the list: the compiler need not read its pointers again.
  struct Room {
    double *inv_deq, *cutsq;
    int *j, *law;
    int n = 0;

    explicit Room(PairList &list) :
        inv_deq(list.inv_deq.data() + list.size()), cutsq(list.cutsq.data() + list.size()),
        j(list.j.data() + list.size()), law(list.law.data() + list.size())
    {
    }
    EVP_INLINE void add(double deq_in, double cutsq_in, int j_in, int law_in)
    {
      inv_deq[n] = 1.0 / deq_in;
      cutsq[n] = cutsq_in;
      j[n] = j_in;
      law[n] = law_in;
      n++;
    }
  };

}    // namespace

EVP_INLINE void PairListBuilder::pack_row(const Input &input, const View &view, int i,
                                          PairLists &lists, Found &found)
{
  static const BondStore::Bonds none;
  const PairRules rules = input.rules;    // apart from what is written
  const BondStore::Bonds &own_records = input.bonds ? input.bonds->of(i) : none;
  const BondRecord *const records = own_records.data(),
                          *const records_end = records + own_records.size();
  const int *const neighbors = view.firstneigh[i], nneighbors = view.numneigh[i];
  const double own_radius = view.radius[i], own_x[3] = {view.x[i][0], view.x[i][1], view.x[i][2]};
  const int first_law = input.coefficients->index(view.type[i], 0);
  const PairLaw *const laws = &input.coefficients->law(0);
  // mostly none
  const bool may_remember =
      input.bonds && input.bonds->has_history() && !input.bonds->remembered_of(i).empty();
  const bool may_divide = input.within != BodyRule::ALL;
  const bool with_contacts = rules.contact != Contact::NONE;
  const double margin_between_bodies = rules.contact_margin(true, input.any_damping);
  const int implicit_bit = input.implicit_groupbit;
  const double closest = std::max(1.0 - rules.overlap, COINCIDENT);
  const bool joins = rules.joins(), looks_first = input.looks_first;
  const double inside = APART * rules.join.within;
  const bool join_all = rules.joins_bodies_at_once();
  const bool notes_joined = lists.bonds.joins;
  const double skin = neighbor->skin;
  std::vector<char> &join = lists.contacts.join, &has_joined = lists.bonds.join;
  Room bonds(lists.bonds), contacts(lists.contacts);

  for (int jj = 0; jj < nneighbors; jj++) {
    if (view.excluded >> (neighbors[jj] >> SBBITS & 3) & 1) continue;
    const int j = neighbors[jj] & NEIGHMASK;
    const BondRecord *const bond = BondStore::find(records, records_end, view.tag[j]);
    const bool is_bond = bond != nullptr;
    if (!is_bond && !with_contacts) continue;

    const double dx = own_x[0] - view.x[j][0], dy = own_x[1] - view.x[j][1],
                 dz = own_x[2] - view.x[j][2];
    const double dsq = dx * dx + dy * dy + dz * dz;
    const double sum_radii = own_radius + view.radius[j];

    int law = first_law + view.type[j];
    const Row &row = laws[law].row;
    const double dlim = row.alpha * sum_radii;
    const bool implicit = implicit_bit && ((view.mask[i] | view.mask[j]) & implicit_bit);
    if (implicit) law = input.coefficients->undamped(law);
    Span span;
    if (is_bond) {
      // in a box of few cutoffs a neighbor list holds several images of a partner
      if (dsq > dlim * dlim && domain->minimum_image_check(dx, dy, dz)) continue;
      span = rules.of_bond(bond->deq, dlim);
      bonds.add(span.deq, lists.bonds.cutoff_squared(span.cutoff), j, law);
      if (notes_joined) {
        const Remembered *const kept = may_remember ? input.bonds->find_remembered(i, view.tag[j])
                                                    : nullptr;
        has_joined.push_back(kept && kept->kind == Remembered::JOINED ? PairList::HAS_JOINED : 0);
      }
      found.bond_sides += j < lists.nreact ? 2 : 1;
    } else {
      const Remembered *const kept = may_remember ? input.bonds->find_remembered(i, view.tag[j])
                                                  : nullptr;
      if (!kept && stays_beyond(dsq, dlim, skin)) continue;
      const bool apart = kept && kept->kind == Remembered::APART;
      const bool divided = may_divide && !apart && in_different_bodies(atom, input.within, i, j);
      if (divided) law = input.coefficients->between_bodies(law);
      span = apart ? rules.of_ended(sum_radii, kept->deq)
                   : rules.of_contact(sum_radii, dlim, divided);
      if (kept) span.deq = std::min(span.deq, kept->deq);
      if (joins) {
        const bool is_inside = looks_first ? dsq <= inside * inside * sum_radii * sum_radii
                                           : kept && kept->kind == Remembered::INSIDE;
        join.push_back((char) ((divided && !join_all ? PairList::OF_TWO_BODIES : 0) |
                               (is_inside ? PairList::NOT_BEFORE_APART : 0)));
      }
      contacts.add(span.deq,
                   divided ? cutoff_squared(span.cutoff, margin_between_bodies)
                           : lists.contacts.cutoff_squared(span.cutoff),
                   j, law);
    }
    if (!implicit && row.gamma > 0.0) found.damped = true;

    if (!(dsq >= closest * sum_radii * (closest * sum_radii)))
      count_overlap(i, j, dsq, span.deq, found.overlaps);
  }
  lists.bonds.add_row(i, bonds.n);
  lists.contacts.add_row(i, contacts.n);
}

// without newton both owners of a pair across MPI ranks hold it; one of them counts it
void PairListBuilder::count_overlap(int i, int j, double dsq, double deq, Overlaps &overlaps) const
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
  overlaps = {1, atom->tag[i], atom->tag[j], d, deq};
}

}    // namespace EVP
