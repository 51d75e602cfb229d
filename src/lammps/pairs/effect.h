// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/bonds/bond_store.h"
#include "core/law/coefficients.h"
#include "core/pairs/contacts.h"
#include "core/pairs/pair_block.h"
#include "lammps/base/lammps_names.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace EVP {

class PairData;
class StiffnessMatrix;
class StressReader;

/// A bond of an own atom that is in no list, as it is past its cutoff. Lengths are those of the records: the state at the cutoff
/// is the same, whatever its atoms have grown by.
struct UnlistedBond {
  int i;
  int64_t partner;
  double deq, radius, cutoff;    ///< radius: of the partner
  bool at_dlim;                  ///< that is its cutoff
  PairState state;               ///< at the cutoff
};

/// A bond that ends, or a contact that becomes one, and is in its list still.
struct EndingPair {
  int index;    ///< in the list
  int i, j;
  Stored stored;    ///< by the last forces, which is lost [energy]
};

/// What solves for damping, for those who add its work up. Powers are those of this MPI rank; pairs that another one holds
/// too count by half.
class SolvedDamping {
 public:
  /// The force that is in f [force], of local atoms; empty without damping.
  virtual const AtomValues &applied_damping() const = 0;

  /// Power that the dampers take in the mean over the half step before the present positions, or after them [energy/time].
  virtual double power_before() const = 0;
  virtual double power_after() const = 0;

  /// Power that a box which deforms with 'remap v' puts in by the dampers across its boundary [energy/time].
  virtual double power_of_box() const = 0;

 protected:
  ~SolvedDamping() = default;
};

/// Values of atoms and ghosts in an exchange: those of one of the effects that share it.
struct ValuesOfAtoms {
  AtomValues &all;
  int first;    ///< of its values of an atom
  double *operator[](int i) const { return all[i] + first; }
};

/// When atoms and ghosts get the values that effects share.
enum class Sharing {
  PACKED,     ///< the pairs of a new neighbor list
  BEGINS,     ///< a minimization, in which only what users have changed comes into force
  UPDATED,    ///< the limits move
};

/// What acts beside the law of the pairs: plasticity, and what fixes add. The functions stand in the order in which the pair
/// style calls them, on all MPI ranks together: that of a run and of its steps.
class Effect {
 public:
  // 1. A run begins. The rows are known, and scaled for the body if its bonds were measured; fixes are not set up yet.

  /// Again where the bonds are measured later.
  virtual void rows_scaled(const Coefficients &) {}

  /// Returns whether the effect acts in this run. If not, no function of it is called that follows.
  virtual bool begin_run(PairData &) { return true; }

  /// Says by BondStore::keep() what spheres keep for it, at each set-up, maybe twice, also where it does not act.
  virtual void keep_values(BondStore &) {}

  /// Does it add to the forces, from what the recorded bonds say?
  virtual bool needs_bonds() const { return false; }

  /// Does it read this number of a row?
  virtual bool uses(double Row::* /*member*/) const { return false; }

  /// Pairs with an atom of these groups have the law without gamma, as the effect damps them.
  virtual int damped_groupbits() const { return 0; }

  /// Can bonds end by its failure()?
  virtual bool ends_bonds() const { return false; }

  /// Are steps so long that limits must follow each of them?
  virtual bool updates_each_step() const { return false; }

  /// A part of the line that tells what acts.
  virtual std::string describe() const { return ""; }

  // 2. The pairs of a new neighbor list are packed.

  /// Own atoms that came later have just got their bonds, which are about to be packed. are_new: of each
  virtual void atoms_recorded(const std::vector<char> & /*are_new*/) {}

  virtual void pairs_packed(const LAMMPS_NS::NeighList *) {}

  /// Must it know the bonds that are past the end of the list?
  virtual bool follows_unlisted_bonds() const { return false; }
  virtual void unlisted_bonds_found(const std::vector<UnlistedBond> &) {}

  // 3. Before some forces there is an update of what changes slowly. It is due at the steps divisible by
  // PairRules::update_every, at those that an effect asks for, and before the first ones of a run where an effect was changed
  // since the last run.

  virtual bool is_due() const { return false; }         ///< in this step
  virtual bool was_changed() const { return false; }    ///< seen from this MPI rank
  virtual void begin_update() {}
  virtual void update_effect() {}

  /// Multiplies the share of the slips of each own atom since the last update that hardens it.
  virtual void multiply_hardening(std::vector<double> & /*shares*/) const {}

  /// The plastic strains of own atoms, once they are known. have_flowed: they are not given by users.
  virtual void strains_updated(const BondStore &, bool /*have_flowed*/) {}

  /// Multiplies how far the bonds of each own atom hold.
  virtual void multiply_limits(std::vector<double> & /*factors*/) const {}

  /// The same for bonds alone, in a run in which contacts have other limits.
  virtual bool weakens_bonds() const { return false; }
  virtual void multiply_limits_of_bonds(std::vector<double> & /*factors*/) const {}

  /// How many values atoms and ghosts get, those of own atoms, and what becomes of them.
  virtual int shared_width(Sharing) const { return 0; }
  virtual void put_shared(Sharing, const ValuesOfAtoms &) const {}
  virtual void set_shared(Sharing, const ValuesOfAtoms &) {}

  /// Lengths of pairs become ratio(i, j) times as large: of those that the effect keeps in lists of its own.
  using Ratio = std::function<double(int, int)>;
  virtual void pairs_grow(const Ratio &) {}

  /// Which bonds fail from now on; nullptr: none. It must be known before the forces, as densities are summed over the
  /// bonds that stay: what depends on forces takes those of the last update.
  virtual const FailureCriterion *failure() const { return nullptr; }

  /// Which contacts of two bodies become bonds now, where there is a criterion; nullptr: it has none.
  virtual const JoiningCriterion *joining() const { return nullptr; }

  // 4. Forces, of which there may be several evaluations in a step: they find what changes, and change nothing.

  virtual void before_forces(const ParticleView &) {}

  /// In the loop over the blocks of a list: first what adds forces, then bonds end or begin, then those that read. nullptr: none
  virtual PairConsumer *adds_forces(const PairList &) { return nullptr; }
  virtual PairConsumer *reads_forces(const PairList &) { return nullptr; }

  /// Calls f(list, what adds its forces) for pairs that have no force by their law. Their forces are read, too.
  using EachList = std::function<void(PairList &, PairConsumer &)>;
  virtual void for_each_further_list(const EachList &) {}

  virtual void after_forces(const ParticleView &) {}

  /// Gets the stresses of spheres, of the first forces after an update; nullptr: not needed.
  virtual StressReader *stress_reader() { return nullptr; }

  // 5. The end of a step, or of a minimization that came to rest: what the last forces found takes effect.

  virtual void commit() {}
  virtual void bond_ends(const EndingPair &) {}
  virtual void contact_joins(const EndingPair &) {}
  virtual void unlisted_bonds_end(const std::vector<UnlistedBond> &) {}
  virtual void committed() {}

  // 6. Before atoms migrate, and before someone reads the records. are_due: has anything taken effect since?

  virtual void return_to_records(bool /*are_due*/) {}

  // Energies that others find [energy].

  /// Dissipated by pairs of this MPI rank at fixed distances, as limits fell. takes_dissipated: what the step that led there has
  /// to do with it is taken off.
  virtual bool takes_dissipated() const { return false; }
  virtual void add_dissipated(double) {}

  /// Gained by pairs of this MPI rank at fixed distances, as their lengths grew.
  virtual void add_grown(double) {}

  /// Plastic work of each own atom. Heat of a pair, half of it for each atom, for j where it takes reactions.
  virtual bool takes_heat() const { return false; }
  virtual void add_plastic_work(const std::vector<double> &) {}
  virtual void add_heat(int /*i*/, int /*j*/, bool /*j_takes*/, double) {}

  // Questions of others, as of the last forces.

  /// What no pair holds, on this MPI rank [energy].
  virtual double energy() const { return 0.0; }
  virtual double energy_of_present_positions() { return energy(); }

  /// Dissipated of it at fixed positions, as limits fell before these forces [energy].
  virtual double dissipated() const { return 0.0; }

  /// Of a pair of atoms at a distance [force], positive repels.
  virtual double force_between(int /*i*/, int /*j*/, double /*d*/, const PackedPair &) const
  {
    return 0.0;
  }

  /// Adds its part at the present positions.
  virtual void add_stiffness(StiffnessMatrix &) {}

  /// Values of own atoms by their name for users; nullptr: it has none of this name.
  virtual const std::vector<double> *values_of_atoms(const std::string &) const { return nullptr; }

  virtual const SolvedDamping *solved_damping() const { return nullptr; }
  virtual bool asks_for_powers() const { return false; }    ///< of solved_damping()

 protected:
  ~Effect() = default;
};

/// A fix with an effect. The pair style looks for it at the beginning of each run, as the fix may go between runs.
class HasEffect {
 public:
  virtual std::shared_ptr<Effect> effect() = 0;

 protected:
  ~HasEffect() = default;
};

/// A fix that is an effect.
class EffectOfFix : public Effect, public HasEffect {
 public:
  std::shared_ptr<Effect> effect() final { return self; }

 protected:
  ~EffectOfFix() = default;

 private:
  std::shared_ptr<Effect> self{this, [](Effect *) {
                               }};    // gone with the fix
};

/// Those of a run, in the order in which they act.
class Effects {
 public:
  void clear() { all.clear(); }
  void add(const std::shared_ptr<Effect> &one) { all.push_back(one); }

  template <class F> void for_each(F &&f) const
  {
    for (const auto &one : all)
      if (const auto effect = one.lock()) f(*effect);
  }

  void drop_those_that_need_bonds()
  {
    all.erase(std::remove_if(all.begin(), all.end(),
                             [](const auto &one) {
                               const auto effect = one.lock();
                               return !effect || effect->needs_bonds();
                             }),
              all.end());
  }

  /// Is it so for any?
  template <class F> bool any(F &&f) const
  {
    bool found = false;
    for_each([&](const Effect &one) {
      found = found || std::invoke(f, one);
    });
    return found;
  }

 private:
  std::vector<std::weak_ptr<Effect>> all;    // fixes may go between runs
};

}    // namespace EVP
