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
  heat_ = scene::find_shared<Heat>(modify);
  limits_due = heat_due = false;
  starts = true;
  strains.clear();
  owners = {};
  ends.owners = begins.owners = &owners;
  ends.strains = nullptr;
  begins.within = rules.join.within * rules.join.within;
  begins.apart = APART * APART * begins.within;
  every = rules.update_every(scene::find_fix(modify, "nve/evp") != nullptr);
}

// Collective. Have temperatures, strain rates or plastic strains become others between runs?
bool PairHistories::was_set() const
{
  const auto heat = this->heat();
  return records->has_given() || (heat && on_any(heat->factors_are_old(), world));
}

// by the number of the step, so that neither neighbor builds nor MPI ranks nor restarts matter
void PairHistories::begin_step()
{
  if (update->whichflag != 1) return;
  const auto heat = this->heat();
  heat_due = heat && heat->is_due();
  const bool is_first = update->ntimestep == update->firststep + 1;
  limits_due =
      rules.plastic && (update->ntimestep % every == 0 || heat_due || (is_first && was_set()));
}

// in a minimization limits are held from its start on
void PairHistories::begin_forces(PairWork *work, VolumeForces *volume)
{
  if (std::exchange(starts, false) && update->whichflag == 2)
    limits_due = rules.plastic && was_set();
  if (std::exchange(heat_due, false)) {
    if (rules.has_history()) bring_sums_home();
    heat()->hand_out(lists);
  }
  if (std::exchange(limits_due, false)) move_limits(work, volume, update->whichflag != 2);
  find_owners();
}

void PairHistories::note_packing()
{
  ends.clear();
  begins.clear();
  if (const auto heat = this->heat()) heat->note_packing(lists);
  if (!rules.has_history()) return;
  note_images();
  sums.reset(lists.nall);
  if (!rules.plastic) return;
  share_limits(nullptr, false);
  for_each_limit([](double &limit, double now, const auto &...) {
    limit = now;
  });
}

// Collective. Where both owners of a pair hold it: by how many periods ghosts are away from their owners
void PairHistories::note_images()
{
  owners = {};
  if (force->newton_pair || !(domain->xperiodic || domain->yperiodic || domain->zperiodic)) return;
  owners.acts = true;
  owners.nlocal = lists.nlocal;
  owners.x.assign((size_t) 3 * lists.nall, 0.0);
  periods.assign(owners.x.size(), 0.0);
  find_owners();
  const double *const h_inv = domain->h_inv;    // xx yy zz yz xz xy
  for (int j = lists.nlocal; j < lists.nall; j++) {
    const Vector away = Vector(atom->x[j]) - vector_of(owners.x, j);
    const Vector in_boxes = {h_inv[0] * away.x + h_inv[5] * away.y + h_inv[4] * away.z,
                             h_inv[1] * away.y + h_inv[3] * away.z, h_inv[2] * away.z};
    Vector(std::round(in_boxes.x), std::round(in_boxes.y), std::round(in_boxes.z))
        .store(&periods[(size_t) 3 * j]);
  }
}

// Collective, before forces
void PairHistories::find_owners()
{
  if (owners.empty()) return;
  for (int i = 0; i < lists.nlocal; i++) std::copy_n(atom->x[i], 3, &owners.x[(size_t) 3 * i]);
  exchange->forward_comm(owners.x);
  const double *const h = domain->h;
  owners.shifts.resize(owners.x.size());
  for (int j = 0; j < lists.nall; j++) {
    const Vector n = vector_of(periods, j);
    Vector(n.x * h[0] + n.y * h[5] + n.z * h[4], n.y * h[1] + n.z * h[3], n.z * h[2])
        .store(&owners.shifts[(size_t) 3 * j]);
  }
}

// what ghosts have summed; bonds that have ended wait until the records are told
void PairHistories::bring_sums_home()
{
  exchange->reverse_comm(sums.values);
  const auto heat = this->heat();
  for (int i = 0; i < lists.nlocal; i++) {
    const double work = std::exchange(sums.of(i, FlowSums::WORK), 0.0);
    records->sphere(i).slip += std::exchange(sums.of(i, FlowSums::SLIP), 0.0);
    records->sphere(i).work += work;
    if (heat) heat->add_plastic(i, work);
  }
  std::fill(sums.values.begin() + (size_t) FlowSums::WIDTH * lists.nlocal, sums.values.end(), 0.0);
}

// Collective. From the plastic strains of own atoms, and their softening, to the limits of these and of ghosts; volume: which
// of them are torn open
void PairHistories::share_limits(VolumeForces *volume, bool opens)
{
  PerAtomComm::Values values((size_t) 3 * lists.nall, 0.0);
  const auto heat = this->heat();
  for (int i = 0; i < lists.nlocal; i++) {
    const double p = records->sphere(i).p;
    values[(size_t) 3 * i] = types.limit(atom->type[i])(p, heat ? heat->factor(i) : 1.0);
    values[(size_t) 3 * i + 1] = p;
    if (volume) values[(size_t) 3 * i + 2] = volume->openness(i, opens);
  }
  exchange->forward_comm(values);
  limits.resize(lists.nall);
  strains.resize(rules.breaks() ? lists.nall : 0);
  bool fails = false;
  for (int i = 0; i < lists.nall; i++) {
    limits[i] = values[(size_t) 3 * i];
    if (!rules.breaks()) continue;
    strains[i] = values[(size_t) 3 * i + 1];
    fails = fails || strains[i] >= rules.break_strain;
  }
  if (volume)
    volume->set_openness(lists.nall, [&](int i) {
      return values[(size_t) 3 * i + 2];
    });
  // a minimization changes nothing before it is at rest
  ends.strains = fails && update->whichflag != 2 ? strains.data() : nullptr;
  ends.failure = rules.break_strain;
}

void PairHistories::move_limits(PairWork *work, VolumeForces *volume, bool opens)
{
  due = true;
  bring_sums_home();
  for (int i = 0; i < lists.nlocal; i++)
    records->sphere(i).move_on((double) records->of(i).size() - sums.of(i, FlowSums::ENDED));
  if (const auto heat = this->heat()) {
    for (int i = 0; i < lists.nlocal; i++) heat->take_strain(i, records->sphere(i).p);
    heat->take_factors();
  }
  const bool were_given = records->has_given();
  if (were_given) take_given_strains();
  share_limits(volume, opens);
  for_each_limit([&](double &limit, double now, PairList &list, int i, int n) {
    const double before = std::exchange(limit, now);
    if (now < before) keep_below_limit(list, i, n, before, work, !were_given);
  });
}

void PairHistories::take_given_strains()
{
  for (int i = 0; i < lists.nlocal; i++) {
    const double p = records->given(i);
    if (p < 0.0) continue;
    records->sphere(i).p = p;
    if (const auto heat = this->heat()) heat->take_strain(i, p);    // no flow, so no rate
  }
  records->keep_given(false);
}

// of a pair of particle i
double PairHistories::limit_of(int law, int i, double of_partner) const
{
  const double own = coefficients.law(law).own_limit;
  return own > 0.0 ? own : std::min(limits[i], of_partner);
}

// Calls f(limit, limit by those of the spheres now, list, i, n) for pair n of a list, of particle i
template <class F> void PairHistories::for_each_limit(F &&f)
{
  for (PairList *list : {&lists.bonds, &lists.contacts})
    for (const PackedRow &row : list->rows)
      for (int n = row.first; n < row.last; n++)
        f(list->limit[n], limit_of(list->law[n], row.i, limits[list->j[n]]), *list, row.i, n);
}

// Where its limit has become smaller, at the distance of now: what a pair stores beyond it is dissipated. It adds to the
// plastic strain, but not to one that was given
void PairHistories::keep_below_limit(PairList &list, int i, int n, double before, PairWork *work,
                                     bool adds_strain)
{
  const PackedPair pair = list.pair(n);
  const PlacedPair p{pair, i, n, n, PairGeometry(scene::rows(atom->x), i, pair.j)};
  const PairLaw &law = coefficients.law(p.law);
  PairVariables was = p;
  was.limit = before;
  const PairState then = law.state(p.ratio(), was), now = law.state(p.ratio(), p);
  if (now.inv_deq == p.inv_deq) return;
  const double dissipated = then.dissipated + then.stored.elastic - now.stored.elastic;
  if (p.is_bond && adds_strain)
    sums.add(i, p.j, lists.nreact, FlowSums::SLIP, std::fabs(log_of_ratio(now.inv_deq, p.inv_deq)));
  sums.add(i, p.j, lists.nreact, FlowSums::WORK, 0.5 * dissipated);
  list.inv_deq[n] = now.inv_deq;
  if (work) work->add_dissipated(rank_share(p.j, lists.nreact) * dissipated);
}

void PairHistories::commit(PairWork *work, VolumeForces *volume)
{
  due = true;
  for (PairList *list : {&lists.bonds, &lists.contacts})
    if (list->stays()) commit_flow(*list, lists.nreact, sums);
  end_bonds(work, volume);
  end_far_bonds(work);
  if (rules.joins()) begin_bonds(work);
}

bool PairHistories::would_change() const
{
  const auto any = [](const PairList &list) {
    return std::count(list.any_flow.begin(), list.any_flow.end(), 1) > 0;
  };
  return !ends.found.empty() || !begins.found.empty() || !far.empty() || any(lists.bonds) ||
      any(lists.contacts);
}

// by the force loop, at the present positions, where bonds fail too: a minimization leaves that to its end
void PairHistories::find_next()
{
  std::vector<double> scratch((size_t) 3 * lists.nall, 0.0);
  const ParticleView view = {scene::rows(atom->x), nullptr,
                             reinterpret_cast<double(*)[3]>(scratch.data()), lists.nreact};
  find_owners();
  ends.clear();
  ends.strains = strains.empty() ? nullptr : strains.data();
  accumulate_forces(lists.bonds, coefficients.block_law(lists.bonds), view, {&ends});
  accumulate_forces(lists.contacts, coefficients.block_law(lists.contacts), view,
                    {beginning_to_find()});
}

// at the end of a step, when deq has moved
void PairHistories::end_bonds(PairWork *work, VolumeForces *volume)
{
  if (ends.found.empty()) return;
  for (size_t n = 0; n < ends.found.size(); n++) {
    const int k = ends.found[n], i = lists.bonds.owner_of(k);
    const PackedPair bond = lists.bonds.pair(k);
    const double d = bond.up_to_cutoff(ends.squared_distances[n]);
    const Span left = rules.of_ended(atom->radius[i] + atom->radius[bond.j], d);
    const double dlim =
        coefficients.law(bond.law).row.alpha * (atom->radius[i] + atom->radius[bond.j]);
    const bool failed = d < dlim * (1.0 - BOND_MARGIN);
    journal.push_back(
        {i, bond.j, atom->tag[bond.j], left.deq, failed ? PairEvent::FAILED : PairEvent::ENDED});
    note_event(i, bond.j, atom->tag[bond.j], failed ? BondEvent::FAILED : BondEvent::AT_DLIM);
    if (rules.plastic) sums.add(i, bond.j, lists.nreact, FlowSums::ENDED, 1.0);
    end_at(i, bond.j, coefficients.law(bond.law).state(d * bond.inv_deq, bond).stored, work);
    if (volume) volume->bond_ends(lists, k);
    if (left.cutoff > 0.0) add_contact(i, bond, d, left);
  }
  lists.bonds.remove(ends.found);
  ends.clear();
  lists.build++;
}

// a pair of own atom i loses what it holds, which becomes heat
void PairHistories::end_at(int i, int j, const Stored &held, PairWork *work)
{
  if (work) work->end(held, rank_share(j, lists.nreact));
  if (const auto heat = this->heat()) heat->add(i, j, j < lists.nreact, held.total());
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
  if (rules.plastic) contacts.limit[contacts.size()] = limit_of(law, i, limits[bond.j]);
  contacts.add_row(i, 1);
  if (!contacts.joins) return;
  if (divided && !rules.join.all) contacts.join.back() |= PairList::OF_TWO_BODIES;
  if (!(d > APART * rules.join.within * left.cutoff))
    contacts.join.back() |= PairList::NOT_BEFORE_APART;
}

// likewise. What a contact stores is lost: one that comes from outside has nothing, unless it jumped
void PairHistories::begin_bonds(PairWork *work)
{
  PairList &bonds = lists.bonds, &contacts = lists.contacts;
  for (const int k : begins.released) contacts.join[k] &= ~PairList::NOT_BEFORE_APART;
  for (const int k : begins.entered) contacts.join[k] |= PairList::NOT_BEFORE_APART;
  for (size_t n = 0; n < begins.found.size(); n++) {
    const int k = begins.found[n], i = contacts.owner_of(k);
    const PackedPair contact = contacts.pair(k);
    const double d = std::sqrt(begins.squared_distances[n]);
    const int law = coefficients.within_body(contact.law);
    const double alpha = coefficients.law(law).row.alpha;
    const double dlim = alpha * (atom->radius[i] + atom->radius[contact.j]);
    end_at(i, contact.j, coefficients.law(contact.law).state(d * contact.inv_deq, contact).stored,
           work);
    journal.push_back({i, contact.j, atom->tag[contact.j], d, PairEvent::BEGAN});
    note_event(i, contact.j, atom->tag[contact.j], BondEvent::JOINED);
    if (d < contact.cut * rules.join.within / APART && !is_copy(i, contact.j)) jumps++;
    sums.add(i, contact.j, lists.nreact, FlowSums::ENDED, -1.0);
    demand_room(bonds, 1, error);
    bonds.set(bonds.size(), contact.j, d, dlim, law);
    bonds.limit[bonds.size()] = limit_of(law, i, limits[contact.j]);
    bonds.add_row(i, 1);
    if (!bonds.joins) continue;    // without the volume energy
    bonds.join.back() = PairList::HAS_JOINED;
    bonds.inv_dlim.resize(bonds.size() - 1);
    bonds.inv_dlim.push_back(HUGE_VAL);
  }
  contacts.remove(begins.found);
  if (!begins.found.empty()) lists.build++;
  begins.clear();
}

// each on the ranks of both of its atoms, of which that of the lower ID notes the event
void PairHistories::end_far_bonds(PairWork *work)
{
  if (!rules.has_history()) return;
  for (size_t n = 0; n < far.size(); n++) {
    const FarBond &bond = far[n];
    const double sum_radii = atom->radius[bond.i] + bond.radius;
    const double rest = rules.of_ended(sum_radii, bond.cutoff).deq;
    journal.push_back(
        {bond.i, -1, bond.partner, rest, bond.at_dlim ? PairEvent::ENDED : PairEvent::FAILED});
    if (keeps_events && atom->tag[bond.i] < bond.partner)
      add_event(bond.i, bond.partner, far_partners[n],
                bond.at_dlim ? BondEvent::AT_DLIM : BondEvent::FAILED);
    sums.of(bond.i, FlowSums::ENDED) += 1.0;
    sums.of(bond.i, FlowSums::WORK) += 0.5 * bond.state.dissipated;
    if (const auto heat = this->heat()) heat->add(bond.i, -1, false, bond.state.stored.total());
    if (rules.plastic)
      sums.of(bond.i, FlowSums::SLIP) +=
          std::fabs(log_of_ratio(bond.state.inv_deq, 1.0 / bond.deq));
  }
  forget_far();
  if (work) work->end_beyond_list();
}

void PairHistories::return_to(const BondStore &store, VolumeForces *volume)
{
  if (&store != records) return;
  if (std::exchange(due, false)) return_due(volume);
  if (const auto heat = this->heat()) heat->bring_home();
}

void PairHistories::return_due(VolumeForces *volume)
{
  bring_sums_home();
  if (volume) volume->note_bonds_at_rest(lists);
  if (rules.plastic) add_moves();
  tell_owners();
  if (rules.joins()) warn_of_jumps();
  journal.clear();
  for (int i = 0; i < lists.nlocal; i++) sums.of(i, FlowSums::ENDED) = 0.0;
}

// Collective
void PairHistories::warn_of_jumps()
{
  const bigint all = reduce_all(std::exchange(jumps, 0), MPI_SUM, world);
  if (all == 0 || std::exchange(jumps_told, true) || comm->me) return;
  error->warning(
      FLERR,
      "Pair evp/lj: {} pairs that joined until step {} had come nearer than {:.4g} (R_i + "
      "R_j) in the step in which they came within {}: what they had stored as a contact "
      "is lost; use a smaller timestep, or fix dt/evp (said once)",
      all, update->ntimestep, rules.join.within / APART, rules.join.within);
}

void PairHistories::apply(const PairEvent &event)
{
  const auto remember = [&](Remembered::Kind kind) {
    if (!records->find_remembered(event.i, event.partner))
      records->remembered_of(event.i).push_back({event.partner, event.deq, kind});
  };
  if (event.what == PairEvent::MOVED)
    records->move(event.i, event.partner, event.deq);
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
        const double inv_deq = list->inv_deq[k];
        const auto note = [&](PairEvent::What what) {
          journal.push_back({i, j, tag[j], 1.0 / inv_deq, what});
        };
        if (list->are_bonds) {    // one that began since is not in the records yet
          const BondRecord *const bond = records->find(i, tag[j]);
          if (!bond || 1.0 / bond->deq != inv_deq) note(PairEvent::MOVED);
          if (list->joins && list->join[k] != 0) note(PairEvent::JOINED);
        } else if (list->joins && (list->join[k] & PairList::NOT_BEFORE_APART))
          note(PairEvent::INSIDE);
        // contacts end at R_i + R_j as these were packed
        else if (inv_deq * list->pair(k).cut > 1.0 + CONTACT_MARGIN)
          note(PairEvent::REMEMBERED);
      }
}

// Atoms and ghosts are those that the list was packed for
void PairHistories::tell_owners()
{
  const int nlocal = lists.nlocal;
  PerAtomComm::Values owner((size_t) 3 * lists.nall, 0.0);    // rank, local index
  for (int i = 0; i < nlocal; i++) {
    owner[(size_t) 3 * i] = comm->me;
    owner[(size_t) 3 * i + 1] = i;
  }
  exchange->forward_comm(owner);

  std::vector<PairEvent> messages;
  std::vector<int> ranks;
  for (const PairEvent &event : journal) {
    if (event.j >= 0 && is_copy(event.i, event.j)) continue;
    apply(event);
    if (event.j < 0) continue;
    PairEvent other = {event.j, -1, atom->tag[event.i], event.deq, event.what};
    if (event.j < nlocal) {
      apply(other);
      continue;
    }
    other.i = (int) owner[(size_t) 3 * event.j + 1];
    ranks.push_back((int) owner[(size_t) 3 * event.j]);
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
  std::vector<double> coordinates(atom->nlocal), found(3 * ids.size());
  for (int c = 0; c < 3; c++) {
    for (int i = 0; i < atom->nlocal; i++) coordinates[i] = atom->x[i][c];
    const AtomDirectory directory(lmp, ids, coordinates.data());
    for (size_t k = 0; k < ids.size(); k++) found[3 * k + c] = directory.entries.at(ids[k]).value;
  }
  std::vector<Vector> places(ids.size());
  for (size_t k = 0; k < ids.size(); k++) places[k] = vector_of(found, (int) k);
  return places;
}

int64_t PairHistories::find_far()
{
  forget_far();
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
    const double limit = rules.plastic ? limit_of(index, i, partner.value) : 0.0;
    far.push_back({i, (tagint) bond.partner, bond.deq, partner.radius, span.cutoff,
                   !(span.cutoff < dlim),
                   law.state(span.cutoff / bond.deq,
                             {1.0 / bond.deq, rules.flow_of_bonds(), limit, span.cutoff})});
    if (!keeps_events) return;
    double from[3], image[3];
    place.store(from);
    domain->closest_image(x[i], from, image);
    far_partners.emplace_back(image);
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
      bool is_near = false;
      for (; at != atoms.end() && at->first == partner; ++at)
        is_near = is_near ||
            PairGeometry(x, i, at->second).dsq <= cutneighsq[atom->type[i]][atom->type[j]];
      if (!is_near || !types.handles(atom->type[i], atom->type[j]))
        add(i, bond, {atom->type[j], atom->radius[j], rules.plastic ? limits[j] : 0.0},
            Vector(x[j]));
    }

  if (on_any(!partners.empty(), world)) {
    const AtomDirectory directory(lmp, partners, rules.plastic ? limits.data() : nullptr);
    const std::vector<Vector> places = keeps_events ? places_of(partners)
                                                    : std::vector<Vector>(partners.size());
    for (size_t k = 0; k < partners.size(); k++)
      add(far_away[k].first, records->of(far_away[k].first)[far_away[k].second],
          directory.entries.at(partners[k]), places[k]);
  }
  for (const auto &[i, partner] : deleted) records->forget(i, partner);
  return (int64_t) far.size() + without_pair;
}

// a bond of two MPI ranks counts half on each
PairWork::BeyondList PairHistories::beyond_list() const
{
  PairWork::BeyondList sum{};
  for (const FarBond &bond : far) {
    sum.held.elastic += 0.5 * bond.state.stored.elastic;
    sum.held.forgotten += 0.5 * bond.state.stored.forgotten;
    sum.dissipated += 0.5 * bond.state.dissipated;
  }
  return sum;
}

void PairHistories::tell_of_far(VolumeForces &volume) const
{
  for (const FarBond &bond : far) volume.far_bond_leaves(bond.i);
}

}    // namespace EVP
