/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef FIX_CLASS
// clang-format off
FixStyle(evp/bonds,FixEVPBonds);
// clang-format on
#else

#ifndef LMP_FIX_EVP_BONDS_H
#define LMP_FIX_EVP_BONDS_H

#include "core/bond_file.h"
#include "core/prefetch.h"
#include "fix.h"
#include "nodal_exchange.h"

#include <algorithm>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Keeps, for every local atom, the tags of the partners it was recorded with and deq of each pair.
///
/// A pair is kept on both of its atoms, equal to the last bit, so that whichever MPI rank meets it
/// finds deq without communication. A deq never changes after it was recorded (paper 2.2).
class FixEVPBonds : public NodalExchange<Fix> {
 public:
  struct Bond {
    tagint partner;
    double deq;    ///< distance at recording [length]
  };

  /// The records of one atom, those first that the last neighbor list held, see EVP::Partners.
  using Bonds = std::vector<Bond>;

  FixEVPBonds(class LAMMPS *, int, char **);
  ~FixEVPBonds() override;

  int setmask() override;
  void init() override;
  void init_list(int, class NeighList *) override;
  void setup_pre_force(int) override;

  double compute_scalar() override;
  double compute_vector(int) override;

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

  bool has_recorded() const { return recorded; }
  const Bonds &bonds_of(int i) const { return bonds[i]; }

  /// The same in the order of the partners' IDs.
  Bonds sorted_bonds_of(int i) const;

  /// For EVP::Partners, which changes their order.
  Bonds &ordered_bonds_of(int i) { return bonds[i]; }

  /// Asks the memory for the records of an atom that is next but a few, for 32 of them at most.
  void prefetch_bonds_of(int i) const
  {
    EVP::prefetch(bonds[i].data(), std::min<size_t>(bonds[i].size(), 32) * sizeof(Bond));
  }

  /// Local atoms that are not those recorded under their IDs: an atom with another ID than it had,
  /// and a new one that took the ID of one that was deleted. 0 if there is none.
  struct Misplaced {
    tagint renumbered, newcomer;
    explicit operator bool() const { return renumbered || newcomer; }
  };
  Misplaced find_misplaced() const;

  /// Collective. Stops if any MPI rank has a misplaced atom.
  void check_ids() const;

  /// The message of that stop.
  std::string misplaced_message(Misplaced) const;

  /// What to type to make the periodic box larger: LAMMPS replicates no records.
  std::string how_to_replicate() const;

  /// deq of local atom i with the atom of that tag [length], or 0 if they were not recorded.
  double find_deq(int i, tagint partner) const;

 private:
  double zone;    // pairs with d <= zone (R_i + R_j) are recorded; 0: zone = alpha of the pair type
  std::string file;    // take the records from this file; empty: from the zone
  bool recorded;
  bool records_due;      // the fix's section of a restart file was read, no atom's record yet
  bool after_restart;    // a restart file with fixes was read before this fix was defined
  bool restored_late;    // atoms were deleted or renumbered before their records were read
  tagint highest_id;     // of all atoms at the recording: newer atoms have higher ones
  bigint nrecorded;      // pairs, over all MPI ranks
  int most_bonds;        // records of the atom that has most of them

  // per atom, owned ones only
  std::vector<tagint> recorded_as;    // its ID when it was recorded, 0 if it never was
  std::vector<Bonds> bonds;

  class NeighList *list;
  double pair_counts[4];    // f_ID[1..4], as of the last evaluation
  bigint counted_step;      // step of that, -1 if it must not be used again

  class PairEVPLJ *find_pair() const;
  void record();
  std::vector<Bonds> bonds_in_zone(const class PairEVPLJ *);
  double symmetric_dsq(int, int, const Nodal &) const;
  std::vector<Bonds> bonds_in_file(const class PairEVPLJ *, const class AtomDirectory &) const;
  void stop_together(std::string complaint) const;
  void check_restored();
  void check_zone(const class PairEVPLJ *) const;
  std::string twice_given(const std::vector<Bonds> &) const;
  void make_room_for(int);
  void give_back_room(int, size_t);
  int pack_bonds(int, double *) const;
  int unpack_bonds(int, const double *);
};

}    // namespace LAMMPS_NS

#endif
#endif
