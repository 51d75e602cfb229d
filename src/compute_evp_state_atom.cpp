/* SPDX-License-Identifier: GPL-2.0-only */

#include "compute_evp_state_atom.h"

#include "fix_evp_bonds.h"
#include "lammps_compat.h"
#include "pair_evp_lj.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "update.h"

#include <cmath>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

ComputeEVPStateAtom::ComputeEVPStateAtom(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), pair(nullptr), nmax(0)
{
  if (narg != 3)
    error->all(FLERR, "Compute {} evp/state/atom takes no further words, got '{}'", id, arg[3]);
  peratom_flag = 1;
  size_peratom_cols = 4;
  comm_reverse = 3;
}

/* ---------------------------------------------------------------------- */

ComputeEVPStateAtom::~ComputeEVPStateAtom()
{
  memory->destroy(array_atom);
}

/* ---------------------------------------------------------------------- */

void ComputeEVPStateAtom::init()
{
  pair = PairEVPLJ::find(force);
  if (!pair)
    error->all(FLERR, "Compute {} evp/state/atom needs pair style evp/lj, found '{}'", id,
               force->pair_style ? force->pair_style : "none");
}

/* ---------------------------------------------------------------------- */

void ComputeEVPStateAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  if (atom->nmax > nmax) {
    memory->destroy(array_atom);
    nmax = atom->nmax;
    memory->create(array_atom, nmax, size_peratom_cols, "evp/state/atom:array_atom");
  }

  count_pairs();
  const FixEVPBonds *bonds = pair->bonds_fix();
  for (int i = 0; i < atom->nlocal; i++) {
    double *state = array_atom[i];
    const bool in_group = atom->mask[i] & groupbit;
    const double recorded = (in_group && bonds) ? bonds->bonds_of(i).count : 0.0;
    state[0] = recorded;
    state[1] = recorded > 0.0 ? tallies[i].second / recorded : 0.0;
    state[2] = recorded > 0.0 ? 1.0 - tallies[i].within / recorded : 0.0;
    state[3] = in_group ? tallies[i].fresh : 0.0;
  }
}

/* ---------------------------------------------------------------------- */

void ComputeEVPStateAtom::count_pairs()
{
  pair = PairEVPLJ::find(force);    // between runs it may be another than at init()
  int packed = pair && pair->is_packed(), all_packed;
  MPI_Allreduce(&packed, &all_packed, 1, MPI_INT, MPI_MIN, world);
  if (!all_packed)
    error->all(FLERR,
               "Compute {} evp/state/atom needs the pairs of the present positions: use it in a "
               "run, or after 'run 0'",
               id);

  const EVP::PackedList &list = pair->packed_pairs();
  const int nreact = force->newton_pair ? list.nall : list.nlocal;
  const auto x = reinterpret_cast<const double(*)[3]>(atom->x[0]);
  tallies.assign(list.nall, Tally{0.0, 0.0, 0.0});
  for (const auto &row : list.rows)
    for (int k = row.first; k < row.last; k++) {
      const EVP::PackedPair &p = list.pairs[k];
      const EVP::PairGeometry g(x, row.i, p.j);
      if (g.dsq > p.cutsq) continue;
      const bool second = pair->law_of(p).regime(std::sqrt(g.dsq), 1.0 / p.inv_deq) == 2;
      const auto add = [&](Tally &tally) {
        if (!p.is_bond)
          tally.fresh += 1.0;
        else {
          tally.within += 1.0;
          if (second) tally.second += 1.0;
        }
      };
      add(tallies[row.i]);
      if (p.j < nreact) add(tallies[p.j]);
    }
  if (force->newton_pair) EVP::compat::reverse_comm(comm, this);
}

/* ---------------------------------------------------------------------- */

int ComputeEVPStateAtom::pack_reverse_comm(int n, int first, double *buf)
{
  int m = 0;
  for (int i = first; i < first + n; i++) {
    buf[m++] = tallies[i].within;
    buf[m++] = tallies[i].second;
    buf[m++] = tallies[i].fresh;
  }
  return m;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPStateAtom::unpack_reverse_comm(int n, int *indices, double *buf)
{
  int m = 0;
  for (int k = 0; k < n; k++) {
    Tally &tally = tallies[indices[k]];
    tally.within += buf[m++];
    tally.second += buf[m++];
    tally.fresh += buf[m++];
  }
}

/* ---------------------------------------------------------------------- */

double ComputeEVPStateAtom::memory_usage()
{
  return (double) nmax * size_peratom_cols * sizeof(double) +
      (double) tallies.capacity() * sizeof(Tally);
}
