// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_BOND_FILE_READER_H
#define EVP_BOND_FILE_READER_H

#include "core/bond_store.h"

#include <functional>
#include <mpi.h>
#include <string>
#include <vector>

namespace LAMMPS_NS {
class Atom;
}

namespace EVP {

/// Collective. The bonds of a file in the format of core/bond_file.h, for each of this rank's own atoms,
/// in the order of the file; each bond is with both of its atoms.
///
/// Throws BadInput, the same on all ranks, if the file cannot be read, is in other units, names an atom
/// that does not exist or is not in the group, or holds more bonds than it admits with
/// deq > alpha(itype, jtype) (R_i + R_j). No two atoms may have the same ID.
std::vector<std::vector<Bond>> read_bond_file(const std::string &name, const std::string &units,
                                              const LAMMPS_NS::Atom *atom, int groupbit,
                                              const std::function<double(int, int)> &alpha,
                                              MPI_Comm world);

}    // namespace EVP

#endif
