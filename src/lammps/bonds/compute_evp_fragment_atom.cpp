// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/bonds/compute_evp_fragment_atom.h"

#include "lammps/base/scene.h"
#include "lammps/pairs/pair_data.h"

#include "error.h"
#include "update.h"

#include <algorithm>
#include <numeric>
#include <vector>

using namespace LAMMPS_NS;
using namespace EVP;

namespace {

/// Which of the atoms here bonds hold together.
class Parts {
 public:
  explicit Parts(int n) : parent(n) { std::iota(parent.begin(), parent.end(), 0); }

  int part_of(int i)
  {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void join(int i, int j) { parent[part_of(i)] = part_of(j); }

 private:
  std::vector<int> parent;
};

}    // namespace

// compute ID group evp/fragment/atom
ComputeEVPFragmentAtom::ComputeEVPFragmentAtom(LAMMPS *lmp, int narg, char **arg) :
    WithPerAtomComm(lmp, narg, arg)
{
  if (narg > 3) error->all(FLERR, "{}: unknown keyword '{}'; it takes none", who, arg[3]);
  peratom_flag = 1;
  size_peratom_cols = 0;
  comm_forward = comm_reverse = 1;
}

void ComputeEVPFragmentAtom::init()
{
  PairData::require(force, error, who);
}

// Collective. Parts of an MPI rank become one where a fragment reaches over it: as often as a fragment passes from rank to rank
void ComputeEVPFragmentAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  if (atom->nmax > nmax) {
    nmax = atom->nmax;
    memory->grow(vector_atom, nmax, "evp/fragment/atom:vector_atom");
  }
  const PairLists &list = PairData::require_present(force, error, who)->packed_pairs();
  const auto in_group = [this](int i) {
    return (atom->mask[i] & groupbit) != 0;
  };
  Parts parts(list.nall);
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &pair) {
    if (pair.is_bond && pair.acts() && in_group(pair.i) && in_group(pair.j))
      parts.join(pair.i, pair.j);
  });

  lowest.resize(list.nall);
  for (int i = 0; i < list.nall; i++) lowest[i][0] = (double) atom->tag[i];
  std::vector<double> of_part(list.nall);
  for (bool changes = true; on_any(changes, world);) {
    forward_comm(lowest);
    std::fill(of_part.begin(), of_part.end(), (double) MAXTAGINT);
    for (int i = 0; i < list.nall; i++) {
      double &first = of_part[parts.part_of(i)];
      first = std::min(first, lowest[i][0]);
    }
    changes = false;
    for (int i = 0; i < list.nall; i++) {
      const double first = of_part[parts.part_of(i)];
      changes = changes || first < lowest[i][0];
      lowest[i][0] = first;
    }
    reverse_comm(lowest);
  }
  for (int i = 0; i < list.nlocal; i++) vector_atom[i] = in_group(i) ? lowest[i][0] : 0.0;
}

void ComputeEVPFragmentAtom::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++) {
    double &own = lowest[indices[k]][0];
    own = std::min(own, buf[k]);
  }
}

double ComputeEVPFragmentAtom::memory_usage()
{
  return (double) nmax * sizeof(double) + bytes_of(lowest);
}
