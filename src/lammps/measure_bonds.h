// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_MEASURE_BONDS_H
#define LMP_EVP_MEASURE_BONDS_H

#include "core/bond_measures.h"
#include "core/bond_store.h"

namespace LAMMPS_NS {

/// Collective. Of the records of all MPI ranks, the same bits on any number of them. A bond whose partner
/// was deleted counts for its atom, and for no pair of types.
EVP::BondMeasures measure_bonds(class LAMMPS *, const EVP::BondStore &);

}    // namespace LAMMPS_NS

#endif
