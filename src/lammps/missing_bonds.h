// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "lammps_names.h"

namespace EVP {

/// What the bonds hold that left the neighbor list, as they are past its end, and what they dissipated on the way to their
/// cutoffs; those of two atoms on two MPI ranks by half [energy].
struct MissingBonds {
  double held, dissipated;
};

/// Collective, where the list was just packed. Bonds that the list does not have have flowed up to their cutoffs, or have
/// broken where bonds break, whether or not the list saw them pass.
MissingBonds settle_missing_bonds(LAMMPS *, const class PairData *, BondStore &);

}    // namespace EVP
