// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "core/coefficients.h"
#include "core/contacts.h"
#include "core/fault.h"
#include "cutoffs.h"
#include "list_snapshot.h"
#include "pair_histories.h"
#include "pair_list_builder.h"
#include "per_atom.h"
#include "row_laws.h"

#include "atom.h"
#include "update.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace EVP {

/// Where the pair style gets the records of its bonds: from the fix evp/bonds that recorded them and no other, since to
/// continue without them would change the material.
class BondSource : protected Pointers {
 public:
  using Pointers::Pointers;

  /// At set-up: those of the fix there is. Stops where another one recorded, or where the rules need one.
  void begin_run(const PairRules &);

  /// Takes note of records that are new, or gone with their fix.
  void update();

  /// Records came with a restart file: should their fix go before the next run, update() learns it.
  void set_store(const std::shared_ptr<const BondStore> &restored) { store = restored; }

  /// The records, nullptr before the recording and without fix evp/bonds.
  const BondStore *records() const
  {
    return store && store->has_recorded() ? store.get() : nullptr;
  }

  /// Is there a fix evp/bonds?
  bool has_fix() const { return store != nullptr; }

  BodyRule within() const { return store ? store->within() : BodyRule::ALL; }

  /// See BondStore::version(), 0 without.
  long version() const { return store ? store->version() : 0; }

  /// ID of the fix that recorded, as of the last update(); empty without.
  std::string recorder;

  /// The last fix whose records of this body are gone, empty if there was none.
  std::string dropped;

 private:
  std::shared_ptr<const BondStore> store;
};

/// The pairs of pair style evp/lj on this MPI rank, their laws and their bonds: packed from each new
/// neighbor list for the time-step loop, read by the fixes and computes of this package.
class PairData : protected Pointers {
 public:
  /// Pairs of the current neighbor list at the current positions, over all MPI ranks.
  struct Counts {
    double bonds_within;    ///< recorded pairs with d <= dlim
    double bonds_second;    ///< of these in the second regime
    double new_pairs;       ///< pairs not recorded that interact
    double lowest_ratio;    ///< smallest d/(R_i + R_j) of the packed pairs; 0 if there are none
  };

  PairData(LAMMPS *, Coefficients &);

  /// Of the pair style evp/lj in force, alone or in pair_style hybrid; nullptr if it is another. A
  /// pair_style command deletes it, so what may be asked between runs must look again.
  static PairData *find(Force *);

  /// The same; stops, naming `who`, if the pair style is another.
  static PairData *require(Force *, Error *, const std::string &who);

  /// Collective. The same if the packed pairs are those of the present positions; else stops, naming `who`.
  static PairData *require_present(Force *, Error *, const std::string &who);

  // what fixes and computes read

  /// The packed pairs. Stops unless is_packed(), so take them out of loops.
  const PairLists &packed_pairs() const;

  const PairLaw &law_of(const PackedPair &pair) const { return coefficients.law(pair.law); }
  double xi_s_of(const PackedPair &pair) const
  {
    return coefficients.xi_s(pair.law);
  }    ///< of the row

  /// All that the law says of a packed pair, past its cutoff of it there.
  PairState state_of(const PlacedPair &pair) const
  {
    return law_of(pair).state(pair.ratio(), pair);
  }

  /// The packed pair of two atoms, found by their IDs, and its work of flow [energy]. One that is not packed does not act.
  struct AnyPair {
    PackedPair pair;
    double work;
    bool recorded;
  };
  AnyPair pair_between(int i, int j, int itype, int jtype) const;

  /// gamma of a pair that fix nve/evp damps [force/velocity], 0 for the others. Its law has none.
  double implicit_gamma(const PackedPair &pair) const
  {
    return coefficients.gamma_elsewhere(pair.law);
  }

  /// True where fix nve/evp takes over the damping of some pairs, those with an atom of its group.
  bool damps_implicitly() const { return any_gamma && implicit_groupbit && !fault(NO_IMPLICIT); }

  /// False where no pair at all has damping of this style's own. The same on all MPI ranks.
  bool damps_explicitly() const { return explicit_damping; }

  /// Damping takes part in dynamics only: a minimizer has no velocities to damp.
  bool damping_acts() const { return any_gamma && update->whichflag != 2; }

  /// The records, nullptr before the recording and without fix evp/bonds.
  const BondStore *bonds() const { return source.records(); }

  /// Which atoms are one body, by fix evp/bonds.
  BodyRule within() const { return source.within(); }

  /// Does any row name the bodies that it holds for, so that the bonds must be measured?
  bool wants_measures() const { return coefficients.any_scaled(); }

  VolumeForces *volume() const
  {
    return volume_ && !volume_->is_closed() ? volume_.get() : nullptr;
  }

  /// dlim/(R_i + R_j) of a pair of atom types, 0 where this style does not act. Known after init().
  double alpha_of(int itype, int jtype) const
  {
    return cuts.handles(itype, jtype) ? coefficients.row(itype, jtype).alpha : 0.0;
  }

  /// Largest cutoff of the pairs of types that this style handles [length].
  double longest_cutoff() const { return cuts.longest(); }

  /// Were the pairs packed from the neighbor list as it is now, and from the atoms here?
  bool is_packed() const;

  /// Collective. Are the packed pairs all pairs of the present positions? Ghosts are brought to these, but in a run whose
  /// fixes leave the atoms where they were at the last forces. Between runs atoms must not have moved further than the
  /// neighbor list allows.
  bool is_present();

  /// Collective. Requires is_present().
  Counts count_pairs() const;

  // what the pair style sets and calls

  PairRules rules;
  Cutoffs cuts;
  BondSource source;

  void commit(bool at_rest);
  bool would_change() const { return pair_histories.would_change(); }

  /// For each packing that lacks bonds. moves: they flow or break, once; else only the balance is told what they hold, as at
  /// set-up.
  void settle_missing(BondStore &records, bool moves)
  {
    if (!missing_due) return;
    const auto found =
        pair_histories.settle_missing(records, moves && records.has_history() ? &records : nullptr);
    if (work) {
      work->forget_missing();
      work->take_missing(found.held, found.dissipated, rules.breaks() && moves);
    }
    missing_due = !moves;
  }

  /// In a minimization with flow, of the bonds that have left the list [energy]: as much as in it, so that the potential
  /// energy does not depend on where the list ends. Over the bonds of this rank, those of two by half.
  double energy_of_missing() const { return missing_energy; }

  /// Collective, where commit() was called since: the histories of the pairs go to the records of their
  /// atoms. Called before atoms migrate, and before others read the records.
  void return_histories(BondStore &records, PerAtomComm &exchange)
  {
    pair_histories.return_to(records, exchange);
  }

  /// In a minimization the energy of a pair is the work since its last state of rest.
  bool is_incremental() const { return update->whichflag == 2; }

  /// For the force loop, which fills what may change in them.
  PairLists &lists_to_evaluate() { return lists; }
  std::vector<int> *bonds_past_cutoff() { return pair_histories.past_cutoff(); }

  /// What the force loop has to find for fix evp/energy in this run, nullptr without that fix.
  PairWork *wanted_work() const { return work.get(); }

  /// At init_style(): radii, bonds and the other fixes of the run to come.
  void begin_run();

  /// At init_one(): this style acts between two types. Returns the cutoff for the neighbor list.
  double handle(int itype, int jtype);

  /// Types or coefficients have changed since the last packing.
  void repack() { repack_due = true; }

  /// Collective, before the forces: packs the pairs if the neighbor list, the bonds or radii have changed. Returns whether
  /// this is the first packing of a run.
  bool pack_if_due(const NeighList *);

  double memory_usage() const
  {
    return lists.memory_usage() + builder.memory_usage() + snapshot.memory_usage() +
        pair_histories.memory_usage();
  }

 private:
  Coefficients &coefficients;
  RowLaws laws;
  PairLists lists;
  PairListBuilder builder;
  ListSnapshot snapshot;
  PairHistories pair_histories;

  bool any_gamma = false, explicit_damping = false;
  bool scene_checked = false, repack_due = true;
  bigint overlaps_told = 0;     // pairs, of the last warning; again when there are twice as many
  int implicit_groupbit = 0;    // of fix nve/evp
  std::string last_report;

  std::shared_ptr<VolumeForces> volume_;    // of fix evp/volume, nullptr without
  std::shared_ptr<PairWork> work;           // of fix evp/energy, nullptr without
  long source_version = 0;                  // of the bonds, at the last packing
  bool bonds_missing = false;               // neither broken nor in the list; the same on all ranks
  bool missing_due = false;                 // these are to be settled
  double missing_energy = 0.0;
  mutable std::vector<std::vector<std::pair<const PairList *, PackedRow>>> rows_of_atoms;
  mutable long rows_build = -1;    // of these, for pair_between()

  void report();
  bool pack(const NeighList *);
  void end_broken_run();
  void agree_on_pairs(const PairListBuilder::Found &, bool same_list);
};

}    // namespace EVP
