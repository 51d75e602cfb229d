// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "atom_directory.h"
#include "core/bond_store.h"
#include "core/coefficients.h"
#include "core/contacts.h"
#include "core/energy_balance.h"
#include "lammps_names.h"
#include "pair_types.h"
#include "volume_forces.h"

#include <vector>

namespace EVP {

/// What the packed pairs have gone through since their records were told of it: where pairs flow and bonds break, what
/// the last forces found comes into force here, and nowhere else.
class PairHistories : protected Pointers {
 public:
  PairHistories(LAMMPS *lmp, PairLists &lists_in, const Coefficients &coefficients_in,
                const PairRules &rules_in, const PairTypes &types_in) :
      Pointers(lmp),
      lists(lists_in), coefficients(coefficients_in), rules(rules_in), types(types_in)
  {
  }

  /// At set-up.
  void begin_run() { limit_warned = false; }

  /// Where the force loop puts the bonds past their cutoffs, nullptr where bonds do not break.
  std::vector<int> *past_cutoff()
  {
    past.clear();
    return rules.breaks() ? &past : nullptr;
  }

  /// At the end of each step and when a minimization is at rest: what the last forces found comes into force. at_rest:
  /// found anew, as a minimizer may have tried other places last. work, volume: are told of bonds that break, nullptr
  /// without.
  void commit(bool at_rest, PairWork *work, VolumeForces *volume);

  /// Would commit() change any, by what the last forces of this MPI rank found?
  bool would_change() const;

  /// Are there any that the records have not been told of?
  bool are_due() const { return due; }

  /// They are of records that have gone.
  void drop()
  {
    due = false;
    newly_broken.clear();
  }

  /// The lists were packed anew: what the last forces found is void.
  void forget_forces() { past.clear(); }

  /// Collective, where they are due: to the records of their atoms. Called before atoms migrate, and before others read
  /// the records.
  void return_to(BondStore &, PerAtomComm &);

  /// Collective, in the packing of a new neighbor list. Which bonds does it not have, as they are past its end? Returns how
  /// many records of own atoms these are, with those whose partner is deleted or has another pair style.
  int64_t find_missing(const BondStore &);

  /// What these bonds hold at their cutoffs, and dissipate on the way there [energy].
  struct Missing {
    double held = 0.0, dissipated = 0.0;
  };

  /// They have flowed up to their cutoffs, or have broken where bonds break, whether or not the list saw them pass.
  /// moved: the same records, nullptr: they stay as they are. volume: is told of bonds that will break, nullptr without.
  Missing settle_missing(const BondStore &, BondStore *moved, VolumeForces *volume = nullptr) const;

  double memory_usage() const { return bytes_of(past, newly_broken); }

 private:
  PairLists &lists;
  const Coefficients &coefficients;
  const PairRules &rules;
  const PairTypes &types;

  /// A bond that broke, with the work of its flow [energy].
  struct BrokenBond {
    int i, j;
    double work;
  };

  /// A record of an own atom that is in no list, and its partner.
  struct MissingBond {
    int i, slot;
    int type;
    double radius;
  };

  std::vector<MissingBond> missing;
  std::vector<int> past;    // bonds that the last forces found past their cutoff, where bonds break
  std::vector<BrokenBond> newly_broken;    // of this MPI rank, since histories were returned
  bool due = false;
  bool limit_warned = false;

  void find_next(PairList &);
  void break_bonds(const std::vector<int> &, PairWork *, VolumeForces *);
  void send_to_owners(BondStore &, PerAtomComm &);
  void warn_of_limit();
};

}    // namespace EVP
