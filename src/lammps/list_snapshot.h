// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "collective.h"
#include "core/simd.h"
#include "lammps_names.h"

#include "atom.h"
#include "comm.h"
#include "neighbor.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace EVP {

/// Notes of the neighbor list that pairs were packed from, and of its atoms. Between runs anything may
/// have happened: commands and programs that use LAMMPS as a library change own atoms and leave ghosts
/// and neighbor list as they were.
class ListSnapshot : protected Pointers {
 public:
  explicit ListSnapshot(LAMMPS *lmp) : Pointers(lmp) {}

  /// No list matches, until finish(): an error may be caught and something asked then.
  void forget() { call = -1; }

  /// When packing begins. keep_radii: radii may vary at every step.
  void take_atoms(bool keep_radii)
  {
    forget();
    nlocal = atom->nlocal;
    nall = atom->nlocal + atom->nghost;
    atoms = fingerprint();
    if (keep_radii) radii.assign(atom->radius, atom->radius + nall);
    if (neighbor->ago != 0) return;

    list_comm = comm;
    skin = neighbor->skin;
    list_x.assign((size_t) 3 * nall, 0.0);
    if (nall > 0) std::copy_n(atom->x[0], list_x.size(), list_x.begin());
  }

  /// When it is done.
  void finish()
  {
    call = neighbor->ncalls;
    step = neighbor->lastcall;
  }

  /// The neighbor list, and the numbers of own atoms and ghosts.
  bool matches_list() const
  {
    return call == neighbor->ncalls && step == neighbor->lastcall && nlocal == atom->nlocal &&
        nall == atom->nlocal + atom->nghost;
  }

  /// Own atoms, their types, radii and molecules: some may have gone and as many come, under the
  /// same IDs even.
  bool matches_atoms() const { return atoms == fingerprint(); }

  /// Of own atoms and ghosts, where they were kept.
  bool radii_changed() const { return !std::equal(radii.begin(), radii.end(), atom->radius); }

  /// False where a command has replaced the communication or changed the skin.
  bool matches_commands() const { return list_comm == comm && skin == neighbor->skin; }

  /// Collective. The list holds all pairs as long as no atom moved by more than half the skin.
  bool moved_too_far() const
  {
    bool far = false;
    for (int i = 0; i < nall; i++) {
      const double *x = atom->x[i], *then = &list_x[(size_t) 3 * i];
      const double dx = x[0] - then[0], dy = x[1] - then[1], dz = x[2] - then[2];
      if (dx * dx + dy * dy + dz * dz > 0.25 * skin * skin) far = true;
    }
    return on_any(far, world);
  }

  double memory_usage() const { return bytes_of(list_x, radii); }

 private:
  bigint call = -1, step = -1;    // of the neighbor list
  int nlocal = -1, nall = -1;
  uint64_t atoms = 0;    // see fingerprint()
  const Comm *list_comm = nullptr;
  double skin = 0.0;
  std::vector<double> list_x;    // at the neighbor build
  std::vector<double> radii;

  // another number where atoms of this MPI rank were exchanged for others, or changed
  uint64_t fingerprint() const
  {
    constexpr uint64_t prime = 1099511628211ULL;
    uint64_t ids = 0, rest = 0;
    for (int i = 0; i < atom->nlocal; i++) {
      ids = prime * (ids ^ (uint64_t) atom->tag[i]);
      rest = prime * (rest ^ (uint64_t) atom->type[i] ^ bits_as<uint64_t>(atom->radius[i]));
    }
    for (int i = 0; atom->molecule && i < atom->nlocal; i++)
      rest = prime * (rest ^ (uint64_t) atom->molecule[i]);
    return ids ^ (rest * 0x9E3779B97F4A7C15ULL);
  }
};

}    // namespace EVP
