/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: are the packed pairs those of the present atoms and positions? In a run they
   are. Between runs anything may have happened: commands and programs that use LAMMPS as a library
   change own atoms and leave ghosts and neighbor list as they were. */

#include "pair_evp_lj.h"

#include "fix_evp_bonds.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cstring>

using namespace LAMMPS_NS;
using EVP::scene::rows;

/* ---------------------------------------------------------------------- */

bool PairEVPLJ::is_packed() const
{
  if (packed_call != neighbor->ncalls || packed_step != neighbor->lastcall) return false;
  if (packed.nlocal != atom->nlocal || packed.nall != atom->nlocal + atom->nghost) return false;

  // between runs atoms may have gone and as many come, under the same IDs even
  if (update->whichflag != 0) return true;
  return !repack && packed_atoms == fingerprint_of_atoms() && !(bonds && bonds->find_misplaced());
}

/* ---------------------------------------------------------------------- */

bool PairEVPLJ::is_present()
{
  int here = is_packed(), all;
  MPI_Allreduce(&here, &all, 1, MPI_INT, MPI_MIN, world);
  if (!all || update->whichflag != 0) return all;
  if (built_comm != comm || built_skin != neighbor->skin) return false;    // commands changed them
  return update_ghosts() && !moved_too_far();
}

/* ----------------------------------------------------------------------
   another number where atoms of this process were exchanged for others, or changed
------------------------------------------------------------------------- */

uint64_t PairEVPLJ::fingerprint_of_atoms() const
{
  uint64_t sum = 0;
  const auto add = [&sum](uint64_t word) {
    sum = 1099511628211ULL * (sum ^ word);
  };
  for (int i = 0; i < atom->nlocal; i++) {
    uint64_t radius;
    memcpy(&radius, &atom->radius[i], sizeof(radius));
    add((uint64_t) atom->tag[i]);
    add((uint64_t) atom->type[i] ^ radius);
  }
  return sum;
}

/* ----------------------------------------------------------------------
   what the neighbor list was built with, and where, if LAMMPS itself keeps no note of that
   (neigh_modify check no)
------------------------------------------------------------------------- */

void PairEVPLJ::note_positions()
{
  built_comm = comm;
  built_skin = neighbor->skin;
  lammps_notes = neighbor->dist_check != 0;
  built_x.clear();
  if (!lammps_notes && packed.nall > 0)
    built_x.assign(atom->x[0], atom->x[0] + (size_t) 3 * packed.nall);
}

/* ----------------------------------------------------------------------
   collective. The list holds all pairs as long as no atom moved by more than half the skin
------------------------------------------------------------------------- */

bool PairEVPLJ::moved_too_far()
{
  if (lammps_notes) {
    const auto dangerous_builds = neighbor->ndanger;    // that a run has made
    const bool far = neighbor->check_distance() != 0;
    neighbor->ndanger = dangerous_builds;
    return far;
  }

  int far = 0, any;
  for (int i = 0; i < packed.nall; i++) {
    const double *x = atom->x[i], *then = &built_x[(size_t) 3 * i];
    const double dx = x[0] - then[0], dy = x[1] - then[1], dz = x[2] - then[2];
    if (dx * dx + dy * dy + dz * dz > 0.25 * built_skin * built_skin) far = 1;
  }
  MPI_Allreduce(&far, &any, 1, MPI_INT, MPI_MAX, world);
  return any != 0;
}

/* ----------------------------------------------------------------------
   collective. Ghosts take the positions of their owners, as at every step of a run. False where
   LAMMPS does not know whose they are
------------------------------------------------------------------------- */

bool PairEVPLJ::update_ghosts()
{
  updated_ghosts = 0;
  sends_positions = true;
  comm->forward_comm(this);
  sends_positions = false;

  int whole = updated_ghosts == atom->nghost, all;
  MPI_Allreduce(&whole, &all, 1, MPI_INT, MPI_MIN, world);
  return all != 0;
}

/* ----------------------------------------------------------------------
   three numbers of each atom: its velocity, or its position while update_ghosts() says so
------------------------------------------------------------------------- */

int PairEVPLJ::pack_forward_comm(int n, int *indices, double *buf, int pbc_flag, int *pbc)
{
  return sends_positions ? pack_positions(n, indices, buf, pbc_flag, pbc)
                         : pack_velocities(n, indices, buf, pbc_flag, pbc);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::unpack_forward_comm(int n, int first, double *buf)
{
  if (n == 0) return;
  std::copy_n(buf, (size_t) 3 * n, sends_positions ? atom->x[first] : atom->v[first]);
  if (sends_positions) updated_ghosts += n;
}

/* ---------------------------------------------------------------------- */

int PairEVPLJ::pack_positions(int n, const int *indices, double *buf, int pbc_flag,
                              const int *pbc) const
{
  const auto *const x = rows(atom->x);
  double image[3] = {0.0, 0.0, 0.0};
  if (pbc_flag) {
    const Domain &box = *domain;
    image[0] = pbc[0] * box.xprd;
    image[1] = pbc[1] * box.yprd;
    image[2] = pbc[2] * box.zprd;
    if (box.triclinic) {
      image[0] += pbc[5] * box.xy + pbc[4] * box.xz;
      image[1] += pbc[3] * box.yz;
    }
  }
  for (int k = 0; k < n; k++)
    for (int c = 0; c < 3; c++) buf[3 * k + c] = x[indices[k]][c] + image[c];
  return 3 * n;
}
