// SPDX-License-Identifier: GPL-2.0-only

#include "measure_bonds.h"

#include "atom_directory.h"
#include "collective.h"

#include "atom.h"

#include <algorithm>
#include <vector>

namespace EVP {

BondMeasures measure_bonds(LAMMPS *lmp, const BondStore &store)
{
  const Atom *atom = lmp->atom;
  std::vector<tagint> partners;
  double longest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    for (const Bond &bond : store.of(i)) {
      partners.push_back((tagint) bond.partner);
      longest = std::max(longest, bond.deq);
    }
  const AtomDirectory directory(lmp, partners);

  BondCensus census(atom->ntypes, reduce_all(longest, MPI_MAX, lmp->world));
  for (int i = 0; i < atom->nlocal; i++) {
    const BondStore::Bonds &bonds = store.of(i);
    if (bonds.empty()) continue;
    census.add_particle(atom->type[i], (int64_t) bonds.size());
    for (const Bond &bond : bonds) {
      const int type = directory.entries.at((tagint) bond.partner).type;
      if (type) census.add_bond(atom->type[i], type, bond.deq);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, census.sums.data(), (int) census.sums.size(), MPI_LL, MPI_SUM,
                lmp->world);
  return census.measures();
}

}    // namespace EVP
