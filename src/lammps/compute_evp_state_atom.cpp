/* SPDX-License-Identifier: GPL-2.0-only */

#include "compute_evp_state_atom.h"

#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "update.h"

#include <cmath>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

ComputeEVPStateAtom::ComputeEVPStateAtom(LAMMPS *lmp, int narg, char **arg) :
    NodalExchange(lmp, narg, arg), pair(nullptr), nmax(0)
{
  if (narg != 3)
    error->all(FLERR, "Compute {} evp/state/atom takes no further words, got '{}'", id, arg[3]);
  peratom_flag = 1;
  size_peratom_cols = 4;
  comm_reverse = NTALLIES;
}

/* ---------------------------------------------------------------------- */

ComputeEVPStateAtom::~ComputeEVPStateAtom()
{
  memory->destroy(array_atom);
}

/* ---------------------------------------------------------------------- */

void ComputeEVPStateAtom::init()
{
  pair = PairNetwork::require(force, error, fmt::format("Compute {} evp/state/atom", id));
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
  const EVP::BondStore *bonds = pair->bonds();
  for (int i = 0; i < atom->nlocal; i++) {
    double *state = array_atom[i];
    const double *tally = &tallies[(size_t) NTALLIES * i];
    const bool in_group = atom->mask[i] & groupbit;
    const double recorded = (in_group && bonds) ? (double) bonds->of(i).size() : 0.0;
    state[0] = recorded;
    state[1] = recorded > 0.0 ? tally[SECOND] / recorded : 0.0;
    state[2] = recorded > 0.0 ? 1.0 - tally[WITHIN] / recorded : 0.0;
    state[3] = in_group ? tally[FRESH] : 0.0;
  }
}

/* ---------------------------------------------------------------------- */

void ComputeEVPStateAtom::count_pairs()
{
  pair = PairNetwork::find_present(force);
  if (!pair)
    error->all(FLERR,
               "Compute {} evp/state/atom needs the pairs of the present positions: use it in a "
               "run, or after 'run 0'",
               id);

  const EVP::PairList &list = pair->packed_pairs();
  const int nreact = force->newton_pair ? list.nall : list.nlocal;
  const auto x = EVP::scene::rows(atom->x);
  tallies.assign((size_t) NTALLIES * list.nall, 0.0);
  for (const auto &row : list.rows)
    for (int k = row.first; k < row.last; k++) {
      const EVP::PackedPair &p = list.pairs[k];
      const EVP::PairGeometry g(x, row.i, p.j);
      if (g.dsq > p.cutsq) continue;
      const bool second = pair->law_of(p).regime(std::sqrt(g.dsq), 1.0 / p.inv_deq) == 2;
      const auto add = [&](int atom_index) {
        double *tally = &tallies[(size_t) NTALLIES * atom_index];
        tally[p.is_bond() ? WITHIN : FRESH] += 1.0;
        if (p.is_bond() && second) tally[SECOND] += 1.0;
      };
      add(row.i);
      if (p.j < nreact) add(p.j);
    }
  to_owners(tallies);
}

/* ---------------------------------------------------------------------- */

double ComputeEVPStateAtom::memory_usage()
{
  return (double) nmax * size_peratom_cols * sizeof(double) +
      (double) tallies.capacity() * sizeof(double);
}
