// SPDX-License-Identifier: GPL-2.0-only

#include "list_snapshot.h"

#include "collective.h"

#include <algorithm>
#include <cstring>

using namespace LAMMPS_NS;

void ListSnapshot::take_atoms(bool keep_radii)
{
  forget();
  nlocal = atom->nlocal;
  nall = atom->nlocal + atom->nghost;
  atoms = fingerprint();
  if (keep_radii) radii.assign(atom->radius, atom->radius + nall);
  if (neighbor->ago != 0) return;

  list_comm = comm;
  skin = neighbor->skin;
  lammps_notes = neighbor->dist_check != 0;    // not so with 'neigh_modify check no'
  list_x.clear();
  if (!lammps_notes && nall > 0) list_x.assign(atom->x[0], atom->x[0] + (size_t) 3 * nall);
}

// another number where atoms of this MPI rank were exchanged for others, or changed
uint64_t ListSnapshot::fingerprint() const
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

bool ListSnapshot::moved_too_far() const
{
  if (lammps_notes) {
    const auto dangerous_builds = neighbor->ndanger;    // that a run has made
    const bool far = neighbor->check_distance() != 0;
    neighbor->ndanger = dangerous_builds;
    return far;
  }

  bool far = false;
  for (int i = 0; i < nall; i++) {
    const double *x = atom->x[i], *then = &list_x[(size_t) 3 * i];
    const double dx = x[0] - then[0], dy = x[1] - then[1], dz = x[2] - then[2];
    if (dx * dx + dy * dy + dz * dz > 0.25 * skin * skin) far = true;
  }
  return EVP::on_any(far, world);
}
