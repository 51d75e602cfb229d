// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "core/coefficients.h"
#include "core/force_loop.h"
#include "core/pair_rules.h"
#include "core/work_tally.h"
#include "volume_forces.h"

#include <vector>

namespace EVP {

/// What the packed pairs have gone through since their records were told of it: where pairs flow and bonds break, what
/// the last forces found comes into force here, and nowhere else.
class PairHistories : protected Pointers {
 public:
  PairHistories(LAMMPS *lmp, PairList &list_in, const Coefficients &coefficients_in,
                const PairRules &rules_in) :
      Pointers(lmp),
      list(list_in), coefficients(coefficients_in), rules(rules_in)
  {
  }

  /// Collective, at set-up. Stops where those of the last run were lost.
  void begin_run();

  /// Where the force loop puts what it finds. incremental: see Block.
  HistoryView view(bool incremental)
  {
    beyond.clear();
    return {list.pairs.flow(), rules.breaks() ? &beyond : nullptr, incremental};
  }

  /// At the end of each step and when a minimization is at rest: what the last forces found comes into force. at_rest:
  /// found anew, as a minimizer may have tried other places last. Both others are told of bonds that break, nullptr
  /// without.
  void commit(bool at_rest, VolumeForces *, PairWork *);

  /// Are there any that the records have not been told of?
  bool are_due() const { return due; }

  /// The list was packed anew: what the last forces found is void.
  void forget_forces() { beyond.clear(); }

  /// It was packed from the same neighbor list as `before`, and the records have not been told: takes them from there.
  void carry(const PairList &before, VolumeForces *);

  /// Collective, where they are due: to the records of their atoms.
  void return_to(BondStore &, bool list_matches, PerAtomComm &);

  /// Of the pair (i, j) of the list, which must be that of the present atoms; false where it is not there.
  bool find(int i, int j, PairHistory &found) const;

  double memory_usage() const { return bytes_of(beyond, newly_broken, row_index); }

 private:
  PairList &list;
  const Coefficients &coefficients;
  const PairRules &rules;

  /// A bond of the packed list that broke, with the work of its flow [energy].
  struct BrokenBond {
    int i, j;
    double work;
  };

  std::vector<int>
      beyond;    // bonds that the last forces found beyond their cut, where bonds break
  std::vector<BrokenBond> newly_broken;    // of this MPI rank, since histories were returned
  bool due = false;
  bool flow_warned = false;
  mutable std::vector<int> row_index;    // of the rows of the atoms
  mutable long row_index_build = -1;

  void find_next();
  void break_bonds(VolumeForces *, PairWork *);
  double rest_of_broken(int i, const PackedPair &bond) const;
  void turn_into_contact(int i, int k, VolumeForces *);
  void send_to_owners(BondStore &, PerAtomComm &);
  void warn_of_low_offsets();
};

}    // namespace EVP
