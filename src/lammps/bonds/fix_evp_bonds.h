// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_store.h"
#include "fix.h"
#include "lammps/base/per_atom.h"
#include "lammps/base/scene.h"
#include "lammps/bonds/event_file.h"
#include "lammps/pairs/pair_data.h"

#include <array>
#include <memory>
#include <string>

namespace EVP {
class BondRecording;
}

namespace LAMMPS_NS {

/// Records the bonds of a body at the first set-up, and owns the records: their life with the atoms,
/// in restart files, and what users read of them.
class FixEVPBonds : public EVP::WithPerAtomComm<Fix>, public EVP::HasBondStore {
 public:
  FixEVPBonds(class LAMMPS *, int, char **);
  ~FixEVPBonds() override;

  int setmask() override
  {
    using namespace FixConst;
    return PRE_EXCHANGE | MIN_PRE_EXCHANGE | PRE_NEIGHBOR | MIN_PRE_NEIGHBOR | PRE_FORCE |
        MIN_PRE_FORCE | END_OF_STEP;
  }
  int modify_param(int, char **) override;
  void init() override;
  void init_list(int, class NeighList *list_in) override { list = list_in; }
  void setup_pre_neighbor() override { pre_neighbor(); }
  void pre_neighbor() override;
  void min_pre_neighbor() override { pre_neighbor(); }
  void setup_pre_force(int) override;

  // flow and breaking, see EVP::PairHistories
  void pre_exchange() override { return_histories(); }
  void min_pre_exchange() override { return_histories(); }
  void pre_force(int) override;
  void end_of_step() override;
  void post_run() override;

  // f_ID: pairs recorded. f_ID[1..8]: past dlim, in the second regime or at their limit, new pairs that interact,
  // lowest d/(R_i + R_j), ended for good, begun; of those that ended: failed at a strain, past dlim
  double compute_scalar() override { return (double) bonds->count(); }
  double compute_vector(int) override;

  /// The records. The store is closed when the fix goes, and stays until its last reader drops it.
  std::shared_ptr<const EVP::BondStore> records() const override { return bonds; }

  double memory_usage() override { return bonds->memory_usage(); }
  void grow_arrays(int nmax) override { bonds->grow(nmax); }
  void copy_arrays(int i, int j, int /*delflag*/) override { bonds->copy(i, j); }
  void set_arrays(int i) override { bonds->clear(i); }
  int pack_exchange(int i, double *buf) override { return bonds->pack(i, buf); }
  int unpack_exchange(int, double *) override;

  void write_restart(FILE *) override;
  void restart(char *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  // with their number in front, and a seal
  int size_restart(int i) override { return 2 + (int) bonds->words_of(i); }
  int maxsize_restart() override { return 2 + maxexchange; }

  /// Collective. Stops if an atom of any MPI rank is not the one recorded under its ID.
  void check_ids() const;

  /// Collective. Brings the records up to the last commit() of the pairs.
  void return_histories();

  /// Collective, at set-up: starts and drops what spheres keep, by the pair style and the fixes that there are. For a fix that
  /// needs its values before this one is set up.
  void keep_values();

 private:
  double zone = 0.0;         // pairs with d <= zone (R_i + R_j) are recorded; 0: alpha of the types
  std::string file;          // take the records from this file; empty: from the zone
  bool after_restart;        // a restart file with fixes was read before this fix was defined
  bool takes_new = false;    // atoms that come later get bonds too
  std::unique_ptr<EVP::EventFile> events;    // nullptr without
  bigint restarted_at = -1;                  // step of the restart file that has the records

  std::shared_ptr<EVP::BondStore> bonds = std::make_shared<EVP::BondStore>();

  EVP::PairData *pair_data = nullptr;    // of the run; the pair style in force has it
  bool stepping = false;                 // in a step of a run, not in its set-up
  bigint ended_step = -1;                // the last step that has ended
  bool stop_warned = false;
  bigint natoms_seen = -1;    // -2 once new atoms were warned of
  class NeighList *list = nullptr;
  std::array<double, 4> pair_counts{};    // f_ID[1..5], as of the last evaluation
  bigint counted_step = -1;               // step of that, -1 if it must not be used again

  void record();
  void record_from_list(EVP::BondRecording &, const EVP::BondStore *);
  void record_new_atoms();
  void measure();
  void warn_of_stop(const char *);
  void warn_of_new_atoms();
  void check_history() const;
  EVP::BondCounts counts();
  void check_zone() const;
  void check_box(const EVP::PairData *) const;
  std::string misplaced_message(int64_t id_found) const;
  // LAMMPS' buffers for one atom must hold the longest record of any MPI rank: the first rank says in
  // restart files how long that is
  void set_exchange_room() { maxexchange = EVP::reduce_all(bonds->most_words(), MPI_MAX, world); }
};

}    // namespace LAMMPS_NS
