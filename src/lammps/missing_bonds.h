// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "lammps_names.h"

namespace EVP {

/// Collective. Breaks the bonds that are beyond their cut-off without having been seen there in the
/// packed list: they left the neighbor list between two states of the body. Atoms and ghosts must be
/// those of the list; histories must have been returned.
void break_missing_bonds(LAMMPS *, const class PairNetwork *, BondStore &);

}    // namespace EVP
