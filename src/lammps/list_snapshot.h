// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_LIST_SNAPSHOT_H
#define LMP_EVP_LIST_SNAPSHOT_H

#include "pointers.h"

#include <cstdint>
#include <vector>

namespace LAMMPS_NS {

/// Notes of the neighbor list that pairs were packed from, and of its atoms. Between runs anything may
/// have happened: commands and programs that use LAMMPS as a library change own atoms and leave ghosts
/// and neighbor list as they were.
class ListSnapshot : protected Pointers {
 public:
  explicit ListSnapshot(LAMMPS *lmp) : Pointers(lmp) {}

  /// No list matches, until finish(): an error may be caught and something asked then.
  void forget() { call = -1; }

  /// When packing begins. keep_radii: radii may vary at every step.
  void take_atoms(bool keep_radii);

  /// When it is done.
  void finish();

  bool matches_list() const;     ///< the neighbor list, and the numbers of own atoms and ghosts
  bool matches_atoms() const;    ///< own atoms, their types and radii
  bool radii_changed() const;    ///< of own atoms and ghosts, where they were kept

  /// False where commands changed what makes ghosts and lists.
  bool matches_commands() const;

  /// Collective. The list holds all pairs as long as no atom moved by more than half the skin.
  bool moved_too_far() const;

 private:
  bigint call = -1, step = -1;    // of the neighbor list
  int nlocal = -1, nall = -1;
  uint64_t atoms = 0;    // see fingerprint()
  const class Comm *list_comm = nullptr;
  double skin = 0.0;
  bool lammps_notes = false;    // LAMMPS keeps positions at the neighbor build, else list_x
  std::vector<double> list_x;
  std::vector<double> radii;

  uint64_t fingerprint() const;
};

}    // namespace LAMMPS_NS

#endif
