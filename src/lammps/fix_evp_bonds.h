// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_FIX_EVP_BONDS_H
#define LMP_FIX_EVP_BONDS_H

#include "core/bond_store.h"
#include "fix.h"
#include "nodal_exchange.h"

#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Records the bonds of a body at the first set-up, and owns the records: their life with the atoms,
/// in restart files, and what users read of them.
class FixEVPBonds : public NodalExchange<Fix> {
 public:
  FixEVPBonds(class LAMMPS *, int, char **);
  ~FixEVPBonds() override;

  int setmask() override;
  void init() override;
  void init_list(int, class NeighList *) override;
  void setup_pre_neighbor() override;
  void pre_neighbor() override;
  void min_pre_neighbor() override;
  void setup_pre_force(int) override;

  double compute_scalar() override;
  double compute_vector(int) override;

  /// "bonds": the std::shared_ptr<const EVP::BondStore> of the records. They are closed, and theirs is
  /// the only reference left, when the fix goes.
  void *extract(const char *, int &) override;

  double memory_usage() override;
  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;

  void write_restart(FILE *) override;
  void restart(char *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  int size_restart(int) override;
  int maxsize_restart() override;

  const EVP::BondStore &records() const { return *bonds; }

  /// Collective. Stops if an atom of any MPI rank is not the one recorded under its ID.
  void check_ids() const;

 private:
  double zone;    // pairs with d <= zone (R_i + R_j) are recorded; 0: zone = alpha of the pair type
  std::string file;      // take the records from this file; empty: from the zone
  bool records_due;      // the fix's section of a restart file was read, no atom's record yet
  bool after_restart;    // a restart file with fixes was read before this fix was defined
  bool restored_late;    // atoms were deleted or renumbered before their records were read

  std::shared_ptr<EVP::BondStore> bonds;
  std::shared_ptr<const EVP::BondStore> shown;    // the same, for readers

  class NeighList *list;
  double pair_counts[4];    // f_ID[1..4], as of the last evaluation
  bigint counted_step;      // step of that, -1 if it must not be used again

  void record();
  std::vector<EVP::BondStore::Bonds> bonds_in_zone(const class PairNetwork *);
  std::vector<EVP::BondStore::Bonds> bonds_in_file(const class PairNetwork *) const;
  void check_restored();
  void check_zone(const class PairNetwork *) const;
  void check_box(const class PairNetwork *) const;
  std::string twice_given(const std::vector<EVP::BondStore::Bonds> &) const;
  std::string misplaced_message(EVP::BondStore::Misplaced) const;
  std::string how_to_replicate() const;
  void set_exchange_room();
};

}    // namespace LAMMPS_NS

#endif
