// SPDX-License-Identifier: GPL-2.0-only

#include "missing_bonds.h"

#include "atom_directory.h"
#include "pair_data.h"
#include "scene.h"

#include "neighbor.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace EVP {

MissingBonds settle_missing_bonds(LAMMPS *lmp, const PairData *pair_data, BondStore &store)
{
  const Atom *atom = lmp->atom;
  const auto *x = scene::rows(atom->x);
  const double *const *cutneighsq = lmp->neighbor->cutneighsq;
  std::vector<std::pair<tagint, int>> atoms;    // own and ghosts: of an ID there may be many
  for (int k = 0; k < atom->nlocal + atom->nghost; k++) atoms.emplace_back(atom->tag[k], k);
  std::sort(atoms.begin(), atoms.end());

  MissingBonds found{};
  const auto settle = [&](int i, int slot, int type, double radius) {
    const Bond &bond = store.of(i)[slot];
    PairHistory *const history = store.has_history() ? &store.histories_of(i)[slot] : nullptr;
    const Offset before = history ? Offset{history->q, history->k} : Offset{};
    const PairState at =
        pair_data->state_at_cutoff(atom->type[i], type, atom->radius[i] + radius, bond.deq, before);
    found.held += 0.5 * at.stored.total();
    found.dissipated += 0.5 * at.dissipated;
    if (!history) return;
    const double work = history->work + at.dissipated;
    *history = pair_data->rules.breaks() ? PairHistory{0.0, 0.0, work, 1.0}
                                         : PairHistory{at.offset.q, at.offset.k, work, 0.0};
  };

  struct Side {
    int i, slot;
  };
  std::vector<Side>
      far_away;    // with a partner that is not even a ghost: it is far, or was deleted
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (int slot = 0; slot < (int) store.of(i).size(); slot++) {
      if (store.has_history() && store.histories_of(i)[slot].broken != 0.0) continue;
      const auto partner = (tagint) store.of(i)[slot].partner;
      auto at = std::lower_bound(atoms.begin(), atoms.end(), std::pair(partner, 0));
      if (at == atoms.end() || at->first != partner) {
        far_away.push_back({i, slot});
        partners.push_back(partner);
        continue;
      }
      const int type = atom->type[at->second];
      const double radius = atom->radius[at->second];
      bool in_list = false;
      for (; at != atoms.end() && at->first == partner; ++at)
        in_list = in_list || PairGeometry(x, i, at->second).dsq <= cutneighsq[atom->type[i]][type];
      if (!in_list) settle(i, slot, type, radius);
    }

  const AtomDirectory directory(lmp, partners);
  for (size_t k = 0; k < partners.size(); k++) {
    const AtomDirectory::Entry &entry = directory.entries.at(partners[k]);
    if (entry.type != 0) settle(far_away[k].i, far_away[k].slot, entry.type, entry.radius);
  }
  return found;
}

}    // namespace EVP
