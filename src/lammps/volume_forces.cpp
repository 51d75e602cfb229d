// SPDX-License-Identifier: GPL-2.0-only

#include "volume_forces.h"

#include "atom_directory.h"
#include "collective.h"
#include "pair_list_builder.h"

#include "comm.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace EVP {

VolumeForces::VolumeForces(LAMMPS *lmp, const std::string &who_in, int groupbit_in,
                           const std::vector<double> &kv_in, PerAtomComm &exchange_in) :
    Pointers(lmp),
    who(who_in), groupbit(groupbit_in), from_rows(kv_in.empty()), kv(kv_in), exchange(exchange_in)
{
  if (from_rows) kv.assign(lmp->atom->ntypes + 1, 0.0);
}

std::shared_ptr<VolumeForces> VolumeForces::find(const Modify *modify)
{
  const auto forces = scene::find_shared<VolumeForces>(modify);
  return forces && forces->acts() ? forces : nullptr;
}

void VolumeForces::pack(const NeighList *neighbors, PairLists &lists, BondStore &store_in,
                        const Coefficients &coefficients, const PairRules &rules,
                        const EndingBonds &ending_in)
{
  store = &store_in;
  ending = rules.breaks() ? &ending_in : nullptr;
  end_at_dlim = rules.plastic;
  leaving.clear();
  far.clear();
  const double reaches = sum_of_reaches(coefficients);
  const bool takes = store->reaches != reaches;
  if (const bigint now = sum_of_partners(); std::exchange(partners, now) != now || takes) {
    const std::vector<NeighborDensity> rest = at_rest(coefficients, takes);
    set_references(rest, takes);
    store->reaches = reaches;
    for (int i = 0; i < atom->nlocal; i++) lose_partners(store->volume(i), rest[i]);
  }

  has_bonds.assign(VolumePasses::WIDTH * (size_t) lists.nall, 0.0);
  for (int i = 0; i < lists.nlocal; i++)
    has_bonds[VolumePasses::WIDTH * (size_t) i] = store->volume(i).reference.own.slope > 0.0;
  exchange.forward_comm(has_bonds);

  lists.bonds.inv_dlim.resize(lists.bonds.size());
  std::vector<int> bonded_to(lists.nall, -1);    // the last particle that has a bond with this one
  auto row = lists.bonds.rows.begin();           // these are in the order of the neighbor list
  for (int ii = 0; ii < neighbors->inum; ii++) {
    const int i = neighbors->ilist[ii];
    for (; row != lists.bonds.rows.end() && row->i == i; ++row)
      for (int k = row->first; k < row->last; k++) {
        const int j = lists.bonds.j[k];
        bonded_to[j] = i;
        lists.bonds.inv_dlim[k] = 1.0 / dlim(coefficients, i, j, true);
      }
    if (!has_strain(i)) continue;
    demand_room(lists.unbonded, neighbors->numneigh[i], error);
    int n = 0;
    for (int jj = 0; jj < neighbors->numneigh[i]; jj++) {
      const int j = neighbors->firstneigh[i][jj] & NEIGHMASK;
      if (bonded_to[j] == i || scene::is_excluded(lmp->force, neighbors->firstneigh[i][jj]))
        continue;
      const double end = dlim(coefficients, i, j, false);
      if (end > 0.0) lists.unbonded.set(lists.unbonded.size() + n++, j, end, end);
    }
    lists.unbonded.add_row(i, n);
  }

  const double now = neighbor->nex_type + neighbor->nex_group + neighbor->nex_mol;
  const bool fewer = std::exchange(store->exclusions, now) > now;
  if (takes || fewer) fill_gaps(lists, takes);
}

// Pairs that are no bonds, and are there at rest or once an exclusion is undone, are surfaces of a crack that never had any.
// They have no force from that alone
void VolumeForces::fill_gaps(const PairLists &lists, bool at_rest_only)
{
  constexpr double AT_REST = 1e-6;
  evaluate(lists);
  for (int i = 0; i < lists.nlocal; i++) {
    VolumeReference &own = store->volume(i).reference;
    const DensityNow now = density(i);
    const double denser = now.bonded - own.own.rho;
    if (now.unbonded == 0.0 || (at_rest_only && std::fabs(denser) > AT_REST * own.own.rho))
      continue;
    own.gap = std::max(own.gap, now.unbonded + std::max(0.0, denser));
    own.torn = 1.0;
  }
}

// The bonds of an atom that are left after partners were deleted, or got another pair style: the reference loses their
// shares at deq, and is that of the bonds which are left where nothing else has changed it
void VolumeForces::lose_partners(VolumeRecord &record, const NeighborDensity &left)
{
  constexpr double ROUND_OFF = 1e-12;
  VolumeReference &reference = record.reference;
  if (reference.own.slope == 0.0) return;
  const double negligible = ROUND_OFF * reference.own.slope;
  if (std::fabs(record.at_rest.rho - left.rho) <= negligible) return;
  reference.gap =
      std::max(std::min(0.0, reference.gap), reference.gap + (record.at_rest.rho - left.rho));
  reference.own = {left.rho + (reference.own.rho - record.at_rest.rho),
                   left.slope + (reference.own.slope - record.at_rest.slope)};
  if (!(reference.own.slope > negligible)) reference = {};
  record.at_rest = left;
}

void VolumeForces::pair_leaves(PairLists &lists, int i, int j, double dlim) const
{
  if (!(dlim > 0.0) || !are_pair(i, j, false)) return;
  demand_room(lists.unbonded, 1, error);
  lists.unbonded.set(lists.unbonded.size(), j, dlim, dlim);
  lists.unbonded.add_row(i, 1);
}

double VolumeForces::pair_begins(PairLists &lists, int i, int j, double d, double alpha)
{
  if (!are_pair(i, j, true)) return HUGE_VAL;
  for (const PackedRow &row : lists.unbonded.rows) {
    if (row.i != i) continue;
    const auto *const begin = lists.unbonded.j.data();
    const auto *const at = std::find(begin + row.first, begin + row.last, j);
    if (at == begin + row.last) continue;
    lists.unbonded.remove({(int) (at - begin)});
    break;
  }
  const double dlim = reach(alpha) * (atom->radius[i] + atom->radius[j]);
  const Kind kind = are_pair(i, j, false) ? COUNTED : OF_TWO_BODIES;
  const double t = std::max(0.0, 1.0 - d / dlim);
  joined.resize(2 * (size_t) lists.nall, 0.0);
  joined[2 * (size_t) i + kind] += t * t;
  if (j < lists.nreact) joined[2 * (size_t) j + kind] += t * t;
  return 1.0 / dlim;
}

void VolumeForces::commit_joins(const PairLists &lists)
{
  if (!on_any(!joined.empty(), world)) return;
  joined.resize(2 * (size_t) lists.nall, 0.0);
  exchange.reverse_comm(joined);
  for (int i = 0; i < lists.nlocal; i++) {
    VolumeReference &own = store->volume(i).reference;
    const double *const share = &joined[2 * (size_t) i];
    if (share[COUNTED] > 0.0) own = VolumeLaw::with(own, density(i), share[COUNTED]);
    own.own.rho += share[OF_TWO_BODIES];
  }
  joined.clear();
}

// Collective. Bonds that end at the end of the step count as new pairs at once, so that the next set-up finds the same
// forces; those past their dlim have no share any more
void VolumeForces::find_leaving(const PairLists &lists, const std::vector<int> &ended)
{
  leaving.clear();
  if (!on_any(!ended.empty() || !far.empty(), world)) return;
  constexpr double SOME = std::numeric_limits<double>::min();    // tells that one leaves
  Values shares(densities.size(), 0.0);                          // of densities now, by Kind
  const auto add = [&](int i, double share, Kind kind) {
    shares[2 * (size_t) i + kind] += std::max(share, SOME);
  };
  for (const int i : far) add(i, 0.0, COUNTED);
  for (const int k : ended) {
    const int i = lists.bonds.owner_of(k), j = lists.bonds.j[k];
    const double dlim = 1.0 / lists.bonds.inv_dlim[k];
    const double d = std::sqrt(PairGeometry(scene::rows(atom->x), i, j).dsq);
    if (!(dlim > 0.0) || (end_at_dlim && !(d < dlim))) continue;
    const Kind kind = are_pair(i, j, false) ? COUNTED : OF_TWO_BODIES;
    NeighborDensity now{};
    now.add(d, dlim);
    add(i, now.rho, kind);
    if (j < lists.nreact) add(j, now.rho, kind);
    if (kind == OF_TWO_BODIES) continue;
    demand_room(active, 1, error);
    active.set(active.size(), j, dlim, dlim);
    active.add_row(i, 1);
  }
  exchange.reverse_comm(shares);

  for (int i = 0; i < lists.nlocal; i++) {
    const double *const share = &shares[2 * (size_t) i];
    if (share[COUNTED] + share[OF_TWO_BODIES] == 0.0 || !has_strain(i)) continue;
    VolumeReference left = store->volume(i).reference;
    left.own.rho -= share[OF_TWO_BODIES];
    densities[2 * (size_t) i] -= share[OF_TWO_BODIES];
    if (share[COUNTED] > 0.0) left = VolumeLaw::without(left, density(i), share[COUNTED]);
    densities[2 * (size_t) i] -= share[COUNTED];
    densities[2 * (size_t) i + 1] += share[COUNTED];
    leaving.push_back({i, left});
  }
}

void VolumeForces::commit()
{
  for (const Leaving &now : leaving) store->volume(now.i).reference = now.reference;
  leaving.clear();
  far.clear();
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
  return store->volume(i).reference;
}

// 0 of no pair, which a pair of another style is
double VolumeForces::dlim(const Coefficients &coefficients, int i, int j, bool is_bond) const
{
  if (!are_pair(i, j, is_bond)) return 0.0;
  const double alpha = coefficients.row(atom->type[i], atom->type[j]).alpha;
  return alpha == 0.0 ? 0.0 : reach(alpha) * (atom->radius[i] + atom->radius[j]);
}

// with a weight for each pair of types
double VolumeForces::sum_of_reaches(const Coefficients &coefficients) const
{
  double sum = 0.0, weight = 1.0;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) sum += weight++ * reach(coefficients.row(i, j).alpha);
  return sum;
}

// Collective. Of the atoms with bonds and their types, whatever the order of atoms and the number of MPI ranks
bigint VolumeForces::sum_of_partners() const
{
  uint64_t sum = 0;
  for (int i = 0; i < atom->nlocal; i++)
    if (!store->of(i).empty())
      sum += (((uint64_t) atom->tag[i] * 0x9E3779B97F4A7C15ULL) ^
              (0xD6E8FEB86659FD93ULL * (uint64_t) atom->type[i])) >>
          28;    // the sum of 2^27 atoms does not overflow
  return reduce_all((bigint) sum, MPI_SUM, world);
}

// Was it recorded after the references were taken? A loose one that has joined since has none, and never counts
bool VolumeForces::is_new(int i) const
{
  return store->volume(i).reference.own.slope == 0.0 && !store->of(i).empty() &&
      !(store->has_history() && store->sphere(i).recorded == 0.0);
}

// Collective. The densities of the bonds of each atom at their deq, but for those whose partner, on any MPI rank, is gone,
// has another pair style, or never counts
std::vector<NeighborDensity> VolumeForces::at_rest(const Coefficients &coefficients,
                                                   bool takes) const
{
  std::vector<double> counts(atom->nlocal);
  for (int i = 0; i < atom->nlocal; i++)
    counts[i] = takes || is_new(i) || store->volume(i).reference.own.slope > 0.0;
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (const BondRecord &bond : store->of(i)) partners.push_back((tagint) bond.partner);
  const AtomDirectory directory(lmp, partners, counts.data());

  std::vector<NeighborDensity> sums(atom->nlocal, NeighborDensity{});
  for (int i = 0; i < atom->nlocal; i++)
    for (const BondRecord &bond : store->of(i)) {
      const AtomDirectory::Entry &partner = directory.entries.at((tagint) bond.partner);
      if (partner.type == 0 || counts[i] == 0.0 || partner.value == 0.0) continue;
      const double alpha = coefficients.row(atom->type[i], partner.type).alpha;
      if (alpha > 0.0) sums[i].add(bond.deq, reach(alpha) * (atom->radius[i] + partner.radius));
    }
  return sums;
}

// Collective. Where bonds have flowed or ended the bond file says what the references were; a fix that is new takes all for
// what they are at the deq of now. Else only those of atoms that are new
void VolumeForces::set_references(const std::vector<NeighborDensity> &rest, bool takes)
{
  std::vector<char> is_known(atom->nlocal, 0);
  bigint unknown = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    VolumeRecord &own = store->volume(i);
    const bool is_of_file = store->reaches == 0.0 && own.reference.own.slope > 0.0;
    is_known[i] = takes ? is_of_file : !is_new(i);
    if (takes || !is_known[i]) own.at_rest = rest[i];
    if (is_known[i]) continue;
    own.reference = {rest[i], 0.0, 0.0};
    unknown += takes && store->has_history() && !store->sphere(i).is_new(store->of(i).size());
  }
  set_gaps(is_known);
  unknown = reduce_all(unknown, MPI_SUM, world);
  if (unknown > 0 && comm->me == 0)
    error->warning(FLERR,
                   "{}: the densities at rest of {} atoms whose bonds have flowed or ended are not "
                   "known, and are taken from the bonds of now: define the fix before the first "
                   "run, and right after read_restart",
                   who, unknown);
}

void VolumeForces::note_bonds_at_rest(const PairLists &lists)
{
  Values sums((size_t) VolumePasses::WIDTH * lists.nall, 0.0);
  EVP::for_each_pair(lists.bonds, scene::rows(atom->x), [&](const PlacedPair &p) {
    const double inv_dlim = lists.bonds.inv_dlim[p.index];
    if (!(inv_dlim < HUGE_VAL)) return;    // of a pair of another style
    NeighborDensity share{};
    share.add(1.0 / p.inv_deq, 1.0 / inv_dlim);
    for (const int i : {p.i, p.j}) {
      if (i == p.j && p.j >= lists.nreact) continue;
      sums[2 * (size_t) i] += share.rho;
      sums[2 * (size_t) i + 1] += share.slope;
    }
  });
  exchange.reverse_comm(sums);
  for (int i = 0; i < lists.nlocal; i++)
    store->volume(i).at_rest = {sums[2 * (size_t) i], sums[2 * (size_t) i + 1]};
}

// Collective. The gap of each atom to the mean of its type, of those that are not at a surface: these have a slope far below
// the mean, which that of all atoms begins.
void VolumeForces::set_gaps(const std::vector<char> &is_known)
{
  constexpr int ROUNDS = 5, WIDTH = 3;
  constexpr double SURFACE = 0.85;
  std::vector<NeighborDensity> mean(atom->ntypes + 1, NeighborDensity{});
  for (int round = 0; round < ROUNDS; round++) {
    std::vector<double> sums(WIDTH * mean.size(), 0.0);
    for (int i = 0; i < atom->nlocal; i++) {
      const NeighborDensity &own = store->volume(i).at_rest;
      if (own.slope == 0.0 || own.slope < SURFACE * mean[atom->type[i]].slope) continue;
      double *const sum = &sums[WIDTH * (size_t) atom->type[i]];
      sum[0] += 1.0;
      sum[1] += own.rho;
      sum[2] += own.slope;
    }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), (int) sums.size(), MPI_DOUBLE, MPI_SUM, world);
    for (size_t type = 1; type < mean.size(); type++)
      if (const double *const sum = &sums[WIDTH * type]; sum[0] > 0.0)
        mean[type] = {sum[1] / sum[0], sum[2] / sum[0]};
  }
  for (int i = 0; i < atom->nlocal; i++) {
    VolumeReference &own = store->volume(i).reference;
    if (!is_known[i]) own.gap = std::max(0.0, mean[atom->type[i]].rho - own.own.rho);
  }
}

void VolumeForces::evaluate(const PairLists &lists, const ParticleView &view)
{
  densities.assign(VolumePasses::WIDTH * (size_t) lists.nall, 0.0);
  EndingBonds ends;
  if (ending) {
    ends.strains = ending->strains;
    ends.failure = ending->failure;
  }
  VolumePasses::add_densities(lists.bonds, lists.bonds.inv_dlim, view, densities.data(),
                              ending ? &ends : nullptr);
  VolumePasses::find_active(lists.unbonded, view, active);
  VolumePasses::add_densities(active, active.inv_deq, view, densities.data() + 1);
  exchange.reverse_comm(densities);
  if (ending) find_leaving(lists, ends.found);

  pulls.resize(densities.size());
  strains.resize(lists.nlocal);
  energy_here = 0.0;
  for (int i = 0; i < lists.nlocal; i++) {
    const VolumeState now = state(i);
    strains[i] = now.strain;
    pulls[2 * (size_t) i] = now.bonded;
    pulls[2 * (size_t) i + 1] = now.unbonded;
    energy_here += now.energy;
  }
  exchange.forward_comm(pulls);
  on_bonds = {lists.bonds.inv_dlim.data(), pulls.data()};
  on_others = {active.inv_deq.data(), pulls.data() + 1};
}

void VolumeForces::evaluate_aside(const PairLists &lists)
{
  const auto kept = std::make_tuple(leaving, energy_here, strains);
  evaluate(lists);
  std::tie(leaving, energy_here, strains) = kept;
}

}    // namespace EVP
