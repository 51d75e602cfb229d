// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_measures.h"
#include "core/bond_store.h"
#include "lammps_names.h"

namespace EVP {

/// Collective. Of the records of all MPI ranks, the same bits on any number of them. A bond whose partner
/// was deleted counts for its atom, and for no pair of types.
BondMeasures measure_bonds(LAMMPS *, const BondStore &);

}    // namespace EVP
