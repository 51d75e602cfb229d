// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_HISTORY_RETURN_H
#define LMP_EVP_HISTORY_RETURN_H

#include "core/bond_store.h"
#include "core/pair_list.h"
#include "nodal_exchange.h"

namespace LAMMPS_NS {

/// Collective. Writes the histories of all packed pairs back to the records of both of their atoms,
/// wherever these are owned, and the contacts that have flowed. Atoms and ghosts must be those that the
/// list was packed for. Without newton both owners of a pair across MPI ranks, or across a periodic
/// boundary, hold a copy: that of the atom with the lower ID is taken for both.
void return_histories(class LAMMPS *, const EVP::PairList &,
                      const std::vector<EVP::BrokenBond> &broken, EVP::BondStore &,
                      EVP::GhostExchange &);

}    // namespace LAMMPS_NS

#endif
