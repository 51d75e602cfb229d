// SPDX-License-Identifier: GPL-2.0-only

#include "missing_bonds.h"

#include "atom_directory.h"
#include "pair_network.h"
#include "scene.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace EVP {

void settle_missing_bonds(LAMMPS *lmp, const PairNetwork *network, BondStore &store)
{
  const Atom *atom = lmp->atom;
  const auto *x = scene::rows(atom->x);
  std::vector<std::pair<tagint, int>> atoms;    // own and ghosts: of an ID there may be many
  for (int k = 0; k < atom->nlocal + atom->nghost; k++) atoms.emplace_back(atom->tag[k], k);
  std::sort(atoms.begin(), atoms.end());

  const auto settle = [&](int i, int slot, const AtomDirectory::Entry &other) {
    PairHistory &history = store.histories_of(i)[slot];
    history = network->past_cutoff(history, i, other.type, other.radius, store.of(i)[slot].deq);
  };
  // a partner that is not even a ghost is far away, or was deleted
  std::vector<std::pair<int, int>> far_away;    // atom and slot
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (int slot = 0; slot < (int) store.of(i).size(); slot++) {
      const Bond &bond = store.of(i)[slot];
      if (store.histories_of(i)[slot].broken != 0.0) continue;
      const auto partner = (tagint) bond.partner;
      auto at = std::lower_bound(atoms.begin(), atoms.end(), std::pair(partner, 0));
      if (at == atoms.end() || at->first != partner) {
        far_away.emplace_back(i, slot);
        partners.push_back(partner);
        continue;
      }
      const AtomDirectory::Entry other = {atom->type[at->second], atom->radius[at->second]};
      const double cut = network->cut_of_bond(i, other.type, other.radius, bond.deq);
      bool within = false;
      for (; at != atoms.end() && at->first == partner; ++at)
        within = within || PairGeometry(x, i, at->second).dsq <= reach_squared(cut, BOND_MARGIN);
      if (!within) settle(i, slot, other);
    }

  const AtomDirectory directory(lmp, partners);
  for (size_t k = 0; k < partners.size(); k++) {
    const AtomDirectory::Entry other = directory.entries.at(partners[k]);
    if (other.type != 0) settle(far_away[k].first, far_away[k].second, other);
  }
}

}    // namespace EVP
