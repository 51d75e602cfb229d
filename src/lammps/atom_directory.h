/* SPDX-License-Identifier: GPL-2.0-only

   Atoms by ID, on whichever rank they are. */

#ifndef LMP_EVP_ATOM_DIRECTORY_H
#define LMP_EVP_ATOM_DIRECTORY_H

#include "lmptype.h"

#include <cstddef>
#include <mpi.h>
#include <vector>

namespace LAMMPS_NS {

/// What all ranks know of the atoms, shared out over the ranks by a hash of the ID: the memory of each
/// rank grows with its atoms, not with the highest ID.
class AtomDirectory {
 public:
  struct Entry {
    tagint id;
    int type;    ///< 0: there is no such atom
    int mask;    ///< bits of its groups
    double radius;
  };

  /// Collective. Takes the atoms as they are now.
  AtomDirectory(const class Atom *, MPI_Comm);

  /// Collective. An ID that more than one atom has, 0 if all differ. The same on all ranks.
  tagint find_twice() const;

  /// Collective. The atoms of these IDs, in their order; each rank asks for its own.
  std::vector<Entry> find(const std::vector<tagint> &ids) const;

 private:
  MPI_Comm world;
  int nranks;
  size_t piece;                  // most items that a rank sends at once
  std::vector<Entry> entries;    // those kept here, by ID

  class Routes;
  int rank_of(tagint id) const;
  size_t rounds(size_t items) const;
  Entry find_here(tagint id) const;
};

}    // namespace LAMMPS_NS

#endif
