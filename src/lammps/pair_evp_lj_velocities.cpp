/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: velocities of ghost atoms, which explicit damping reads. */

#include "pair_evp_lj.h"

#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "update.h"

using namespace LAMMPS_NS;

/* ----------------------------------------------------------------------
   damping takes part in dynamics only: a minimiser has no velocities to damp
------------------------------------------------------------------------- */

bool PairEVPLJ::damping_acts() const
{
  return any_gamma && update->whichflag != 2;
}

/* ----------------------------------------------------------------------
   collective. With 'comm_modify vel yes' LAMMPS has sent them already
------------------------------------------------------------------------- */

void PairEVPLJ::send_velocities()
{
  if (!comm->ghost_velocity) comm->forward_comm(this);
}

/* ----------------------------------------------------------------------
   images of a box that deforms with 'remap v' move with it
------------------------------------------------------------------------- */

int PairEVPLJ::pack_velocities(int n, const int *indices, double *buf, int pbc_flag,
                               const int *pbc) const
{
  const auto *const v = EVP::scene::rows(atom->v);
  for (int k = 0; k < n; k++)
    for (int c = 0; c < 3; c++) buf[3 * k + c] = v[indices[k]][c];

  if (pbc_flag && domain->deform_vremap) {
    const double *const rate = domain->h_rate;
    const double moves[3] = {pbc[0] * rate[0] + pbc[5] * rate[5] + pbc[4] * rate[4],
                             pbc[1] * rate[1] + pbc[3] * rate[3], pbc[2] * rate[2]};
    for (int k = 0; k < n; k++)
      if (atom->mask[indices[k]] & domain->deform_groupbit)
        for (int c = 0; c < 3; c++) buf[3 * k + c] += moves[c];
  }
  return 3 * n;
}
