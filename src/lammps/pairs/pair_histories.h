// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_store.h"
#include "core/energy/energy_balance.h"
#include "core/heat/heat.h"
#include "core/law/coefficients.h"
#include "core/pairs/contacts.h"
#include "lammps/base/atom_directory.h"
#include "lammps/base/lammps_names.h"
#include "lammps/bonds/event_file.h"
#include "lammps/pairs/pair_types.h"
#include "lammps/volume/volume_forces.h"

#include <memory>
#include <vector>

namespace EVP {

/// What the packed pairs have gone through since their records were told of it: where deq moves and bonds end, what the last
/// forces found comes into force here, and nowhere else. So do the limits of the spheres.
class PairHistories : protected Pointers {
 public:
  PairHistories(LAMMPS *lmp, PairLists &lists_in, const Coefficients &coefficients_in,
                const PairRules &rules_in, const PairTypes &types_in) :
      Pointers(lmp),
      lists(lists_in), coefficients(coefficients_in), rules(rules_in), types(types_in)
  {
  }

  /// At set-up: the records, and an exchange of three values per atom, both of fix evp/bonds.
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

  /// Collective, before forces. Where that is due heat is handed out, and the plastic strains and limits of the spheres move
  /// on. work: is told of what this dissipates, nullptr without.
  void begin_forces(PairWork *work, VolumeForces *volume);

  /// That of fix evp/heat, nullptr without.
  std::shared_ptr<Heat> heat() const { return heat_.lock(); }

  /// When a minimization is at rest, before commit(): finds anew what changes, as a minimizer may have tried other places
  /// last.
  void find_next();

  /// At the end of each step and when a minimization is at rest: what the last forces found comes into force. work,
  /// volume: are told of bonds that end, nullptr without.
  void commit(PairWork *work, VolumeForces *volume);

  /// Collective. Plastic strains and limits of the spheres, and which are torn open: at the steps that are due, and when a
  /// minimization is at rest, after commit(). opens: do atoms beyond cavitation open? Not when a minimization begins, as
  /// its potential must not change.
  void move_limits(PairWork *work, VolumeForces *volume, bool opens);

  /// That the records are in.
  BondStore &store() { return *records; }

  /// Would commit() change any, by what the last forces of this MPI rank found?
  bool would_change() const;

  /// Are there any that the records have not been told of?
  bool are_due() const { return due; }

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

  /// Collective: to the records of their atoms, where they are due, and so does heat. Called before atoms migrate, and before
  /// others read the records. volume: is told how bonds are at rest now, nullptr without.
  void return_to(const BondStore &, VolumeForces *volume);

  /// Collective, in the packing of a new neighbor list. Which bonds does it not have, as they are past its end? Returns how
  /// many records of own atoms these are, with those whose partner is deleted or has another pair style. Records of
  /// deleted partners go.
  int64_t find_far();
  void forget_far()
  {
    far.clear();
    far_partners.clear();
  }

  /// What these bonds hold at their cutoffs, and dissipate on the way there [energy]. Where bonds end these do so at the
  /// next commit().
  PairWork::BeyondList beyond_list() const;

  /// Bonds of eq. 8 among these break before their spheres are out of reach.
  void tell_of_far(VolumeForces &) const;

  double memory_usage() const
  {
    return bytes_of(ends.found, ends.squared_distances, begins.found, begins.squared_distances,
                    begins.released, journal, far, owners.x, owners.shifts, periods, sums.values,
                    strains, limits);
  }

 private:
  PairLists &lists;
  const Coefficients &coefficients;
  const PairRules &rules;
  const PairTypes &types;
  BondStore *records = nullptr;
  PerAtomComm *exchange = nullptr;
  std::weak_ptr<Heat> heat_;    // its fix may go between runs

  /// What has become of a pair of own atom i, which that atom and j are told. j: -1 of a bond whose partner is far, and as a
  /// message to the rank of i.
  struct PairEvent {
    enum What : int64_t {
      MOVED,         ///< deq of a bond, to this
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
  };

  /// A bond of an own atom that is in no list, as it is at its cutoff.
  struct FarBond {
    int i;
    tagint partner;
    double deq, radius, cutoff;    ///< radius: of the partner
    bool at_dlim;                  ///< that is its cutoff
    PairState state;
  };

  OwnerDistances owners;
  std::vector<double> periods;    // of its shifts
  EndingBonds ends;
  BeginningBonds begins;
  std::vector<PairEvent>
      journal;    // what the records have not been told; between two tellings bonds that have ended
  std::vector<FarBond> far;
  std::vector<Vector> far_partners;    // nearest images of their partners; with events only
  FlowSums sums;
  // of own atoms and ghosts: plastic strains, where bonds end by them; with plasticity how far their bonds hold, see Limit
  std::vector<double> strains, limits;
  bool due = false, limits_due = false, heat_due = false, keeps_events = false;
  bool starts = false;    // no forces of this run yet
  bigint jumps =
      0;    // pairs that joined far within the distance where they should, not told of yet
  bool jumps_told = false;
  int every = 1;    // steps between two updates of the limits

  /// Does another row hold the pair too, which stands for both? Without newton, across MPI ranks or a periodic boundary.
  bool is_copy(int i, int j) const { return j >= lists.nreact && atom->tag[i] > atom->tag[j]; }
  bool was_set() const;
  void bring_sums_home();
  void note_images();
  void find_owners();
  void end_at(int i, int j, const Stored &held, PairWork *);
  void share_limits(VolumeForces *, bool opens);
  void take_given_strains();
  double limit_of(int law, int i, double of_partner) const;
  void note_event(int i, int j, tagint partner, BondEvent::Why);
  std::vector<Vector> places_of(const std::vector<tagint> &ids) const;
  void add_event(int i, tagint partner, const Vector &place_of_partner, BondEvent::Why);
  void warn_of_jumps();
  void add_contact(int i, const PackedPair &bond, double d, const Span &);
  template <class F> void for_each_limit(F &&);
  void keep_below_limit(PairList &, int i, int n, double before, PairWork *, bool adds_strain);
  void end_bonds(PairWork *, VolumeForces *);
  void end_far_bonds(PairWork *);
  void begin_bonds(PairWork *);
  void apply(const PairEvent &);
  void return_due(VolumeForces *);
  void tell_owners();
  void add_moves();
};

}    // namespace EVP
