// SPDX-License-Identifier: GPL-2.0-only

#include "volume_forces.h"

#include "atom_directory.h"
#include "collective.h"
#include "user_input.h"

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

void VolumeForces::pack(const PairList &bonds, const BondStore &store,
                        const Coefficients &coefficients, bool collective)
{
  if (collective && store.version() != version) {
    // the records may have come with a restart file, or the store may be another of the same bonds
    if (!on_all(are_of(store), world)) take_records(store, coefficients);
    version = store.version();
  }
  energies.pack(bonds, [&](int i, const PackedPair &pair) {
    return coefficients.law(pair.law).row.alpha * (atom->radius[i] + atom->radius[pair.j]);
  });
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
    if (records[i].sum_deq != sum_of_deq(store.of(i))) return false;
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
    for (const Bond &bond : store.of(i)) {
      const AtomDirectory::Entry &partner = directory.entries.at((tagint) bond.partner);
      if (partner.type == 0) {
        complaint =
            fmt::format("atom {} has a bond with atom {}, which is gone, so that its weight "
                        "is not known: define the fix before atoms are deleted",
                        atom->tag[i], bond.partner);
        continue;
      }
      const double dlim =
          coefficients.row(atom->type[i], partner.type).alpha * (atom->radius[i] + partner.radius);
      taken[i].weight_sum += VolumeEnergy::weight(bond.deq, dlim);
    }
  }
  stop_at_bad_input(error, who, [&] {
    throw_together(complaint, world);
  });
  records.swap(taken);
}

void VolumeForces::evaluate(const PairLists &lists, const ParticleView &view)
{
  sums.assign(lists.nall, 0.0);
  if (lists.bonds.size() > 0) energies.add_strains(lists.bonds, view, sums.data());
  exchange.reverse_comm(sums);

  pulls.resize(lists.nall);
  energy_here = 0.0;
  for (int i = 0; i < lists.nlocal; i++) {
    const double weight_sum = records[i].weight_sum, stiffness = kv_of(i);
    const double theta = VolumeEnergy::strain(sums[i], weight_sum);
    records[i].strain = theta;
    pulls[i] = VolumeEnergy::pull(stiffness, theta, weight_sum);
    energy_here += 0.5 * stiffness * theta * theta;
  }
  exchange.forward_comm(pulls);
}

}    // namespace EVP
