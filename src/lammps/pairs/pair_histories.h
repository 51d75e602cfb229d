// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_store.h"
#include "core/law/coefficients.h"
#include "core/pairs/contacts.h"
#include "lammps/base/atom_directory.h"
#include "lammps/base/lammps_names.h"
#include "lammps/bonds/event_file.h"
#include "lammps/pairs/effect.h"
#include "lammps/pairs/pair_types.h"
#include "lammps/pairs/step_work.h"

#include "atom.h"

#include <memory>
#include <vector>

namespace EVP {

/// What the packed pairs have gone through since their records were told of it: where deq moves and bonds end, what the last
/// forces found takes effect here, and nowhere else. So do the limits of the spheres.
class PairHistories : protected Pointers {
 public:
  PairHistories(LAMMPS *lmp, PairLists &lists_in, const Coefficients &coefficients_in,
                const PairRules &rules_in, const PairTypes &types_in, const Effects &effects_in) :
      Pointers(lmp),
      lists(lists_in), coefficients(coefficients_in), rules(rules_in), types(types_in),
      effects(effects_in), step_work(lmp)
  {
  }

  /// At set-up: the records, and an exchange of values of atoms, both of fix evp/bonds.
  void begin_run(BondStore *, PerAtomComm *, bool keeps_events);

  /// Ends and begins of bonds since someone took them, where they are kept.
  std::vector<BondEvent> events;

  /// Which bonds end, by the forces to come: the force loop fills it. nullptr where none can.
  EndingBonds *ending_to_find()
  {
    ends.clear();
    return rules.has_history() ? &ends : nullptr;
  }
  const EndingBonds &ending() const { return ends; }

  /// Likewise which bonds begin.
  BeginningBonds *beginning_to_find()
  {
    begins.clear();
    return rules.joins() ? &begins : nullptr;
  }

  /// At the beginning of a step of a run, before its forces.
  void begin_step();

  /// Collective, before forces. Updates the effects where that is due.
  void begin_forces();

  /// When a minimization is at rest, before commit(): finds anew what changes, as a minimizer may have tried other places
  /// last.
  void find_next();

  /// At the end of each step and when a minimization is at rest: what the last forces found takes effect.
  void commit();

  /// Collective. What the effects update: before forces where it is due, and when a minimization is at rest, after commit().
  void update_effects(Sharing);

  /// That the records are in.
  BondStore &store() { return *records; }

  PerAtomComm &exchange_of_atoms() { return *exchange; }

  /// Would commit() change any, by what the last forces of this MPI rank found?
  bool would_change() const;

  /// Are there any that the records have not been told of?
  bool are_due() const { return due; }

  /// Collective. An effect has changed columns of bonds that return to the records.
  void note_change() { due = true; }

  /// They are of records that have gone.
  void drop()
  {
    due = false;
    journal.clear();
  }

  /// The packing has found which pairs are inside: the records are told that, too.
  void note_look()
  {
    records->joins_by = rules.join;
    due = true;
  }

  /// Collective. The lists were packed anew: what the last forces found is void.
  void note_packing();

  /// Collective: to the records of their atoms, where they are due. Called before atoms migrate, and before others read the
  /// records.
  void return_to(const BondStore &);

  /// Collective, in the packing of a new neighbor list. Which bonds does it not have, as they are past its end? Returns how
  /// many records of own atoms these are, with those whose partner is deleted or has another pair style. Records of
  /// deleted partners go.
  int64_t find_unlisted();
  void clear_unlisted()
  {
    unlisted.clear();
    unlisted_partners.clear();
  }

  /// Where bonds end these do so at the next commit().
  const std::vector<UnlistedBond> &unlisted_bonds() const { return unlisted; }

  double memory_usage() const
  {
    return bytes_of(ends.found, ends.squared_distances, begins.found, begins.squared_distances,
                    begins.released, journal, unlisted, owners.x, owners.shifts, periods);
  }

 private:
  PairLists &lists;
  const Coefficients &coefficients;
  const PairRules &rules;
  const PairTypes &types;
  const Effects &effects;
  BondStore *records = nullptr;
  PerAtomComm *exchange = nullptr;

  /// What has become of a pair of own atom i, which that atom and j are told. j: -1 of a bond whose partner is unlisted, and as a
  /// message to the rank of i.
  struct PairEvent {
    enum What : int64_t {
      CHANGED,       ///< a value of a bond, to this
      ENDED,         ///< a bond, past dlim; deq: of what is left of it
      FAILED,        ///< the same at a strain
      REMEMBERED,    ///< a contact that has flowed, to this deq
      INSIDE,        ///< a contact that may not join before it has been apart
      JOINED,        ///< a bond that began, and may have been told before
      BEGAN          ///< a bond
    };
    int i, j;
    tagint partner;
    double deq;
    int64_t what;
    int64_t line = 0;    ///< of BOND_VALUES
  };

  OwnerDistances owners;
  AtomValues periods{3};    // of its shifts
  EndingBonds ends;
  BeginningBonds begins;
  const JoiningCriterion *joining = nullptr;
  StepWork step_work;
  std::vector<PairEvent>
      journal;    // what the records have not been told; between two tellings bonds that have ended
  std::vector<UnlistedBond> unlisted;
  std::vector<Vector> unlisted_partners;    // nearest images of their partners; with events only
  bool due = false, update_due = false, keeps_events = false;
  bool starts = false;    // no forces of this run yet
  bigint jumps =
      0;    // pairs that joined far within the distance where they should, not told of yet
  bool jumps_told = false;
  int every = 1;    // steps between two updates of the limits

  /// Does another row hold the pair too, which stands for both? Without newton, across MPI ranks or a periodic boundary.
  bool is_copy(int i, int j) const { return j >= lists.nreact && atom->tag[i] > atom->tag[j]; }
  double sum_radii(int i, int j) const
  {
    return lists.growth_of(i, j) * (atom->radius[i] + atom->radius[j]);
  }
  bool was_changed() const;
  void note_images();
  void find_owners();
  void share(Sharing);
  void find_criteria();
  void note_event(int i, int j, tagint partner, BondEvent::Why);
  std::vector<Vector> places_of(const std::vector<tagint> &ids) const;
  void add_event(int i, tagint partner, const Vector &place_of_partner, BondEvent::Why);
  void warn_of_jumps();
  void add_contact(int i, const PackedPair &bond, double d, const Span &);
  void end_bonds();
  void end_unlisted_bonds();
  void begin_bonds();
  bool is_barred(int k) const;
  void leave_out_barred();
  double begin_bond(int k, int i, double d);
  void join_bodies();
  void apply(const PairEvent &);
  void return_due();
  void send_to_owners();
  void add_moves();
  void add_changes();
};

}    // namespace EVP
