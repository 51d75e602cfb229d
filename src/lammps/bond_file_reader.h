// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "core/pair_rules.h"
#include "lammps_names.h"

#include <string>
#include <vector>

namespace EVP {

/// Collective. The bonds of a file in the format of core/bond_file.h, for each of this rank's own atoms,
/// in the order of the file; each bond is with both of its atoms. histories: what has changed of these
/// and of contacts, to be taken by the store after the bonds.
///
/// Throws BadInput, the same on all ranks, if the file cannot be read, is in other units, names an atom
/// that does not exist or is not in the group, a history that the rules would forget, or a bond between two bodies.
/// No two atoms may have the same ID.
/// within: which atoms are one body, if that is given; else what the file says of it is put there.
std::vector<BondStore::Bonds> read_bond_file(const LAMMPS *, const std::string &name, int groupbit,
                                             const PairRules &, Within &within,
                                             std::vector<HistoryOfPair> &histories);

}    // namespace EVP
