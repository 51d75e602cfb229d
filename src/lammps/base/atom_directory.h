// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps/base/lammps_names.h"

#include <unordered_map>
#include <vector>

namespace EVP {

/// Atoms by ID, on whichever MPI rank they are now. A rank that is chosen by a hash of the ID keeps the
/// atom and answers for it (Comm::rendezvous): memory grows with the atoms of a rank, not with the
/// highest ID. LAMMPS stops where the messages of a rank exceed 2 GiB, above 40 million atoms of its own.
class AtomDirectory {
 public:
  struct Entry {
    int type;    ///< 0: there is no such atom
    double radius;
    double value;    ///< as given, else 0
  };
  tagint twice = 0;    ///< an ID that two atoms have; the same on all ranks
  std::unordered_map<tagint, Entry> entries;    ///< of the IDs asked for

  /// Collective. ids: those that this rank asks for, which may repeat. values: of own atoms.
  explicit AtomDirectory(LAMMPS *, const std::vector<tagint> &ids = {},
                         const double *values = nullptr);
};

}    // namespace EVP
