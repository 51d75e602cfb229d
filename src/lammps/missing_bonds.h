// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "lammps_names.h"

namespace EVP {

/// Collective. Bonds that are beyond their cut-off without having been seen there in the packed list
/// flow up to it, and break where bonds do: they left the neighbor list between two runs, or in a
/// minimization. Atoms and ghosts must be those of the list; histories must have been returned.
void settle_missing_bonds(LAMMPS *, const class PairNetwork *, BondStore &);

}    // namespace EVP
