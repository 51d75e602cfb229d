// SPDX-License-Identifier: GPL-2.0-only

#include "damped_bodies.h"

#include "collective.h"
#include "scene.h"

#include "comm.h"

#include <algorithm>

namespace EVP {

void DampedBodies::find(const PairLists &list, int groupbit,
                        const std::function<double(const PackedPair &)> &gamma_of)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  const auto in_group = [&](int i) {
    return (atom->mask[i] & groupbit) != 0;
  };
  found_build = list.common_build;
  connected.assign(nall);
  lowest.assign((size_t) 3 * nall, NO_BODY);
  for (int i = 0; i < nlocal; i++)
    if (in_group(i)) {
      lowest[(size_t) 3 * i + 1] = comm->me;
      lowest[(size_t) 3 * i + 2] = -comm->me;
    }

  int law = -1;
  bool damped = false;
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (connected.are_joined(p.i, p.j)) return;
    if (p.law != law) {
      law = p.law;
      damped = gamma_of(p) > 0.0;
    }
    if (!damped) return;
    for (const int one : {p.i, p.j})
      if (in_group(one)) lowest[(size_t) 3 * one] = (double) atom->tag[one];
    if (in_group(p.i) && in_group(p.j)) connected.join(p.i, p.j);
  });

  // one iteration at most for each time that a body crosses from rank to rank
  for (bool fell = true; fell; fell = on_any(fell, world)) {
    fell = connected.spread_lowest(lowest, 3);
    if (exchange.lower_owners(lowest)) fell = true;
    exchange.to_ghosts(lowest);
  }
  bodies.assign(lowest.data(), 3, nlocal, labels_across());
}

// Collective. The labels of the bodies with atoms on several ranks, ascending.
std::vector<double> DampedBodies::labels_across() const
{
  std::vector<double> own, all;
  for (int i = 0; i < atom->nlocal; i++) {
    const double *found = &lowest[(size_t) 3 * i];
    if (found[0] == (double) atom->tag[i] && found[1] != -found[2]) own.push_back(found[0]);
  }

  int here = (int) own.size();
  const int any = reduce_all(here, MPI_SUM, world);
  if (any == 0) return all;
  std::vector<int> counts(comm->nprocs), offsets(comm->nprocs);
  MPI_Allgather(&here, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int k = 1; k < comm->nprocs; k++) offsets[k] = offsets[k - 1] + counts[k - 1];
  all.resize(any);
  MPI_Allgatherv(own.data(), here, MPI_DOUBLE, all.data(), counts.data(), offsets.data(),
                 MPI_DOUBLE, world);
  std::sort(all.begin(), all.end());
  return all;
}

}    // namespace EVP
