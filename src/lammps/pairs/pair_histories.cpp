// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/pairs/pair_histories.h"

#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/pairs/pair_list_builder.h"

#include "comm.h"
#include "domain.h"
#include "irregular.h"
#include "neighbor.h"

#include <algorithm>
#include <utility>

namespace EVP {

void PairHistories::begin_run(BondStore *records_in, PerAtomComm *exchange_in, bool keeps_events_in)
{
  keeps_events = keeps_events_in;
  records = records_in;
  exchange = exchange_in;
  update_due = false;
  starts = true;
  owners = {};
  ends.owners = begins.owners = &owners;
  ends.criteria.clear();
  begins.within = rules.join.within * rules.join.within;
  begins.apart = APART * APART * begins.within;
  every = rules.update_every(effects.any(&Effect::updates_each_step));
}

// Collective. Have temperatures, strain rates or plastic strains become others between runs?
bool PairHistories::was_changed() const
{
  return on_any(effects.any(&Effect::was_changed), world);
}

// by the number of the step, so that neither neighbor builds nor MPI ranks nor restarts matter
void PairHistories::begin_step()
{
  if (update->whichflag != 1) return;
  const bool is_first = update->ntimestep == update->firststep + 1;
  update_due = (rules.plastic && update->ntimestep % every == 0) || effects.any(&Effect::is_due) ||
      (is_first && was_changed());
}

// in a minimization limits are held from its start on
void PairHistories::begin_forces()
{
  const bool is_minimization = update->whichflag == 2;
  if (std::exchange(starts, false) && is_minimization) update_due = was_changed();
  if (std::exchange(update_due, false))
    update_effects(is_minimization ? Sharing::BEGINS : Sharing::UPDATED);
  find_owners();
}

void PairHistories::note_packing()
{
  ends.clear();
  begins.clear();
  if (rules.has_history()) note_images();
  share(Sharing::PACKED);
}

// Collective. Where both owners of a pair hold it: by how many periods ghosts are away from their owners
void PairHistories::note_images()
{
  owners = {};
  if (force->newton_pair || !(domain->xperiodic || domain->yperiodic || domain->zperiodic)) return;
  owners.acts = true;
  owners.nlocal = lists.nlocal;
  owners.x.assign(lists.nall, 0.0);
  periods.assign(lists.nall, 0.0);
  find_owners();
  const double *const h_inv = domain->h_inv;    // xx yy zz yz xz xy
  for (int j = lists.nlocal; j < lists.nall; j++) {
    const Vector away = Vector(atom->x[j]) - Vector(owners.x[j]);
    const Vector in_boxes = {h_inv[0] * away.x + h_inv[5] * away.y + h_inv[4] * away.z,
                             h_inv[1] * away.y + h_inv[3] * away.z, h_inv[2] * away.z};
    Vector(std::round(in_boxes.x), std::round(in_boxes.y), std::round(in_boxes.z))
        .store(periods[j]);
  }
}

// Collective, before forces
void PairHistories::find_owners()
{
  if (owners.empty()) return;
  for (int i = 0; i < lists.nlocal; i++) std::copy_n(atom->x[i], 3, owners.x[i]);
  exchange->forward_comm(owners.x);
  const double *const h = domain->h;
  owners.shifts.resize(lists.nall);
  for (int j = 0; j < lists.nall; j++) {
    const Vector n(periods[j]);
    Vector(n.x * h[0] + n.y * h[5] + n.z * h[4], n.y * h[1] + n.z * h[3], n.z * h[2])
        .store(owners.shifts[j]);
  }
}

// Collective. What atoms tell their ghosts
void PairHistories::share(Sharing when)
{
  int width = 0;
  effects.for_each([&](const Effect &one) {
    width += one.shared_width(when);
  });
  if (width == 0) return;
  AtomValues values(width, lists.nall);
  const auto for_each_part = [&](auto &&f) {
    int first = 0;
    effects.for_each([&](Effect &one) {
      const int own = one.shared_width(when);
      if (own > 0) f(one, ValuesOfAtoms{values, first});
      first += own;
    });
  };
  for_each_part([when](const Effect &one, const ValuesOfAtoms &part) {
    one.put_shared(when, part);
  });
  exchange->forward_comm(values);
  for_each_part([when](Effect &one, const ValuesOfAtoms &part) {
    one.set_shared(when, part);
  });
  ends.criteria.clear();
  joining = nullptr;
  if (update->whichflag != 2)
    find_criteria();    // a minimization changes nothing before it is at rest
}

void PairHistories::find_criteria()
{
  effects.for_each([this](const Effect &one) {
    if (const FailureCriterion *const own = one.failure()) ends.criteria.push_back(own);
    if (const JoiningCriterion *const own = one.joining()) joining = own;
  });
}

void PairHistories::update_effects(Sharing when)
{
  due = true;
  effects.for_each([](Effect &one) {
    one.begin_update();
  });
  effects.for_each([](Effect &one) {
    one.update_effect();
  });
  share(when);
  if (when == Sharing::UPDATED && joining) join_bodies();
}

void PairHistories::commit()
{
  due = due || rules.has_history();
  effects.for_each([](Effect &one) {
    one.commit();
  });
  end_bonds();
  end_unlisted_bonds();
  if (rules.joins()) begin_bonds();
  effects.for_each([](Effect &one) {
    one.committed();
  });
}

bool PairHistories::would_change() const
{
  const auto any = [](const PairList &list) {
    return std::count(list.any_flow.begin(), list.any_flow.end(), 1) > 0;
  };
  return !ends.found.empty() || !begins.found.empty() || !unlisted.empty() || any(lists.bonds) ||
      any(lists.contacts);
}

// by the force loop, at the present positions, where bonds fail too: a minimization leaves that to its end
void PairHistories::find_next()
{
  AtomValues scratch(3, lists.nall);
  const ParticleView view = {scene::rows(atom->x), nullptr, scratch.rows(), lists.nreact};
  find_owners();
  ends.clear();
  ends.criteria.clear();
  find_criteria();
  accumulate_forces(lists.bonds, coefficients.block_law(lists.bonds), view, {&ends});
  std::vector<PairConsumer *> of_contacts;
  if (BeginningBonds *const found = beginning_to_find()) of_contacts.push_back(found);
  accumulate_forces(lists.contacts, coefficients.block_law(lists.contacts), view, of_contacts);
}

// at the end of a step, when deq has moved
void PairHistories::end_bonds()
{
  if (ends.found.empty()) return;
  for (size_t n = 0; n < ends.found.size(); n++) {
    const int k = ends.found[n], i = lists.bonds.owner_of(k);
    const PackedPair bond = lists.bonds.pair(k);
    const double d = bond.up_to_cutoff(ends.squared_distances[n]);
    const double sum_radii = this->sum_radii(i, bond.j);
    const Span left = rules.of_ended(sum_radii, d);
    const double dlim = coefficients.law(bond.law).row.alpha * sum_radii;
    const bool failed = d < dlim * (1.0 - BOND_MARGIN);
    journal.push_back({i, bond.j, atom->tag[bond.j], left.deq / lists.growth_of(i, bond.j),
                       failed ? PairEvent::FAILED : PairEvent::ENDED});
    note_event(i, bond.j, atom->tag[bond.j], failed ? BondEvent::FAILED : BondEvent::AT_DLIM);
    const EndingPair pair = {k, i, bond.j,
                             coefficients.law(bond.law).state(d * bond.inv_deq, bond).stored};
    effects.for_each([&](Effect &one) {
      one.bond_ends(pair);
    });
    if (left.cutoff > 0.0) add_contact(i, bond, d, left);
  }
  lists.bonds.remove(ends.found);
  ends.clear();
  lists.build++;
}

// of own atom i and j
void PairHistories::note_event(int i, int j, tagint partner, BondEvent::Why why)
{
  if (keeps_events && !is_copy(i, j)) add_event(i, partner, Vector(atom->x[j]), why);
}

void PairHistories::add_event(int i, tagint partner, const Vector &place_of_partner,
                              BondEvent::Why why)
{
  const tagint own = atom->tag[i];
  BondEvent event = {update->ntimestep, why, std::min(own, partner), std::max(own, partner), {}};
  ((Vector(atom->x[i]) + place_of_partner) * 0.5).store(event.place);
  domain->remap(event.place);
  events.push_back(event);
}

// what is left of a bond that ended at d, as the next packing finds it
void PairHistories::add_contact(int i, const PackedPair &bond, double d, const Span &left)
{
  PairList &contacts = lists.contacts;
  const bool divided = rules.plastic && in_different_bodies(atom, records->within, i, bond.j);
  const int law = divided ? coefficients.between_bodies(bond.law) : bond.law;
  demand_room(contacts, 1, error);
  contacts.set(contacts.size(), bond.j, left.deq, left.cutoff, law);
  if (rules.plastic)
    contacts.limit[contacts.size()] =
        lists.limit_of(contacts, coefficients.law(law).own_limit, i, bond.j);
  contacts.add_row(i, 1);
  if (!contacts.joins) return;
  if (divided && !rules.joins_bodies_at_once()) contacts.join.back() |= PairList::OF_TWO_BODIES;
  if (!(d > APART * rules.join.within * left.cutoff))
    contacts.join.back() |= PairList::NOT_BEFORE_APART;
}

bool PairHistories::is_barred(int k) const
{
  const int i = lists.contacts.owner_of(k), j = lists.contacts.j[k];
  return std::any_of(ends.criteria.begin(), ends.criteria.end(),
                     [i, j](const FailureCriterion *one) {
                       return one->bars_joining(i, j);
                     });
}

void PairHistories::leave_out_barred()
{
  if (ends.criteria.empty()) return;
  size_t kept = 0;
  for (size_t n = 0; n < begins.found.size(); n++) {
    if (is_barred(begins.found[n])) continue;
    begins.squared_distances[kept] = begins.squared_distances[n];
    begins.found[kept++] = begins.found[n];
  }
  begins.found.resize(kept);
  begins.squared_distances.resize(kept);
}

// likewise
void PairHistories::begin_bonds()
{
  PairList &contacts = lists.contacts;
  for (const int k : begins.released) contacts.join[k] &= ~PairList::NOT_BEFORE_APART;
  for (const int k : begins.entered) contacts.join[k] |= PairList::NOT_BEFORE_APART;
  leave_out_barred();
  for (size_t n = 0; n < begins.found.size(); n++) {
    const int k = begins.found[n], i = contacts.owner_of(k);
    const PackedPair contact = contacts.pair(k);
    const double d = std::sqrt(begins.squared_distances[n]);
    if (d < contact.cut * rules.join.within / APART && !is_copy(i, contact.j)) jumps++;
    begin_bond(k, i, d);
  }
  contacts.remove(begins.found);
  if (!begins.found.empty()) lists.build++;
  begins.clear();
}

// A contact that repels goes on to do so, as far as the bond holds; what it has stored beyond that is lost. Returns the force that is
// lost
double PairHistories::begin_bond(int k, int i, double d)
{
  PairList &bonds = lists.bonds;
  const PackedPair contact = lists.contacts.pair(k);
  const int law = coefficients.within_body(contact.law);
  const double limit = lists.limit_of(bonds, coefficients.law(law).own_limit, i, contact.j);
  const double pressed = std::max(0.0, 1.0 - d * contact.inv_deq);
  const double deq = d / (1.0 - std::min(pressed, limit));
  demand_room(bonds, 1, error);
  bonds.set(bonds.size(), contact.j, deq, coefficients.law(law).row.alpha * sum_radii(i, contact.j),
            law);
  bonds.limit[bonds.size()] = limit;
  bonds.add_row(i, 1);
  if (bonds.joins) bonds.join.back() = PairList::HAS_JOINED;
  const PackedPair bond = bonds.pair(bonds.size() - 1);
  const PairState before = coefficients.law(contact.law).state(d * contact.inv_deq, contact),
                  now = coefficients.law(law).state(d * bond.inv_deq, bond);
  const EndingPair pair = {
      k,
      i,
      contact.j,
      {before.stored.elastic - now.stored.elastic, before.stored.second - now.stored.second}};
  effects.for_each([&](Effect &one) {
    one.contact_joins(pair);
  });
  journal.push_back(
      {i, contact.j, atom->tag[contact.j], deq / lists.growth_of(i, contact.j), PairEvent::BEGAN});
  note_event(i, contact.j, atom->tag[contact.j], BondEvent::JOINED);
  return before.force - now.force;
}

// Collective, at an update in a run, before its forces: contacts of two bodies that meet the criterion. Whether they have been apart
// does not matter, as that keeps those from joining that are near without a reason
void PairHistories::join_bodies()
{
  find_owners();
  step_work.begin(lists, effects, *exchange);
  PairList &contacts = lists.contacts;
  const auto *const x = scene::rows(atom->x);
  std::vector<int> joined;
  double dissipated = 0.0;
  for (const PackedRow &row : contacts.rows)
    for (int k = row.first; k < row.last; k++) {
      if (!(contacts.join[k] & PairList::OF_TWO_BODIES)) continue;
      const int i = row.i, j = contacts.j[k];
      const PlacedPair p{contacts.pair(k), i, k, k, PairGeometry(x, i, j)};
      const Vector r = owners.has(j) ? owners.between(i, j) : Vector(p.g);
      if (dot(r, r) > begins.within * p.cutsq || is_barred(k) || !joining->may_join(i, j, r))
        continue;
      const double lost = begin_bond(k, i, std::sqrt(dot(r, r)));
      dissipated -= rank_share(j, lists.nreact) * step_work.of(p, lost);
      joined.push_back(k);
    }
  contacts.remove(joined);
  if (!joined.empty()) lists.build++;
  effects.for_each([dissipated](Effect &one) {
    one.add_dissipated(dissipated);
  });
}

// each on the ranks of both of its atoms, of which that of the lower ID notes the event
void PairHistories::end_unlisted_bonds()
{
  if (!rules.has_history()) return;
  for (size_t n = 0; n < unlisted.size(); n++) {
    const UnlistedBond &bond = unlisted[n];
    const double rest = rules.of_ended(atom->radius[bond.i] + bond.radius, bond.cutoff).deq;
    journal.push_back({bond.i, -1, (tagint) bond.partner, rest,
                       bond.at_dlim ? PairEvent::ENDED : PairEvent::FAILED});
    if (keeps_events && atom->tag[bond.i] < bond.partner)
      add_event(bond.i, (tagint) bond.partner, unlisted_partners[n],
                bond.at_dlim ? BondEvent::AT_DLIM : BondEvent::FAILED);
  }
  effects.for_each([this](Effect &one) {
    one.unlisted_bonds_end(unlisted);
  });
  clear_unlisted();
}

void PairHistories::return_to(const BondStore &store)
{
  if (&store != records) return;
  const bool are_due = std::exchange(due, false);
  effects.for_each([are_due](Effect &one) {
    one.return_to_records(are_due);
  });
  if (are_due) return_due();
}

void PairHistories::return_due()
{
  if (rules.plastic) add_moves();
  add_changes();
  send_to_owners();
  if (rules.joins()) warn_of_jumps();
  journal.clear();
}

// Collective
void PairHistories::warn_of_jumps()
{
  const bigint all = reduce_all(std::exchange(jumps, 0), MPI_SUM, world);
  if (all == 0 || std::exchange(jumps_told, true) || comm->me) return;
  error->warning(
      FLERR,
      "Pair evp/lj: {} pairs that joined until step {} had come nearer than {:.4g} (R_i + "
      "R_j) in the step in which they came within {}: what they had stored as a contact beyond "
      "the limit of a bond is lost; use a smaller timestep, or fix dt/evp (said once)",
      all, update->ntimestep, rules.join.within / APART, rules.join.within);
}

void PairHistories::apply(const PairEvent &event)
{
  const auto remember = [&](Remembered::Kind kind) {
    if (!records->find_remembered(event.i, event.partner))
      records->remembered_of(event.i).push_back({event.partner, event.deq, kind});
  };
  if (event.what == PairEvent::CHANGED)
    records->set(event.i, event.partner, BOND_VALUES[event.line].value, event.deq);
  else if (event.what == PairEvent::REMEMBERED)
    remember(Remembered::CONTACT);
  else if (event.what == PairEvent::INSIDE)
    remember(Remembered::INSIDE);
  else if (event.what == PairEvent::JOINED)
    remember(Remembered::JOINED);
  else if (event.what == PairEvent::BEGAN)
    records->begin(event.i, event.partner, event.deq);
  else {
    records->end(event.i, event.partner, event.what == PairEvent::FAILED);
    if (!rules.plastic) remember(Remembered::APART);
  }
}

// Where deq has moved, by the lists. Without newton both owners of a pair across MPI ranks, or across a periodic boundary,
// hold a copy: that of the atom with the lower ID is taken for both
void PairHistories::add_moves()
{
  const tagint *tag = atom->tag;
  for (int i = 0; i < lists.nlocal; i++) records->remembered_of(i).clear();
  for (const PairList *list : {&lists.bonds, &lists.contacts})
    for (const PackedRow &row : list->rows)
      for (int k = row.first; k < row.last; k++) {
        const int i = row.i, j = list->j[k];
        if (is_copy(i, j)) continue;
        const double inv_deq = list->inv_deq[k], growth = lists.growth_of(i, j);
        const auto note = [&](PairEvent::What what) {
          journal.push_back({i, j, tag[j], 1.0 / (inv_deq * growth), what});
        };
        if (list->are_bonds) {    // one that began since is not in the records yet
          const BondRecord *const bond = records->find(i, tag[j]);
          if (!bond || 1.0 / bond->deq / growth != inv_deq) note(PairEvent::CHANGED);
          if (list->joins && list->join[k] != 0) note(PairEvent::JOINED);
        } else if (list->joins && (list->join[k] & PairList::NOT_BEFORE_APART))
          note(PairEvent::INSIDE);
        // contacts end at R_i + R_j as these were packed
        else if (inv_deq * list->pair(k).cut > 1.0 + CONTACT_MARGIN)
          note(PairEvent::REMEMBERED);
      }
}

// What effects have changed in columns of the bonds
void PairHistories::add_changes()
{
  for (const PairList::Column &column : lists.bonds.columns)
    for (const PackedRow &row : lists.bonds.rows)
      for (int k = row.first; column.line >= 0 && k < row.last; k++) {
        const int j = lists.bonds.j[k];
        if (is_copy(row.i, j)) continue;
        const BondRecord *const bond = records->find(row.i, atom->tag[j]);
        const double now = column.values[k];
        if (now != (bond ? bond->*BOND_VALUES[column.line].value : column.of_new))
          journal.push_back({row.i, j, atom->tag[j], now, PairEvent::CHANGED, column.line});
      }
}

// Atoms and ghosts are those that the list was packed for
void PairHistories::send_to_owners()
{
  const int nlocal = lists.nlocal;
  AtomValues owner(2, lists.nall);    // rank, local index
  for (int i = 0; i < nlocal; i++) {
    owner[i][0] = comm->me;
    owner[i][1] = i;
  }
  exchange->forward_comm(owner);

  std::vector<PairEvent> messages;
  std::vector<int> ranks;
  for (const PairEvent &event : journal) {
    if (event.j >= 0 && is_copy(event.i, event.j)) continue;
    apply(event);
    if (event.j < 0) continue;
    PairEvent other = {event.j, -1, atom->tag[event.i], event.deq, event.what, event.line};
    if (event.j < nlocal) {
      apply(other);
      continue;
    }
    other.i = (int) owner[event.j][1];
    ranks.push_back((int) owner[event.j][0]);
    messages.push_back(other);
  }
  Irregular irregular(lmp);
  const int n = irregular.create_data((int) messages.size(), ranks.data(), 1);
  std::vector<PairEvent> received(n);
  irregular.exchange_data((char *) messages.data(), sizeof(PairEvent), (char *) received.data());
  irregular.destroy_data();
  for (const PairEvent &event : received) apply(event);
}

// Collective. Of atoms by ID, on any MPI rank
std::vector<Vector> PairHistories::places_of(const std::vector<tagint> &ids) const
{
  std::vector<double> coordinates(atom->nlocal);
  AtomValues found(3, ids.size());
  for (int c = 0; c < 3; c++) {
    for (int i = 0; i < atom->nlocal; i++) coordinates[i] = atom->x[i][c];
    const AtomDirectory directory(lmp, ids, coordinates.data());
    for (size_t k = 0; k < ids.size(); k++) found[k][c] = directory.entries.at(ids[k]).value;
  }
  std::vector<Vector> places(ids.size());
  for (size_t k = 0; k < ids.size(); k++) places[k] = Vector(found[k]);
  return places;
}

int64_t PairHistories::find_unlisted()
{
  clear_unlisted();
  int64_t without_pair = 0;
  std::vector<std::pair<int, tagint>> deleted;    // atom, partner
  const auto *x = scene::rows(atom->x);
  const double *const *cutneighsq = neighbor->cutneighsq;
  std::vector<std::pair<tagint, int>> atoms;    // own and ghosts: of an ID there may be many
  for (int k = 0; k < atom->nlocal + atom->nghost; k++) atoms.emplace_back(atom->tag[k], k);
  std::sort(atoms.begin(), atoms.end());

  const auto add = [&](int i, const BondRecord &bond, const AtomDirectory::Entry &partner,
                       const Vector &place) {
    if (partner.type == 0 || !types.handles(atom->type[i], partner.type)) {
      without_pair++;
      if (partner.type == 0) deleted.emplace_back(i, (tagint) bond.partner);
      return;
    }
    const int index = coefficients.index(atom->type[i], partner.type);
    const PairLaw &law = coefficients.law(index);
    const double dlim = law.row.alpha * (atom->radius[i] + partner.radius);
    const Span span = rules.of_bond(bond.deq, dlim);
    const double limit =
        rules.plastic ? lists.limit_of(law.own_limit, lists.limits[i], partner.value) : 0.0;
    unlisted.push_back({i, (tagint) bond.partner, bond.deq, partner.radius, span.cutoff,
                        !(span.cutoff < dlim),
                        law.state(span.cutoff / bond.deq,
                                  {1.0 / bond.deq, rules.flow_of_bonds(), limit, span.cutoff})});
    if (!keeps_events) return;
    double from[3], image[3];
    place.store(from);
    domain->closest_image(x[i], from, image);
    unlisted_partners.emplace_back(image);
  };

  std::vector<std::pair<int, int>> far_away;    // atom, slot: the partner is not even a ghost
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (int slot = 0; slot < (int) records->of(i).size(); slot++) {
      const BondRecord &bond = records->of(i)[slot];
      const auto partner = (tagint) bond.partner;
      auto at = std::lower_bound(atoms.begin(), atoms.end(), std::pair(partner, 0));
      if (at == atoms.end() || at->first != partner) {
        far_away.emplace_back(i, slot);
        partners.push_back(partner);
        continue;
      }
      const int j = at->second;
      bool is_listed = false;
      for (; at != atoms.end() && at->first == partner; ++at)
        is_listed = is_listed ||
            PairGeometry(x, i, at->second).dsq <= cutneighsq[atom->type[i]][atom->type[j]];
      if (!is_listed || !types.handles(atom->type[i], atom->type[j]))
        add(i, bond, {atom->type[j], atom->radius[j], rules.plastic ? lists.limits[j] : 0.0},
            Vector(x[j]));
    }

  if (on_any(!partners.empty(), world)) {
    const AtomDirectory directory(lmp, partners, rules.plastic ? lists.limits.data() : nullptr);
    const std::vector<Vector> places = keeps_events ? places_of(partners)
                                                    : std::vector<Vector>(partners.size());
    for (size_t k = 0; k < partners.size(); k++)
      add(far_away[k].first, records->of(far_away[k].first)[far_away[k].second],
          directory.entries.at(partners[k]), places[k]);
  }
  for (const auto &[i, partner] : deleted) records->forget(i, partner);
  return (int64_t) unlisted.size() + without_pair;
}

}    // namespace EVP
