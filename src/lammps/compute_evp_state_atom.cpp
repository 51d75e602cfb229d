// SPDX-License-Identifier: GPL-2.0-only

#include "compute_evp_state_atom.h"

#include "pair_network.h"
#include "scene.h"

#include "memory.h"

using namespace LAMMPS_NS;

ComputeEVPStateAtom::ComputeEVPStateAtom(LAMMPS *lmp, int narg, char **arg) :
    NodalExchange(lmp, narg, arg)
{
  if (narg != 3) error->all(FLERR, "{}: unexpected argument '{}'", who, arg[3]);
  peratom_flag = 1;
  size_peratom_cols = 4;
  comm_reverse = NCOUNTS;
}

ComputeEVPStateAtom::~ComputeEVPStateAtom()
{
  memory->destroy(array_atom);
}

void ComputeEVPStateAtom::init()
{
  PairNetwork::require(force, error, who);
}

void ComputeEVPStateAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  if (atom->nmax > nmax) {
    nmax = atom->nmax;
    memory->grow(array_atom, nmax, size_peratom_cols, "evp/state/atom:array_atom");
  }

  const auto *network = PairNetwork::find_present(force);
  if (!network)
    error->all(FLERR,
               "{} needs the pairs of the present positions: use it in a run, or after 'run 0'",
               who);
  const EVP::PairList &list = network->packed_pairs();
  const int nreact = force->newton_pair ? list.nall : list.nlocal;
  counts.assign((size_t) NCOUNTS * list.nall, 0.0);
  EVP::for_each_pair(list, EVP::scene::rows(atom->x), [&](const EVP::PlacedPair &p) {
    if (p.is_beyond()) return;
    const bool second = network->law_of(p).regime(p.distance(), 1.0 / p.inv_deq, p.offset) == 2;
    for (const int owner : {p.i, p.j}) {
      if (owner == p.j && p.j >= nreact) continue;
      double *count = &counts[(size_t) NCOUNTS * owner];
      count[p.is_bond() ? WITHIN : FRESH] += 1.0;
      if (p.is_bond() && second) count[SECOND] += 1.0;
    }
  });
  to_owners(counts);

  const EVP::BondStore *bonds = network->bonds();
  for (int i = 0; i < atom->nlocal; i++) {
    double *state = array_atom[i];
    const double *count = &counts[(size_t) NCOUNTS * i];
    const bool in_group = atom->mask[i] & groupbit;
    const double recorded = (in_group && bonds) ? (double) bonds->of(i).size() : 0.0;
    state[0] = recorded;
    state[1] = recorded > 0.0 ? count[SECOND] / recorded : 0.0;
    state[2] = recorded > 0.0 ? 1.0 - count[WITHIN] / recorded : 0.0;
    state[3] = in_group ? count[FRESH] : 0.0;
  }
}
