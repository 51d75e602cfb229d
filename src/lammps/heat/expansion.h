// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps/pairs/pair_data.h"

#include <functional>
#include <vector>

namespace EVP {

/// Of own atoms and ghosts: by how much they are larger than in the records, see thermal_growth().
using Growth = std::vector<double>;

/// Bonds with a particle that came() have been recorded at the temperatures of now: their records, and the list, get the lengths
/// at TREF.
void rest_at_growth(PairData &, const Growth &, const std::function<bool(int)> &came);

/// The pairs of a new list, whose lengths are those of the records, get that of their atoms.
void grow_packed_pairs(PairData &, const Growth &);

/// Collective. Lengths of pairs change from the growth that they have to this one, at fixed distances: deq, up to where they act,
/// R_i + R_j of contacts, and what the volume energy counts up to. Returns the energy that this MPI rank gains.
double grow_pairs(PairData &, const Growth &);

}    // namespace EVP
