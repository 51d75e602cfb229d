// SPDX-License-Identifier: GPL-2.0-only

#include "volume_forces.h"

#include "atom_directory.h"
#include "collective.h"
#include "user_input.h"

#include "neigh_list.h"

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
                        const Coefficients &coefficients)
{
  within = store.within;
  zone = store.zone;
  const double reaches_now = sum_of_reaches(coefficients);
  if (store.version() != version || reaches_now != reaches) {
    reaches = reaches_now;
    // the records may have come with a restart file, or the store may be another of the same bonds
    if (!on_all(are_of(store), world)) take_records(store, coefficients);
    version = store.version();
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
    for (PairList *list : {&lists.parted, &lists.fresh}) list->make_room(neighbors->numneigh[i]);
    int nparted = 0, nfresh = 0;
    for (int jj = 0; jj < neighbors->numneigh[i]; jj++) {
      const int j = neighbors->firstneigh[i][jj] & NEIGHMASK;
      if (bonded_to[j] == i || scene::is_excluded(lmp->force, neighbors->firstneigh[i][jj]))
        continue;
      const bool recorded = store.find(i, atom->tag[j]);
      const double reach = dlim(coefficients, i, j, recorded);
      if (reach == 0.0) continue;
      PairList &list = recorded ? lists.parted : lists.fresh;
      list.set(list.size() + (recorded ? nparted++ : nfresh++), j, reach);
    }
    lists.parted.add_row(i, nparted);
    lists.fresh.add_row(i, nfresh);
  }
}

// 0 of no pair, which a pair of another style is
double VolumeForces::dlim(const Coefficients &coefficients, int i, int j, bool recorded) const
{
  if (!are_pair(i, j, recorded)) return 0.0;
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

// partners may be on any MPI rank
void VolumeForces::take_records(const BondStore &store, const Coefficients &coefficients)
{
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (const Bond &bond : store.of(i)) partners.push_back((tagint) bond.partner);
  const AtomDirectory directory(lmp, partners);

  std::vector<Record> taken(records.size(), Record{});
  std::string complaint;
  for (int i = 0; i < atom->nlocal; i++) {
    taken[i].sum_deq = sum_of_deq(store.of(i));
    taken[i].reaches = reaches;
    for (const Bond &bond : store.of(i)) {
      const AtomDirectory::Entry &partner = directory.entries.at((tagint) bond.partner);
      if (partner.type == 0) {
        complaint =
            fmt::format("atom {} has a bond with atom {}, which is gone, so that its share in the "
                        "density at rest is not known: define the fix before atoms are deleted",
                        atom->tag[i], bond.partner);
        continue;
      }
      const double alpha = coefficients.row(atom->type[i], partner.type).alpha;
      if (alpha == 0.0) continue;
      taken[i].reference.own.add(bond.deq, reach(alpha) * (atom->radius[i] + partner.radius));
    }
  }
  stop_at_bad_input(error, who, [&] {
    throw_together(complaint, world);
  });
  take_gaps(taken);
  records.swap(taken);
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
  VolumePasses::add_densities(lists.bonds, lists.bonds.inv_dlim, view, densities.data());
  for (size_t of = 0; of < active.size(); of++) {
    VolumePasses::find_active(of == 0 ? lists.parted : lists.fresh, view, active[of]);
    VolumePasses::add_densities(active[of], active[of].inv_deq, view, densities.data() + of);
  }
  exchange.reverse_comm(densities);

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

}    // namespace EVP
