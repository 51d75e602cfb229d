// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_MISSING_BONDS_H
#define LMP_EVP_MISSING_BONDS_H

#include "core/bond_store.h"

namespace LAMMPS_NS {

/// Collective. Breaks the bonds that are beyond their cut-off without having been seen there in the
/// packed list: they left the neighbor list between two states of the body. Atoms and ghosts must be
/// those of the list; histories must have been returned.
void break_missing_bonds(class LAMMPS *, const class PairNetwork *, EVP::BondStore &);

}    // namespace LAMMPS_NS

#endif
