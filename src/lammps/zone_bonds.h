// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_ZONE_BONDS_H
#define LMP_EVP_ZONE_BONDS_H

#include "core/bond_store.h"

#include "pointers.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

/// The pairs within the zone of recording, from a full neighbor list.
class ZoneBonds : protected Pointers {
 public:
  /// owner_x: positions of the owners of all atoms and ghosts, three values each [length].
  /// zone: reach over R_i + R_j, 0 for alpha of the pair of types.
  ZoneBonds(LAMMPS *, const std::vector<double> &owner_x, double zone, int groupbit,
            const class PairNetwork *);

  /// For each local atom its partners, both in the group. A complaint where two atoms coincide.
  std::vector<EVP::BondStore::Bonds> find(const class NeighList *, std::string &complaint) const;

 private:
  const std::vector<double> &owner_x;
  double zone;
  int groupbit;
  const class PairNetwork *network;

  double symmetric_dsq(int i, int j) const;
};

}    // namespace LAMMPS_NS

#endif
