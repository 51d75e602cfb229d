// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/bonds/bond_store.h"
#include "core/law/coefficients.h"
#include "core/pairs/contacts.h"
#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/pairs/effect.h"
#include "lammps/pairs/pair_histories.h"
#include "lammps/pairs/pair_list_builder.h"
#include "lammps/pairs/pair_types.h"

#include "atom.h"
#include "comm.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace EVP {

/// Notes of the neighbor list that pairs were packed from, and of its atoms. Between runs anything may
/// have happened: commands and programs that use LAMMPS as a library change own atoms and leave ghosts
/// and neighbor list as they were.
class ListSnapshot : protected Pointers {
 public:
  explicit ListSnapshot(LAMMPS *lmp) : Pointers(lmp) {}

  /// No list matches, until finish(): an error may be caught and something asked then.
  void forget() { call = -1; }

  /// When packing begins. keep_radii: radii may vary at every step.
  void note_atoms(bool keep_radii)
  {
    forget();
    nlocal = atom->nlocal;
    nall = atom->nlocal + atom->nghost;
    atoms = fingerprint();
    if (keep_radii) radii.assign(atom->radius, atom->radius + nall);
    if (neighbor->ago != 0) return;

    list_comm = comm;
    skin = neighbor->skin;
    list_x.resize(nall);
    if (nall > 0) list_x.set_first(nall, atom->x[0]);
  }

  /// When it is done.
  void finish()
  {
    call = neighbor->ncalls;
    step = neighbor->lastcall;
  }

  /// The neighbor list, and the numbers of own atoms and ghosts.
  bool matches_list() const
  {
    return call == neighbor->ncalls && step == neighbor->lastcall && nlocal == atom->nlocal &&
        nall == atom->nlocal + atom->nghost;
  }

  /// Own atoms, their types, radii and molecules: some may have gone and as many come, under the
  /// same IDs even.
  bool matches_atoms() const { return atoms == fingerprint(); }

  /// Of own atoms and ghosts, where they were kept.
  bool radii_changed() const { return !std::equal(radii.begin(), radii.end(), atom->radius); }

  /// False where a command has replaced the communication or changed the skin.
  bool matches_commands() const { return list_comm == comm && skin == neighbor->skin; }

  /// Collective. The list holds all pairs as long as no atom moved by more than half the skin.
  bool moved_too_far() const
  {
    bool far = false;
    for (int i = 0; i < nall; i++) {
      const double *x = atom->x[i], *then = list_x[i];
      const double dx = x[0] - then[0], dy = x[1] - then[1], dz = x[2] - then[2];
      if (dx * dx + dy * dy + dz * dz > 0.25 * skin * skin) far = true;
    }
    return on_any(far, world);
  }

  double memory_usage() const { return bytes_of(list_x, radii); }

 private:
  bigint call = -1, step = -1;    // of the neighbor list
  int nlocal = -1, nall = -1;
  uint64_t atoms = 0;    // see fingerprint()
  const Comm *list_comm = nullptr;
  double skin = 0.0;
  AtomValues list_x{3};    // at the neighbor build
  std::vector<double> radii;

  // another number where atoms of this MPI rank were exchanged for others, or changed
  uint64_t fingerprint() const
  {
    constexpr uint64_t prime = 1099511628211ULL;
    uint64_t ids = 0, rest = 0;
    for (int i = 0; i < atom->nlocal; i++) {
      ids = prime * (ids ^ (uint64_t) atom->tag[i]);
      rest = prime * (rest ^ (uint64_t) atom->type[i] ^ bits_as<uint64_t>(atom->radius[i]));
    }
    for (int i = 0; atom->molecule && i < atom->nlocal; i++)
      rest = prime * (rest ^ (uint64_t) atom->molecule[i]);
    return ids ^ (rest * 0x9E3779B97F4A7C15ULL);
  }
};

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

  BodyRule within() const { return store ? store->within : BodyRule::ALL; }

  /// See BondStore::version(), 0 without.
  long version() const { return store ? store->version() : 0; }

  /// ID of the fix that recorded, as of the last update(); empty without.
  std::string recorder;

  /// The last fix whose records of this body are gone, empty if there was none.
  std::string dropped;

 private:
  std::shared_ptr<const BondStore> store;
};

/// The pair style, for the fixes and computes of this package.
class HasPairData {
 public:
  virtual class PairData *get_pair_data() = 0;

 protected:
  ~HasPairData() = default;
};

/// The pairs of pair style evp/lj on this MPI rank, their laws and their bonds: packed from each new
/// neighbor list for the time-step loop, read by the fixes and computes of this package.
class PairData : protected Pointers {
 public:
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

  const PairLaw &law_of(const PackedPair &pair) const { return coefficients_.law(pair.law); }
  double xi_s_of(const PackedPair &pair) const { return coefficients_.xi_s(pair.law); }

  /// All that the law says of a packed pair, past its cutoff of it there.
  PairState state_of(const PlacedPair &pair) const
  {
    return law_of(pair).state(pair.ratio(), pair);
  }

  /// The packed pair of two atoms, found by their IDs. One that is not packed does not act.
  PackedPair pair_between(int i, int j, int itype, int jtype) const;

  /// gamma of a pair that fix nve/evp damps [force/velocity], 0 for the others. Its law has none.
  double implicit_gamma(const PackedPair &pair) const
  {
    return coefficients_.gamma_elsewhere(pair.law);
  }

  /// Of the spheres of a type, as given.
  Row row_of(int type) const { return coefficients_.row(type, type); }
  Row row_of(int i, int j) const { return coefficients_.row(i, j); }

  /// Does an effect take over the damping of some pairs?
  bool damps_implicitly() const { return any_gamma && implicit_groupbits_; }

  /// False where no pair at all has damping of this style's own. The same on all MPI ranks.
  bool damps_explicitly() const { return explicit_damping; }

  /// Damping takes part in dynamics only: a minimizer has no velocities to damp.
  bool damping_acts() const { return any_gamma && update->whichflag != 2; }

  /// The records, nullptr before the recording and without fix evp/bonds.
  const BondStore *bonds() const { return source.records(); }

  /// Which atoms are one body, by fix evp/bonds.
  BodyRule within() const { return source.within(); }

  /// Does any row name the bodies that it holds for, so that the bonds must be measured?
  bool wants_measures() const { return coefficients_.any_scaled(); }

  /// Those of the run.
  Effects effects;

  /// Those that could act, as of now.
  std::vector<std::shared_ptr<Effect>> find_effects() const;

  /// Can bonds end before their dlim? By the rules, or by an effect.
  bool bonds_can_fail() const { return rules_.breaks() || effects.any(&Effect::ends_bonds); }

  /// Groups of atoms whose pairs an effect damps, as bits.
  int implicit_groupbits() const { return implicit_groupbits_; }

  /// dlim/(R_i + R_j) of a pair of atom types, 0 where this style does not act. Known after init().
  double alpha_of(int itype, int jtype) const
  {
    return types.handles(itype, jtype) ? coefficients_.row(itype, jtype).alpha : 0.0;
  }

  /// Were the pairs packed from the neighbor list as it is now, and from the atoms here?
  bool is_packed() const;

  /// Collective. Are the packed pairs all pairs of the present positions? Ghosts are brought to these, but in a run whose
  /// fixes leave the atoms where they were at the last forces. Between runs atoms must not have moved further than the
  /// neighbor list allows.
  bool is_present();

  /// Collective. Requires is_present(). Over all MPI ranks: recorded pairs with d <= dlim, of these in the second regime,
  /// pairs not recorded that interact; smallest d/(R_i + R_j) of the packed pairs, 0 if there are none.
  std::array<double, 4> count_pairs() const;

  // what effects read and change

  PairLists &lists() { return lists_; }
  const PairLists &lists() const { return lists_; }
  BondStore &store() { return histories.store(); }
  PerAtomComm &exchange() { return histories.exchange_of_atoms(); }
  const PairRules &rules() const { return rules_; }
  const Coefficients &coefficients() const { return coefficients_; }
  const EndingBonds &ending() const { return histories.ending(); }

  /// At a packing: a column of the bonds with a value that their records have. Where an effect changes it, it tells
  /// PairHistories::note_change(), and the records get it.
  size_t add_column_of(double BondRecord::*value);
  const Atom *atoms() const { return atom; }
  const double (*positions() const)[3] { return scene::rows(atom->x); }

  /// How far the bonds of own atom i hold, by their plastic strain.
  const Limit &limit_of(int i) const { return types.limit(atom->type[i]); }

  // what the pair style sets and calls

  void set_rules(const PairRules &);
  PairTypes types;
  BondSource source;
  PairHistories histories;

  /// Collective, at the end of a step and when a minimization is at rest: see PairHistories.
  void commit(bool at_rest);

  /// Collective. Brings the records, if these are still those of the pairs, up to the last commit().
  void return_histories(const BondStore &records) { histories.return_to(records); }

  /// In a minimization with flow, of the bonds that have left the list [energy]: as much as in it, so that the potential
  /// energy does not depend on where the list ends. Over the bonds of this rank, those of two by half.
  double energy_beyond_list() const { return held_beyond_list; }

  /// In a minimization the energy of a pair is the work since its last state of rest.
  bool is_incremental() const { return update->whichflag == 2; }

  /// At init_style(): radii, bonds and the other fixes of the run to come.
  void begin_run();

  /// At init_one(): this style acts between two types. Returns the cutoff for the neighbor list.
  double handle(int itype, int jtype);

  /// Types or coefficients have changed since the last packing.
  void repack() { repack_due = true; }

  /// Collective, before the forces: packs the pairs if the neighbor list, the bonds or radii have changed, and hands heat
  /// out and moves the limits of spheres on where that is due. Returns whether this is the first packing of a run.
  bool prepare(const NeighList *);

  double memory_usage() const
  {
    return lists_.memory_usage() + snapshot.memory_usage() + histories.memory_usage();
  }

 private:
  Coefficients &coefficients_;
  PairRules rules_;
  PairLists lists_;
  PairListBuilder builder;
  ListSnapshot snapshot;

  bool any_gamma = false, explicit_damping = false;
  bool scene_checked = false, repack_due = true;
  bigint overlaps_told = 0;    // pairs, of the last warning; again when there are twice as many
  int implicit_groupbits_ = 0;
  std::string last_report;

  std::vector<std::shared_ptr<Effect>> effects_of_rules;
  long source_version = 0;      // of the bonds, at the last packing
  bool any_unlisted = false;    // bonds that are not in the list; the same on all ranks
  double held_beyond_list = 0.0;
  mutable std::vector<std::vector<std::pair<const PairList *, PackedRow>>> rows_of_atoms;
  mutable long rows_build = -1;    // of these, for pair_between()

  void stop_at_wrong_box_rates() const;
  bool may_grow(int type) const;
  void report();
  std::string describe_effects(bool that_damp) const;
  bool forces_have_changed() const;
  bool pack(const NeighList *);
  void end_broken_run();
  bigint agree_on_pairs(const PairListBuilder::Found &, bool same_list);
  void find_unlisted(bigint records_without_pair);
};

/// The effects that the rules of a pair style call for; fixes have others.
std::vector<std::shared_ptr<Effect>> make_effects(LAMMPS *, PairData &);

}    // namespace EVP
