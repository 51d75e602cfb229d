// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps/pairs/pair_data.h"

#include <vector>

namespace EVP {

/// Of own atoms and ghosts: by how much they are larger than in the records, see thermal_growth().
using Growth = std::vector<double>;

/// The pairs of a new list, whose lengths are those of the records, get that of their atoms.
void grow_packed_pairs(PairData &, const Growth &);

/// Collective. Lengths of pairs change from the growth that they have to this one, at fixed distances: deq, up to where they act,
/// R_i + R_j of contacts, and what the volume energy counts up to. Returns the energy that this MPI rank gains.
double grow_pairs(PairData &, const Growth &);

}    // namespace EVP
