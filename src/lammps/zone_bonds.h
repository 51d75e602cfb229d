// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_ZONE_BONDS_H
#define LMP_EVP_ZONE_BONDS_H

#include "core/bond_store.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS {

/// Collective. For each local atom of the group its bonds: partners in the group, within the zone and of
/// the same body, from a full neighbor list.
///
/// owner_x: positions of the owners of all atoms and ghosts, three values each [length].
/// zone: reach over R_i + R_j, 0 for alpha of the pair of types. bodies: of atoms and ghosts.
/// overlaps: number of the pairs of two bodies whose spheres overlap, over all ranks.
/// Throws BadInput, the same on all ranks, where two atoms coincide.
std::vector<EVP::BondStore::Bonds> find_zone_bonds(const LAMMPS *, const class NeighList *,
                                                   const std::vector<double> &owner_x, double zone,
                                                   int groupbit, const class AtomBodies &bodies,
                                                   const class PairNetwork *, bigint &overlaps);

}    // namespace LAMMPS_NS

#endif
