// SPDX-License-Identifier: GPL-2.0-only

#include "volume_forces.h"

#include "atom_directory.h"
#include "collective.h"
#include "pair_list_builder.h"

#include "comm.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <cmath>
#include <tuple>
#include <utility>

namespace EVP {

VolumeForces::VolumeForces(LAMMPS *lmp, const std::string &who_in, int groupbit_in,
                           const std::vector<double> &kv_in, std::vector<Record> &records_in,
                           PerAtomComm &exchange_in) :
    Pointers(lmp),
    who(who_in), groupbit(groupbit_in), from_rows(kv_in.empty()), kv(kv_in), records(records_in),
    exchange(exchange_in)
{
  if (from_rows) kv.assign(lmp->atom->ntypes + 1, 0.0);
}

std::shared_ptr<VolumeForces> VolumeForces::find(const Modify *modify)
{
  const auto forces = scene::find_shared<VolumeForces>(modify, "evp/volume", "volume");
  return forces && forces->acts() ? forces : nullptr;
}

void VolumeForces::pack(const NeighList *neighbors, PairLists &lists, const BondStore &store,
                        const Coefficients &coefficients, const PairRules &rules)
{
  within = store.within;
  zone = store.zone;
  bonds_break = rules.breaks();
  leaving.clear();
  far.clear();
  const double reaches_now = sum_of_reaches(coefficients);
  const bool is_new = store.version() != version || reaches_now != reaches;
  reaches = reaches_now;
  version = store.version();
  // the records may have come with a restart file, or the store may be another of the same bonds
  const bool takes = is_new && !on_all(are_of(store), world);
  if (const bigint now = sum_of_partners(store); std::exchange(partners, now) != now || takes) {
    const std::vector<NeighborDensity> rest = at_rest(store, coefficients, false);
    if (takes) take_records(store, rest, at_rest(store, coefficients, true));
    for (int i = 0; i < atom->nlocal; i++) lose_partners(records[i], rest[i]);
  }

  has_bonds.assign(VolumePasses::WIDTH * (size_t) lists.nall, 0.0);
  for (int i = 0; i < lists.nlocal; i++)
    has_bonds[VolumePasses::WIDTH * (size_t) i] = has_strain(i);
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
    demand_room(lists.fresh, neighbors->numneigh[i], error);
    int n = 0;
    for (int jj = 0; jj < neighbors->numneigh[i]; jj++) {
      const int j = neighbors->firstneigh[i][jj] & NEIGHMASK;
      if (bonded_to[j] == i || scene::is_excluded(lmp->force, neighbors->firstneigh[i][jj]))
        continue;
      const double end = dlim(coefficients, i, j, false);
      if (end > 0.0) lists.fresh.set(lists.fresh.size() + n++, j, end);
    }
    lists.fresh.add_row(i, n);
  }

  const double now = neighbor->nex_type + neighbor->nex_group + neighbor->nex_mol;
  bool fewer = false;
  if (std::exchange(exclusions, now) != now) {
    for (int i = 0; i < atom->nlocal; i++) fewer = fewer || records[i].exclusions > now;
    fewer = on_any(fewer, world);
  }
  if (takes || fewer) fill_gaps(lists, takes);
}

// Pairs that are no bonds, and are there at rest or once an exclusion is undone, are surfaces of a crack that never had any.
// They have no force from that alone
void VolumeForces::fill_gaps(const PairLists &lists, bool at_rest_only)
{
  constexpr double AT_REST = 1e-6;
  evaluate(lists);
  for (int i = 0; i < lists.nlocal; i++) {
    VolumeReference &own = records[i].reference;
    records[i].exclusions = exclusions;
    const DensityNow now = density(i);
    const double denser = now.bonded - own.own.rho;
    if (now.fresh == 0.0 || (at_rest_only && std::fabs(denser) > AT_REST * own.own.rho)) continue;
    own.gap = std::max(own.gap, now.fresh + std::max(0.0, denser));
    own.torn = 1.0;
  }
}

// The bonds of an atom that are left after partners were deleted, or got another pair style: the reference loses their
// shares at deq, and is that of the bonds which are left where nothing else has changed it
void VolumeForces::lose_partners(Record &record, const NeighborDensity &left)
{
  constexpr double ROUND_OFF = 1e-12;
  VolumeReference &reference = record.reference;
  const double negligible = ROUND_OFF * reference.own.slope;
  if (std::fabs(record.at_rest.rho - left.rho) <= negligible) return;
  reference.gap = std::max(0.0, reference.gap + (record.at_rest.rho - left.rho));
  reference.own = {left.rho + (reference.own.rho - record.at_rest.rho),
                   left.slope + (reference.own.slope - record.at_rest.slope)};
  if (!(reference.own.slope > negligible)) reference = {};
  record.at_rest = left;
}

void VolumeForces::pair_leaves(PairLists &lists, int i, int j, double dlim) const
{
  if (!(dlim > 0.0)) return;
  demand_room(lists.fresh, 1, error);
  lists.fresh.set(lists.fresh.size(), j, dlim);
  lists.fresh.add_row(i, 1);
}

void VolumeForces::far_bond_leaves(int i, double deq, double alpha, double partner_radius)
{
  far.push_back({i, {}});
  far.back().at_rest.add(deq, reach(alpha) * (atom->radius[i] + partner_radius));
}

// Collective. Bonds past their cutoff break at the end of the step. They count as new pairs at once, so that the next set-up
// finds the same forces
void VolumeForces::find_leaving(const PairLists &lists)
{
  leaving.clear();
  if (!on_any(!past.empty() || !far.empty(), world)) return;
  // per atom: density now and at rest; slope at rest and the number of bonds
  std::array<Values, 2> shares = {Values(densities.size(), 0.0), Values(densities.size(), 0.0)};
  const auto add = [&](int i, const NeighborDensity &now, const NeighborDensity &at_rest) {
    shares[0][2 * (size_t) i] += now.rho;
    shares[0][2 * (size_t) i + 1] += at_rest.rho;
    shares[1][2 * (size_t) i] += at_rest.slope;
    shares[1][2 * (size_t) i + 1] += 1.0;
  };
  for (const FarBond &bond : far) add(bond.i, {}, bond.at_rest);
  for (const int k : past) {
    const int i = lists.bonds.owner_of(k), j = lists.bonds.j[k];
    const double dlim = 1.0 / lists.bonds.inv_dlim[k];
    if (!(dlim > 0.0)) continue;
    NeighborDensity now{}, at_rest{};
    now.add(std::sqrt(PairGeometry(scene::rows(atom->x), i, j).dsq), dlim);
    at_rest.add(1.0 / lists.bonds.inv_deq[k], dlim);
    add(i, now, at_rest);
    if (j < lists.nreact) add(j, now, at_rest);
    demand_room(active, 1, error);
    active.set(active.size(), j, dlim);
    active.add_row(i, 1);
  }
  for (Values &values : shares) exchange.reverse_comm(values);

  for (int i = 0; i < lists.nlocal; i++) {
    const double *const density_of = &shares[0][2 * (size_t) i],
                        *const rest_of = &shares[1][2 * (size_t) i];
    if (rest_of[1] == 0.0 || !has_strain(i)) continue;
    const Record &own = records[i];
    leaving.push_back({i,
                       VolumeLaw::without(own.reference, density(i), density_of[0]),
                       {own.at_rest.rho - density_of[1], own.at_rest.slope - rest_of[0]}});
    densities[2 * (size_t) i] -= density_of[0];
    densities[2 * (size_t) i + 1] += density_of[0];
  }
}

void VolumeForces::commit()
{
  for (const Leaving &now : leaving) {
    records[now.i].reference = now.reference;
    records[now.i].at_rest = now.at_rest;
  }
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
  return records[i].reference;
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

static double sum_of_deq(const BondStore::Bonds &bonds)
{
  double sum = 0.0;
  for (const Bond &bond : bonds) sum += bond.deq;
  return sum;
}

bool VolumeForces::are_of(const BondStore &store) const
{
  for (int i = 0; i < atom->nlocal; i++)
    if (records[i].sum_deq != sum_of_deq(store.of(i)) || records[i].reaches != reaches)
      return false;
  return true;
}

// Collective. Of the atoms with bonds and their types, whatever the order of atoms and the number of MPI ranks
bigint VolumeForces::sum_of_partners(const BondStore &store) const
{
  uint64_t sum = 0;
  for (int i = 0; i < atom->nlocal; i++)
    if (!store.of(i).empty())
      sum += (((uint64_t) atom->tag[i] * 0x9E3779B97F4A7C15ULL) ^
              (0xD6E8FEB86659FD93ULL * (uint64_t) atom->type[i])) >>
          28;    // the sum of 2^27 atoms does not overflow
  return reduce_all((bigint) sum, MPI_SUM, world);
}

// Collective. The densities of the bonds of each atom at their deq, but for those whose partner, on any MPI rank, is gone or
// has another pair style
std::vector<NeighborDensity> VolumeForces::at_rest(const BondStore &store,
                                                   const Coefficients &coefficients,
                                                   bool with_broken) const
{
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (const Bond &bond : store.of(i)) partners.push_back((tagint) bond.partner);
  const AtomDirectory directory(lmp, partners);

  std::vector<NeighborDensity> sums(atom->nlocal, NeighborDensity{});
  for (int i = 0; i < atom->nlocal; i++)
    for (size_t slot = 0; slot < store.of(i).size(); slot++) {
      const Bond &bond = store.of(i)[slot];
      const AtomDirectory::Entry &partner = directory.entries.at((tagint) bond.partner);
      if (partner.type == 0 || (!with_broken && store.is_broken(i, (int) slot))) continue;
      const double alpha = coefficients.row(atom->type[i], partner.type).alpha;
      if (alpha > 0.0) sums[i].add(bond.deq, reach(alpha) * (atom->radius[i] + partner.radius));
    }
  return sums;
}

// Where bonds have broken the bond file says what the references were; a fix that is new takes them for what they are at deq
void VolumeForces::take_records(const BondStore &store,
                                const std::vector<NeighborDensity> &unbroken,
                                const std::vector<NeighborDensity> &all)
{
  std::vector<Record> taken(records.size(), Record{});
  for (int i = 0; i < atom->nlocal; i++) {
    taken[i].sum_deq = sum_of_deq(store.of(i));
    taken[i].reaches = reaches;
    taken[i].at_rest = unbroken[i];
    taken[i].reference.own = all[i];
  }
  take_gaps(taken);
  std::vector<char> is_known(atom->nlocal, 0);
  for (const auto &one : store.densities_at_rest) is_known[one.i] = 1;
  bigint unknown = 0;
  for (int i = 0; i < atom->nlocal; i++)
    for (size_t slot = 0; slot < store.of(i).size(); slot++)
      if (store.is_broken(i, (int) slot)) {
        VolumeReference &own = taken[i].reference;
        own = {{unbroken[i].rho, own.own.slope}, own.gap + own.own.rho - unbroken[i].rho, 1.0};
        unknown += !is_known[i];
        break;
      }
  for (const auto &[i, rho, gap] : store.densities_at_rest)
    taken[i].reference = {{rho, taken[i].reference.own.slope}, gap, 1.0};
  records.swap(taken);
  unknown = reduce_all(unknown, MPI_SUM, world);
  if (unknown > 0 && comm->me == 0)
    error->warning(FLERR,
                   "{}: the densities at rest of {} atoms whose bonds have broken are not known, "
                   "and are taken from the bonds that are left: define the fix before the first "
                   "run, and right after read_restart",
                   who, unknown);
}

// Collective. The gap of each atom to the mean of its type, of those that are not at a surface: these have a slope far below
// the mean, which that of all atoms begins.
void VolumeForces::take_gaps(std::vector<Record> &taken) const
{
  constexpr int ROUNDS = 5, WIDTH = 3;
  constexpr double SURFACE = 0.85;
  std::vector<NeighborDensity> mean(atom->ntypes + 1, NeighborDensity{});
  for (int round = 0; round < ROUNDS; round++) {
    std::vector<double> sums(WIDTH * mean.size(), 0.0);
    for (int i = 0; i < atom->nlocal; i++) {
      const NeighborDensity &own = taken[i].reference.own;
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
    VolumeReference &reference = taken[i].reference;
    reference.gap = std::max(0.0, mean[atom->type[i]].rho - reference.own.rho);
  }
}

void VolumeForces::evaluate(const PairLists &lists, const ParticleView &view)
{
  densities.assign(VolumePasses::WIDTH * (size_t) lists.nall, 0.0);
  past.clear();
  VolumePasses::add_densities(lists.bonds, lists.bonds.inv_dlim, view, densities.data(),
                              bonds_break ? &past : nullptr);
  VolumePasses::find_active(lists.fresh, view, active);
  VolumePasses::add_densities(active, active.inv_deq, view, densities.data() + 1);
  exchange.reverse_comm(densities);
  if (bonds_break) find_leaving(lists);

  pulls.resize(densities.size());
  energy_here = 0.0;
  for (int i = 0; i < lists.nlocal; i++) {
    const VolumeState now = state(i);
    records[i].strain = now.strain;
    pulls[2 * (size_t) i] = now.bonded;
    pulls[2 * (size_t) i + 1] = now.fresh;
    energy_here += now.energy;
  }
  exchange.forward_comm(pulls);
}

void VolumeForces::evaluate_aside(const PairLists &lists)
{
  const auto kept = std::make_pair(leaving, energy_here);
  std::vector<double> strains(lists.nlocal);
  for (int i = 0; i < lists.nlocal; i++) strains[i] = records[i].strain;
  evaluate(lists);
  std::tie(leaving, energy_here) = kept;
  for (int i = 0; i < lists.nlocal; i++) records[i].strain = strains[i];
}

}    // namespace EVP
