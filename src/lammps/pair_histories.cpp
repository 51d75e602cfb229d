// SPDX-License-Identifier: GPL-2.0-only

#include "pair_histories.h"

#include "collective.h"
#include "pair_list_builder.h"
#include "scene.h"

#include "comm.h"
#include "irregular.h"
#include "neighbor.h"

#include <algorithm>
#include <utility>

namespace EVP {

void PairHistories::commit(bool at_rest, PairWork *work, VolumeForces *volume)
{
  due = true;
  if (at_rest) {
    past.clear();
    for (PairList *list : {&lists.bonds, &lists.contacts}) find_next(*list);
  }
  for (PairList *list : {&lists.bonds, &lists.contacts}) list->commit();
  if (past.empty()) return;
  break_bonds(past, work, volume);
  past.clear();
}

bool PairHistories::would_change() const
{
  const auto any = [](const PairList &list) {
    return std::count(list.any_flow.begin(), list.any_flow.end(), 1) > 0;
  };
  return !past.empty() || any(lists.bonds) || any(lists.contacts);
}

// what the force loop finds, at the present positions
void PairHistories::find_next(PairList &list)
{
  std::fill(list.any_flow.begin(), list.any_flow.end(), 1);
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (rules.breaks() && p.is_bond && p.is_past_cutoff()) past.push_back(p.index);
    if (!list.stays()) return;
    const PairState now = coefficients.law(p.law).state(p.ratio(), p);
    const bool parted = p.is_past_cutoff() && !p.is_bond;
    list.q_new[p.index] = parted ? 0.0 : now.offset.q;
    list.dissipated[p.index] = parted ? 0.0 : now.dissipated;
  });
}

void PairHistories::break_bonds(const std::vector<int> &broken, PairWork *work,
                                VolumeForces *volume)
{
  PairList &contacts = lists.contacts;
  for (const int k : broken) {
    const PackedPair bond = lists.bonds[k];
    const int i = lists.bonds.owner_of(k);
    newly_broken.push_back({i, bond.j, lists.bonds.history_of(k).work});
    const double ratio = bond.cut * bond.inv_deq;
    if (work)
      work->add_broken(rank_share(bond.j, lists.nreact) *
                       coefficients.law(bond.law).state(ratio, bond).stored.total());
    if (volume) volume->pair_leaves(lists, i, bond.j, 1.0 / lists.bonds.inv_dlim[k]);
    const Span left = rules.of_broken(atom->radius[i] + atom->radius[bond.j], 1.0 / bond.inv_deq);
    if (left.cutoff == 0.0) continue;
    demand_room(contacts, 1, error);
    // its cutoff is its deq
    contacts.set(contacts.size(), bond.j, left.deq, bond.law, bond.record);
    contacts.add_row(i, 1);
  }
  lists.bonds.remove(broken);
  lists.build++;
}

void PairHistories::return_to(BondStore &records, PerAtomComm &exchange)
{
  if (!due) return;
  due = false;
  send_to_owners(records, exchange);
  newly_broken.clear();
  warn_of_limit();
}

// Atoms and ghosts are those that the list was packed for. Without newton both owners of a pair across MPI ranks, or
// across a periodic boundary, hold a copy: that of the atom with the lower ID is taken for both
void PairHistories::send_to_owners(BondStore &records, PerAtomComm &exchange)
{
  const tagint *tag = atom->tag;
  const int nlocal = atom->nlocal, newton = force->newton_pair;

  PerAtomComm::Values owner((size_t) 3 * (nlocal + atom->nghost),
                            0.0);    // rank, local index
  for (int i = 0; i < nlocal; i++) {
    owner[(size_t) 3 * i] = comm->me;
    owner[(size_t) 3 * i + 1] = i;
  }
  exchange.forward_comm(owner);

  records.clear_contacts();
  std::vector<HistoryOfPair> messages;
  std::vector<int> ranks;
  const auto post = [&](int ghost, int own, bool is_record, const PairHistory &h) {
    ranks.push_back((int) owner[(size_t) 3 * ghost]);
    messages.push_back({(int) owner[(size_t) 3 * ghost + 1], is_record, tag[own], h});
  };
  const auto send = [&](int i, int j, bool is_record, const PairHistory &h) {
    if (j < nlocal) {
      records.take({i, is_record, tag[j], h});
      records.take({j, is_record, tag[i], h});
    } else if (newton || tag[i] < tag[j]) {
      records.take({i, is_record, tag[j], h});
      post(j, i, is_record, h);
    }
  };
  // either copy of a bond may have met its cutoff alone, by round-off: that breaks both
  std::vector<HistoryOfPair> deferred;
  for (const BrokenBond &bond : newly_broken) {
    const PairHistory h = {0.0, 0.0, bond.work, 1.0};
    if (bond.j < nlocal || newton || tag[bond.i] < tag[bond.j]) {
      send(bond.i, bond.j, true, h);
      continue;
    }
    post(bond.j, bond.i, true, h);
    deferred.push_back({bond.i, true, tag[bond.j], h});
  }
  for (const PairList *list : {&lists.bonds, &lists.contacts})
    for (const PackedRow &row : list->rows)
      for (int k = row.first; list->stays() && k < row.last; k++) {
        const PairHistory h = list->history_of(k);
        if (!(h == PairHistory{})) send(row.i, list->j[k], list->are_bonds, h);
      }

  Irregular irregular(lmp);
  const int n = irregular.create_data((int) messages.size(), ranks.data(), 1);
  std::vector<HistoryOfPair> received(n);
  irregular.exchange_data((char *) messages.data(), sizeof(HistoryOfPair),
                          (char *) received.data());
  irregular.destroy_data();
  for (const HistoryOfPair &m : received) records.take(m);
  for (const HistoryOfPair &m : deferred) records.take(m);
}

int64_t PairHistories::find_missing(const BondStore &store)
{
  missing.clear();
  int64_t without_pair = 0;
  const auto *x = scene::rows(atom->x);
  const double *const *cutneighsq = neighbor->cutneighsq;
  std::vector<std::pair<tagint, int>> atoms;    // own and ghosts: of an ID there may be many
  for (int k = 0; k < atom->nlocal + atom->nghost; k++) atoms.emplace_back(atom->tag[k], k);
  std::sort(atoms.begin(), atoms.end());

  const auto add = [&](int i, int slot, const AtomDirectory::Entry &partner) {
    if (partner.type != 0 && types.handles(atom->type[i], partner.type))
      missing.push_back({i, slot, partner.type, partner.radius});
    else
      without_pair++;
  };

  std::vector<std::pair<int, int>> far_away;    // atom, slot: the partner is not even a ghost
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (int slot = 0; slot < (int) store.of(i).size(); slot++) {
      const auto partner = (tagint) store.of(i)[slot].partner;
      auto at = std::lower_bound(atoms.begin(), atoms.end(), std::pair(partner, 0));
      if (at == atoms.end() || at->first != partner) {
        far_away.emplace_back(i, slot);
        partners.push_back(partner);
        continue;
      }
      const int j = at->second;
      bool is_near = false;
      for (; at != atoms.end() && at->first == partner; ++at)
        is_near = is_near ||
            PairGeometry(x, i, at->second).dsq <= cutneighsq[atom->type[i]][atom->type[j]];
      if (!is_near || !types.handles(atom->type[i], atom->type[j]))
        add(i, slot, {atom->type[j], atom->radius[j]});
    }

  if (on_any(!partners.empty(), world)) {
    const AtomDirectory directory(lmp, partners);
    for (size_t k = 0; k < partners.size(); k++)
      add(far_away[k].first, far_away[k].second, directory.entries.at(partners[k]));
  }
  return (int64_t) missing.size() + without_pair;
}

PairHistories::Missing PairHistories::settle_missing(const BondStore &store, BondStore *moved,
                                                     VolumeForces *volume) const
{
  Missing found;
  for (const MissingBond &one : missing) {
    const Bond &bond = store.of(one.i)[one.slot];
    const PairHistory before = store.has_history() ? store.histories_of(one.i)[one.slot]
                                                   : PairHistory{};
    if (before.broken != 0.0) continue;
    const PairLaw &law = coefficients.law(coefficients.index(atom->type[one.i], one.type));
    const Span span = rules.of_bond(bond.deq, law.row.alpha * (atom->radius[one.i] + one.radius));
    const PairState at = law.state(span.cutoff / bond.deq,
                                   {1.0 / bond.deq, rules.flow_of_bonds(), {before.q, before.k}});
    found.held += 0.5 * at.stored.total();    // a bond of two MPI ranks counts half on each
    found.dissipated += 0.5 * at.dissipated;
    if (volume) volume->far_bond_leaves(one.i, bond.deq, law.row.alpha, one.radius);
    if (!moved) continue;
    const double work = before.work + at.dissipated;
    moved->take(one.i, one.slot,
                rules.breaks() ? PairHistory{0.0, 0.0, work, 1.0}
                               : PairHistory{at.offset.q, at.offset.k, work, 0.0});
  }
  return found;
}

// once per run
void PairHistories::warn_of_limit()
{
  if (!rules.plastic || limit_warned) return;
  double strain = 0.0;    // the largest elastic limit beyond that of the largest force
  int last = -1;
  double strongest = 0.0;
  for (size_t n = 0; n < lists.bonds.size(); n++) {
    const PairLaw &law = coefficients.law(lists.bonds.law[n]);
    if (lists.bonds.law[n] != std::exchange(last, lists.bonds.law[n]))
      strongest = law.strongest_strain();
    const double limit = law.limit(lists.bonds.k[n]);
    if (limit > strongest) strain = std::max(strain, limit);
  }
  strain = reduce_all(strain, MPI_MAX, world);
  limit_warned = strain > 0.0;
  if (limit_warned && comm->me == 0)
    error->warning(FLERR,
                   "Pair evp/lj: the elastic limit of bonds has grown to a strain of {:.3g}, "
                   "beyond that of the largest force in tension: they soften from now on; give the "
                   "row a 'saturation', or a smaller e2",
                   strain);
}

}    // namespace EVP
