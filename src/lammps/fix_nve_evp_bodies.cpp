/* SPDX-License-Identifier: GPL-2.0-only

   Fix nve/evp: the bodies that damped pairs connect, each of which is solved by itself. */

#include "fix_nve_evp.h"

#include "pair_network.h"

#include "atom.h"
#include "comm.h"

#include <algorithm>

using namespace LAMMPS_NS;

/* ----------------------------------------------------------------------
   collective. Pairs of the list count within the cut-off or not, so that the bodies are valid until
   the next build. Atoms outside the group connect nothing: their velocity is prescribed
------------------------------------------------------------------------- */

void FixNVEEVP::find_bodies()
{
  const EVP::PairList &list = pair->packed_pairs();
  bodies_build = list.common_build;
  const int nall = atom->nlocal + atom->nghost;
  connected.assign(nall);
  lowest.assign((size_t) 3 * nall, EVP::NO_BODY);
  for (int i = 0; i < atom->nlocal; i++)
    if (in_group(i)) {
      lowest[(size_t) 3 * i + 1] = comm->me;
      lowest[(size_t) 3 * i + 2] = -comm->me;
    }

  int law = -1;
  bool damped = false;
  for (const auto &row : list.rows)
    for (int k = row.first; k < row.last; k++) {
      const int j = list.pairs.j()[k];
      if (connected.are_joined(row.i, j)) continue;
      const EVP::PackedPair p = list.pairs[k];
      if (p.law != law) {
        law = p.law;
        damped = pair->implicit_gamma(p) > 0.0;
      }
      if (!damped) continue;
      for (const int one : {row.i, j})
        if (in_group(one)) lowest[(size_t) 3 * one] = (double) atom->tag[one];
      if (in_group(row.i) && in_group(j)) connected.join(row.i, j);
    }

  spread_lowest();
  bodies.assign(lowest.data(), 3, atom->nlocal, bodies_across());
}

/* ----------------------------------------------------------------------
   collective. One iteration at most for each time that a body crosses from rank to rank
------------------------------------------------------------------------- */

void FixNVEEVP::spread_lowest()
{
  int any = 1;
  while (any) {
    int here = connected.spread_lowest(lowest, 3);
    if (lower_owners(lowest)) here = 1;
    to_ghosts(lowest);
    MPI_Allreduce(&here, &any, 1, MPI_INT, MPI_MAX, world);
  }
}

/* ----------------------------------------------------------------------
   collective. The labels of the bodies with atoms on several ranks, ascending
------------------------------------------------------------------------- */

std::vector<double> FixNVEEVP::bodies_across() const
{
  std::vector<double> own, all;
  for (int i = 0; i < atom->nlocal; i++) {
    const double *found = &lowest[(size_t) 3 * i];
    if (found[0] == (double) atom->tag[i] && found[1] != -found[2]) own.push_back(found[0]);
  }

  int here = (int) own.size(), any;
  MPI_Allreduce(&here, &any, 1, MPI_INT, MPI_SUM, world);
  if (any == 0) return all;
  std::vector<int> counts(comm->nprocs), places(comm->nprocs);
  MPI_Allgather(&here, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int k = 1; k < comm->nprocs; k++) places[k] = places[k - 1] + counts[k - 1];
  all.resize(any);
  MPI_Allgatherv(own.data(), here, MPI_DOUBLE, all.data(), counts.data(), places.data(), MPI_DOUBLE,
                 world);
  std::sort(all.begin(), all.end());
  return all;
}
