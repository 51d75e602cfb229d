// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_store.h"
#include "core/volume/volume_record.h"
#include "lammps/base/lammps_names.h"
#include "lammps/pairs/pair_data.h"

#include <algorithm>
#include <string>
#include <vector>

namespace EVP {

/// The references of fix evp/volume: the density of the bonds of each atom at their deq, as of when they were first seen. They are set
/// when pairs are packed, of all atoms where there are none or other pairs count, else of those that are new.
class VolumeReferences : protected Pointers {
 public:
  VolumeReferences(LAMMPS *lmp, const std::string &who_in) : Pointers(lmp), who(who_in) {}

  struct Changes {
    bool all_set = false;             ///< but those that a bond file has
    bool exclusion_undone = false;    ///< of neigh_modify: pairs come that are no bonds
    std::vector<char> newly_set;      ///< by own atom; empty unless all_set
  };
  /// Collective. What of the references has changed by now.
  Changes pairs_packed(PairData &, const SphereRecords<VolumeRecord> &);

  /// Cutoff over R_i + R_j of pairs that count: alpha, but no more than the zone of the recording.
  double relative_cutoff(double alpha) const
  {
    return store().zone > 0.0 ? std::min(store().zone, alpha) : alpha;
  }

 private:
  const std::string who;
  PairData *pairs = nullptr;
  SphereRecords<VolumeRecord> records;
  bigint partners = -1;    // sum over the atoms with bonds, which tells whether they are the same

  BondStore &store() const { return pairs->store(); }
  std::vector<double> relative_cutoffs() const;
  std::vector<VolumeScene::Exclusion> exclusions() const;
  bigint sum_of_partners() const;
  bool is_new(int i) const;
  std::vector<double> batches_to_be(bool all_set) const;
  std::vector<NeighborDensity> at_rest(const std::vector<double> &to_be) const;
  std::vector<char> set_references(const std::vector<NeighborDensity> &rest, bool all_set,
                                   const std::vector<double> &to_be);
  void set_gaps(const std::vector<char> &is_known);
  static void lose_partners(VolumeRecord &, const NeighborDensity &left);
};

}    // namespace EVP
