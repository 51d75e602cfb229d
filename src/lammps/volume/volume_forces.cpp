// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/volume/volume_forces.h"

#include "lammps/base/user_input.h"
#include "lammps/pairs/pair_list_builder.h"

#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"

#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace EVP {

/// Volume strain over xi_s where what bonds store under pressure is taken over. All of them yield at 3, the first ones below.
constexpr double FROM = 2.0;

VolumeForces::VolumeForces(const Fix *fix_in, LAMMPS *lmp, const std::string &who_in,
                           const std::vector<double> &kv_in, PerAtomComm &exchange_in) :
    Pointers(lmp),
    fix(fix_in), from_rows(kv_in.empty()), kv(kv_in), exchange(exchange_in), references(lmp, who_in)
{
  if (from_rows) kv.assign(lmp->atom->ntypes + 1, 0.0);
  taken.assign(lmp->atom->ntypes + 1, TakenOver());
}

void VolumeForces::rows_scaled(const Coefficients &coefficients)
{
  for (int type = 1; from_rows && type <= atom->ntypes; type++)
    stop_at_bad_input(error, fmt::format("Pair evp/lj, types {} and {}", type, type), [&] {
      kv[type] = coefficients.kv(type);
    });
  taken.assign(atom->ntypes + 1, TakenOver());
  for (int type = 1; type <= atom->ntypes; type++)
    if (kv[type] > 0.0)
      taken[type] = {coefficients.bulk_of_bonds(type), FROM * coefficients.row(type, type).xi_s};
  if (!acts()) forget();
}

std::string VolumeForces::describe() const
{
  return fmt::format(", volume energy from fix {}{}", fix->id,
                     takes_over() ? ", which takes over the pressure at which bonds yield" : "");
}

void VolumeForces::pairs_packed(const NeighList *neighbors)
{
  PairLists &lists = pairs->lists();
  BondStore *const store = &this->store();
  records = store->columns<VolumeRecord>();
  damage = store->find_value("damage");
  damage_before.clear();
  bonds_end = pairs->bonds_can_fail();
  is_plastic = pairs->rules().plastic;
  columns = Columns(*pairs, across);
  densities.set_width(columns.n);
  pulls.set_width(columns.some_push ? PUSHING + 1 : PULLING + 1);
  leaving.clear();
  far.clear();
  const VolumeReferences::Changes changes = references.pairs_packed(*pairs, records);

  batches.assign(lists.nall, 0.0);
  for (int i = 0; i < lists.nlocal; i++) {
    batches[i][0] = records[i].batch;
    batches[i][1] = openness(i, false);
  }
  exchange.forward_comm(batches);
  set_openness(is_plastic ? lists.nall : 0, [this](int i) {
    return batches[i][1];
  });

  PairList &bonds = lists.bonds;
  inv_dlim = bonds.add_column(HUGE_VAL, true);
  std::vector<double> &inv_dlim_of = bonds.columns[inv_dlim].values;
  for (Others &some : others) some.all.clear(BOND_MARGIN, Flow::REVERSIBLE);
  const auto x = scene::rows(atom->x);
  std::vector<int> bonded_to(lists.nall, -1);    // the last particle that has a bond with this one
  auto row = bonds.rows.begin();                 // these are in the order of the neighbor list
  for (int ii = 0; ii < neighbors->inum; ii++) {
    const int i = neighbors->ilist[ii];
    for (; row != bonds.rows.end() && row->i == i; ++row)
      for (int k = row->first; k < row->last; k++) {
        const int j = bonds.j[k];
        if (bonds.joins && bonds.join[k] != 0) continue;
        bonded_to[j] = i;
        const double end = dlim(i, j);
        if (ends_of_bond(i, j) == BOTH)
          inv_dlim_of[k] = 1.0 / end;
        else if (end > 0.0)
          add_pair(of_later(i, j).all, i, j, end, error);
      }
    if (!has_strain(i)) continue;
    int n[NOTHERS] = {};
    for (const int kind : {UNBONDED, OF_TWO_BODIES})
      demand_room(others[kind].all, neighbors->numneigh[i], error);
    for (int jj = 0; jj < neighbors->numneigh[i]; jj++) {
      const int j = neighbors->firstneigh[i][jj] & NEIGHMASK;
      if (bonded_to[j] == i || scene::is_excluded(lmp->force, neighbors->firstneigh[i][jj]))
        continue;
      const double end = counts(i, j) ? dlim(i, j) : 0.0;
      if (!(end > 0.0) || stays_beyond(PairGeometry(x, i, j).dsq, end, lmp->neighbor->skin))
        continue;
      const int kind = are_one_body(i, j) ? UNBONDED : OF_TWO_BODIES;
      PairList &list = others[kind].all;
      list.set(list.size() + n[kind]++, j, end, end);
    }
    for (const int kind : {UNBONDED, OF_TWO_BODIES}) others[kind].all.add_row(i, n[kind]);
  }
  if (changes.all_set || changes.exclusion_undone) fill_gaps(changes.newly_set);
}

void VolumeForces::unlisted_bonds_found(const std::vector<UnlistedBond> &bonds)
{
  far.clear();
  // of eq. 8: they break before their spheres are out of reach, at the end of the step
  for (const UnlistedBond &bond : bonds)
    if (bonds_end && !is_plastic) far.push_back(bond.i);
}

// those of the bonds are a column of their list
void VolumeForces::pairs_grow(const Ratio &ratio)
{
  for (Others &some : others) some.all.grow(ratio);
}

double VolumeForces::energy_of_present_positions()
{
  before_forces({pairs->positions(), nullptr, nullptr, pairs->lists().nreact});
  return energy_here;
}

VolumeForces::Openness VolumeForces::openness(int i, bool opens) const
{
  const VolumeRecord &own = records[i];
  if (own.reference.is(VolumeReference::OPEN)) return IS_OPEN;
  return opens && own.strain > law.cavitation && kv_of(i) > 0.0 ? OPENS : CLOSED;
}

// of(i): Openness of n atoms and ghosts
template <class F> void VolumeForces::set_openness(int n, F &&of)
{
  open.resize(n);
  for (int i = 0; i < n; i++) open[i] = (char) of(i);
  any_open = std::any_of(open.begin(), open.end(), [](char one) {
    return one != CLOSED;
  });
}

// when a minimization begins its potential must not change
void VolumeForces::put_shared(Sharing when, const ValuesOfAtoms &values) const
{
  for (int i = 0; i < pairs->lists().nlocal; i++)
    values[i][0] = openness(i, when == Sharing::UPDATED);
}

void VolumeForces::set_shared(Sharing, const ValuesOfAtoms &values)
{
  set_openness(pairs->lists().nall, [&](int i) {
    return values[i][0];
  });
}

void VolumeForces::add_pair(PairList &list, int i, int j, double dlim, Error *error)
{
  demand_room(list, 1, error);
  list.set(list.size(), j, dlim, dlim);
  list.add_row(i, 1);
}

void VolumeForces::remove_pair(PairList &list, int i, int j)
{
  for (const PackedRow &row : list.rows) {
    const auto *const begin = list.j.data();
    const auto *const at = std::find(begin + row.first, begin + row.last, j);
    if (row.i == i && at != begin + row.last) return list.remove({(int) (at - begin)});
  }
}

// Pairs that are no bonds, and are there at rest or once an exclusion is undone, are surfaces of a crack that never had any.
// They have no force from that alone. newly_set: own atoms whose references are those of now, empty where an exclusion is undone
void VolumeForces::fill_gaps(const std::vector<char> &newly_set)
{
  constexpr double AT_REST = 1e-6;
  before_forces({pairs->positions(), nullptr, nullptr, pairs->lists().nreact});
  for (int i = 0; i < pairs->lists().nlocal; i++) {
    VolumeReference &own = records[i].reference;
    const DensityNow now = density(i);
    const double denser = now.bonded - own.own.rho;
    const double unbonded = now.pulling + now.pushing;
    const bool at_rest = std::fabs(denser) <= AT_REST * own.own.rho;
    if (unbonded == 0.0 || (!newly_set.empty() && !(newly_set[i] && at_rest))) continue;
    own.gap = std::max(own.gap, unbonded + std::max(0.0, denser));
    if (now.pulling > 0.0) own.set(VolumeReference::BROKEN);
  }
}

void VolumeForces::bond_ends(const EndingPair &bond)
{
  const auto [index, i, j, stored] = bond;
  if (pairs->lists().bonds.pair(index).has_joined || dlim(i, j) == 0.0) return;
  if (ends_of_bond(i, j) != BOTH) remove_pair(of_later(i, j).all, i, j);
  if (counts(i, j)) add_pair(unbonded(i, j).all, i, j, dlim(i, j), error);
}

// Bonds that end at the end of the step count as new pairs at once, so that the next set-up finds the same forces; those past
// their dlim have no share any more
void VolumeForces::add_leaving(const std::vector<int> &ended)
{
  const PairLists &lists = pairs->lists();
  constexpr double SOME = std::numeric_limits<double>::min();    // tells that one leaves
  const auto add = [&](int i, double share, int kind) {
    densities[i][kind] += std::max(share, SOME);
  };
  for (const int i : far) add(i, 0.0, columns.to_new);
  for (const int k : ended) {
    const PackedPair bond = lists.bonds.pair(k);
    const int i = lists.bonds.owner_of(k), j = bond.j;
    const double end = bond.has_joined ? 0.0 : dlim(i, j);
    const double d = std::sqrt(PairGeometry(scene::rows(atom->x), i, j).dsq);
    if (!(end > 0.0) || (is_plastic && !(d < end))) continue;
    const Ends ends = ends_of_bond(i, j);
    NeighborDensity now{};
    now.add(d, end);
    if (ends != BOTH) remove_pair(of_later(i, j).now, i, j);
    for (const auto &[one, end_bit] :
         {std::pair(i, VolumePasses::ROW), {j, VolumePasses::PARTNER}}) {
      if (one == j && j >= lists.nreact) continue;
      if (ends & end_bit)
        add(one, now.rho, are_one_body(i, j) ? columns.to_new : columns.gone);
      else if (counts(i, j))
        add(one, now.rho, columns.to_new_of_older);
    }
    if (counts(i, j)) add_pair(unbonded(i, j).now, i, j, end, error);
  }
}

// Pairs of atoms that are torn open, and what of their shares ceases to pull in this step
void VolumeForces::find_beside_open()
{
  PairList &pulling = others[UNBONDED].now, &pushing = others[BESIDE_OPEN].now;
  if (!any_open) return;
  std::vector<int> out;
  const auto *const x = scene::rows(atom->x);
  EVP::for_each_pair(pulling, x, [&](const PlacedPair &p) {
    if (!is_beside_open(p.i, p.j)) return;
    out.push_back(p.index);
    add_pair(pushing, p.i, p.j, 1.0 / p.inv_deq, error);
    if (open[p.i] == IS_OPEN || open[p.j] == IS_OPEN) return;
    NeighborDensity now{};
    now.add(p.distance(), 1.0 / p.inv_deq);
    densities_of(CEASED).of(p.i) += now.rho;
    if (p.j < pairs->lists().nreact) densities_of(CEASED).of(p.j) += now.rho;
  });
  pulling.remove(out);
}

// The reference that own atom i gets at the end of the step, nothing where it stays. Moves the shares to their new columns
std::optional<VolumeReference> VolumeForces::find_change(int i)
{
  if (!has_strain(i)) return std::nullopt;
  VolumeReference reference = records[i].reference;
  double *const own = densities[i];
  bool changes = false;
  if (any_open && (own[CEASED] > 0.0 || open[i] == OPENS)) {
    changes = true;
    const double ceased = own[CEASED];
    const DensityNow before = {own[BONDED], own[PULLING] + ceased, own[PUSHING] - ceased};
    reference = open[i] == OPENS ? VolumeLaw::opened(reference, before)
                                 : VolumeLaw::beside_open(reference, before, ceased);
  }
  if (!bonds_end) return changes ? std::optional(reference) : std::nullopt;
  if (own[columns.gone] > 0.0) {
    changes = true;
    const double share = own[columns.gone];
    reference.own.rho -= share;
    own[BONDED] -= share;
    if (across) {    // without a force that begins
      reference.gap += share;
      reference.lost += share;
      own[PUSHING] += share;
    }
  }
  if (const double share = own[columns.to_new]; share > 0.0) {
    changes = true;
    reference = VolumeLaw::without(reference, density(i), share);
    own[BONDED] -= share;
    own[PULLING] += share;
  }
  if (const double share = own[columns.to_new_of_older]; share > 0.0) {
    changes = true;
    reference = VolumeLaw::beside(reference, density(i), share);
    own[PULLING] += share;
  }
  return changes ? std::optional(reference) : std::nullopt;
}

void VolumeForces::note_damage()
{
  damage_before.clear();
  for (int i = 0; damage && i < pairs->lists().nlocal; i++) damage_before.push_back(damage.of(i));
}

// What spheres store no more as their damage has grown. The half step that led here had their pull of before, the other half has that of
// now: work is done by the mean of both, and this difference is no dissipation
void VolumeForces::find_lost_by_damage()
{
  lost_by_damage.clear();
  dissipated_here = 0.0;
  if (damage_before.empty() || update->whichflag != 1) return;
  lost_by_damage.assign(damage_before.size(), 0.0);
  for (int i = 0; i < (int) damage_before.size(); i++) {
    if (!(damage.of(i) > damage_before[i]) || !(strains[i] > 0.0)) continue;
    const VolumeState before = state(i, damage_before[i]), now = state(i);
    const double pull = (before.bonded - now.bonded) * reference(i).own.slope;
    lost_by_damage[i] = before.energy - now.energy;
    dissipated_here += lost_by_damage[i] - 0.5 * pull * (strains[i] - records[i].strain);
  }
}

void VolumeForces::add_lost_by_damage()
{
  damage_before.clear();
  if (lost_by_damage.empty()) return;
  for (size_t i = 0; i < lost_by_damage.size(); i++)
    store().sphere((int) i).work += lost_by_damage[i];
  pairs->effects.for_each([this](Effect &other) {
    other.add_plastic_work(lost_by_damage);
  });
  lost_by_damage.clear();
}

void VolumeForces::committed()
{
  add_lost_by_damage();
  for (const Leaving &now : leaving) records[now.i].reference = now.reference;
  leaving.clear();
  far.clear();
  if (!is_plastic) return;
  for (char &one : open)
    if (one == OPENS) one = IS_OPEN;
  for (size_t i = 0; i < strains.size(); i++) records[(int) i].strain = strains[i];
}

const VolumeReference &VolumeForces::reference(int i) const
{
  if (!leaving.empty()) {
    const auto at =
        std::lower_bound(leaving.begin(), leaving.end(), i, [](const Leaving &one, int other) {
          return one.i < other;
        });
    if (at != leaving.end() && at->i == i) return at->reference;
  }
  return records[i].reference;
}

// 0 of no pair, which a pair of another style is
double VolumeForces::dlim(int i, int j) const
{
  if (!are_pair(i, j)) return 0.0;
  const double alpha = pairs->coefficients().row(atom->type[i], atom->type[j]).alpha;
  return alpha == 0.0 ? 0.0
                      : references.relative_cutoff(alpha) * pairs->lists().growth_of(i, j) *
          (atom->radius[i] + atom->radius[j]);
}

double VolumeForces::force_between(int i, int j, double d, const PackedPair &pair) const
{
  const double alpha = pairs->law_of(pair).row.alpha;
  const bool bond = pair.is_bond && !pair.has_joined && d * d <= pair.cutsq;
  if ((size_t) std::max(i, j) >= pulls.size() || !are_pair(i, j)) return 0.0;
  if (!bond && !counts(i, j)) return 0.0;
  const double end = references.relative_cutoff(alpha) * pairs->lists().growth_of(i, j) *
      (atom->radius[i] + atom->radius[j]);
  const Density column = bond                       ? BONDED
      : !are_one_body(i, j) || is_beside_open(i, j) ? PUSHING
                                                    : PULLING;
  const double both = pull(i, j, column, bond ? ends_of_bond(i, j) : BOTH);
  return d < end ? -both * 2.0 * (1.0 - d / end) / end : 0.0;
}

// before the records are told where deq of the bonds has moved, and which have ended
void VolumeForces::note_bonds_at_rest()
{
  const PairLists &lists = pairs->lists();
  const std::vector<double> &inv_dlim_of = lists.bonds.columns[inv_dlim].values;
  AtomValues sums(2, lists.nall);
  const auto add = [&](const PlacedPair &p, double inv_dlim, Ends ends) {
    if (!(inv_dlim < HUGE_VAL)) return;    // of a pair of another style
    NeighborDensity share{};
    share.add(1.0 / p.inv_deq, 1.0 / inv_dlim);
    for (const auto &[i, end] : {std::pair(p.i, VolumePasses::ROW), {p.j, VolumePasses::PARTNER}}) {
      if (!(ends & end) || (i == p.j && p.j >= lists.nreact)) continue;
      sums[i][0] += share.rho;
      sums[i][1] += share.slope;
    }
  };
  EVP::for_each_pair(lists.bonds, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (p.has_joined) return;
    const Ends ends = has_strain(p.i) && has_strain(p.j) ? ends_of_bond(p.i, p.j) : BOTH;
    add(p, ends == BOTH ? inv_dlim_of[p.index] : 1.0 / dlim(p.i, p.j), ends);
  });
  exchange.reverse_comm(sums);
  for (int i = 0; i < lists.nlocal; i++) records[i].at_rest = {sums[i][0], sums[i][1]};
}

void VolumeForces::before_forces(const ParticleView &view)
{
  const PairLists &lists = pairs->lists();
  const std::vector<double> &inv_dlim_of = lists.bonds.columns[inv_dlim].values;
  densities.assign(lists.nall, 0.0);
  EndingBonds ends;    // the same as by the forces to come
  ends.criteria = pairs->ending().criteria;
  ends.owners = pairs->ending().owners;
  VolumePasses::add_densities(lists.bonds, inv_dlim_of, view, densities_of(BONDED), BOTH,
                              bonds_end ? &ends : nullptr);
  for (Others &some : others) VolumePasses::find_active(some.all, view, some.now);
  find_beside_open();
  for (Others &some : others)
    VolumePasses::add_densities(some.now, some.now.inv_deq, view, densities_of(some.column),
                                some.ends);
  if (bonds_end) add_leaving(ends.found);
  exchange.reverse_comm(densities);

  leaving.clear();
  pulls.assign(lists.nall, 0.0);
  strains.resize(lists.nlocal);
  energy_here = 0.0;
  for (int i = 0; i < lists.nlocal; i++) {
    if (bonds_end || any_open)
      if (const auto reference = find_change(i)) leaving.push_back({i, *reference});
    const VolumeState now = state(i);
    strains[i] = now.strain;
    double *const own = pulls[i];
    own[BONDED] = now.bonded;
    own[PULLING] = now.pulling;
    if (columns.some_push) own[PUSHING] = now.pushing;
    energy_here += now.energy;
  }
  find_lost_by_damage();
  exchange.forward_comm(pulls);
  on_bonds = {inv_dlim_of.data(), pulls_of(BONDED)};
}

// pairs that have no other force
void VolumeForces::for_each_further_list(const EachList &f)
{
  for (Others &some : others) {
    VolumePasses::Forces forces(some.now.inv_deq.data(), pulls_of(some.column), some.ends);
    f(some.now, forces);
  }
}

// Calls f(PlacedPair, does it count as a bond, 1/dlim, sum of -dU/drho of the atoms for which it counts [energy]) for all
// pairs within their dlim, or zone
template <class F> void VolumeForces::for_each_pair(F &&f) const
{
  const PairList &bonds = pairs->lists().bonds;
  const auto *const x = pairs->positions();
  EVP::for_each_pair(bonds, x, [&](const PlacedPair &p) {
    const double own = bonds.columns[inv_dlim].values[p.index];
    if (p.distance() * own < 1.0) f(p, true, own, pull(p.i, p.j, BONDED, BOTH));
  });
  for (const Others &some : others)
    EVP::for_each_pair(some.all, x, [&](const PlacedPair &p) {
      const bool only_pushes = some.column == PULLING && is_beside_open(p.i, p.j);
      if (p.distance() * p.inv_deq < 1.0)
        f(p, some.column == BONDED, p.inv_deq,
          pull(p.i, p.j, only_pushes ? PUSHING : some.column, some.ends));
    });
}

// At other positions than those of the forces: what comes into force, strains and the energy of all atoms stay; the rest is of
// these positions until the next forces. Its pairs are links already, or become such, without damping. F = -pull 2 t/dlim
void VolumeForces::add_stiffness(StiffnessMatrix &matrix)
{
  const auto kept = std::make_tuple(leaving, energy_here, strains, lost_by_damage, dissipated_here);
  before_forces({pairs->positions(), nullptr, nullptr, pairs->lists().nreact});
  StiffnessMatrix::Densities own;
  for (int i = 0; i < atom->nlocal; i++) own.stiffness.push_back(state(i).stiffness);
  StiffnessMatrix::Places places(matrix);
  for_each_pair([&](const PlacedPair &p, bool bond, double inv_dlim_of, double pull) {
    if (!matrix.is_free(p.i) && !matrix.is_free(p.j)) return;
    const double d = p.distance();
    const size_t k = places.find_or_add(p.i, p.j, p.direction());
    own.links.resize(matrix.links.size());
    const double slope = 2.0 * inv_dlim_of * (1.0 - d * inv_dlim_of);
    own.links[k] = {slope, 0.0, bond};
    matrix.links[k].axial += std::max(0.0, -2.0 * pull * inv_dlim_of * inv_dlim_of);
    matrix.links[k].across += pull * slope / d;
  });
  matrix.densities.push_back(own);
  std::tie(leaving, energy_here, strains, lost_by_damage, dissipated_here) = kept;
}

}    // namespace EVP
