// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/bonds/bond_store.h"
#include "core/law/coefficients.h"
#include "core/pairs/pairs.h"
#include "core/volume/volume_energy.h"
#include "core/volume/volume_record.h"
#include "lammps/base/lammps_names.h"
#include "lammps/base/scene.h"
#include "lammps/pairs/effect.h"
#include "lammps/pairs/pair_data.h"
#include "lammps/volume/volume_references.h"

#include "atom.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace EVP {

/// The volume energy of fix evp/volume on this MPI rank, which the pair style adds to its forces.
class VolumeForces final : public Effect, protected Pointers {
 public:
  VolumeLaw law;
  bool across = false;    ///< pairs of two bodies push

  /// kv: by atom type, from 1 [energy], or empty: those of the rows of the pair style.
  /// The exchange is that of the fix.
  VolumeForces(const Fix *, LAMMPS *, const std::string &who, const std::vector<double> &kv,
               PerAtomComm &);

  /// False where no row of the pair style has a kv: it costs no time then.
  bool acts() const
  {
    return !from_rows || std::any_of(kv.begin(), kv.end(), [](double value) {
      return value > 0.0;
    });
  }

  /// How many values per atom are sent at most: to ghosts, and to owners.
  static constexpr int MOST_PULLS = 3, MOST_DENSITIES = 7;

  // see Effect

  void rows_scaled(const Coefficients &) override;
  bool begin_run(PairData &pair_data) override
  {
    pairs = &pair_data;
    is_plastic = pair_data.rules().plastic;
    return acts();
  }
  /// Those that there are stay while there is nothing to do.
  void keep_values(BondStore &store) override
  {
    store.keep<VolumeRecord>(acts() || store.has<VolumeRecord>());
  }
  bool needs_bonds() const override { return acts(); }
  bool uses(double Row::*member) const override
  {
    return (from_rows && member == &Row::kv) || (member == &Row::yield && takes_over());
  }
  std::string describe() const override;

  /// Takes the pairs, and the references of new bonds.
  void pairs_packed(const NeighList *) override;
  bool follows_unlisted_bonds() const override { return true; }
  void unlisted_bonds_found(const std::vector<UnlistedBond> &) override;

  // which atoms and ghosts are torn open
  void begin_update() override { note_damage(); }
  int shared_width(Sharing when) const override { return is_plastic && when != Sharing::PACKED; }
  void put_shared(Sharing, const ValuesOfAtoms &) const override;
  void set_shared(Sharing, const ValuesOfAtoms &) override;

  /// Strains and energies at the present positions.
  void before_forces(const ParticleView &) override;
  PairConsumer *adds_forces(const PairList &list) override
  {
    return list.are_bonds ? &on_bonds : nullptr;
  }
  void for_each_further_list(const EachList &) override;

  void bond_ends(const EndingPair &) override;
  void committed() override;
  void return_to_records(bool are_due) override
  {
    if (are_due) note_bonds_at_rest();
  }

  void pairs_grow(const Ratio &) override;
  double energy() const override { return energy_here; }
  double dissipated() const override { return dissipated_here; }
  double energy_of_present_positions() override;
  double force_between(int i, int j, double d, const PackedPair &) const override;
  void add_stiffness(StiffnessMatrix &) override;
  const std::vector<double> *values_of_atoms(const std::string &name) const override
  {
    return name == "volume_strain" ? &strains : nullptr;
  }

  // for its fix, as of the last forces

  /// Volume strain and energy of a local atom.
  double strain(int i) const { return i < (int) strains.size() ? strains[i] : 0.0; }
  bool has_strain(int i) const { return (size_t) i < batches.size() && batch(i) > 0.0; }
  double energy(int i) const { return state(i).energy; }

  double memory_usage() const
  {
    double bytes = bytes_of(densities, pulls, batches, strains, open, far, leaving);
    for (const Others &some : others) bytes += some.all.memory_usage() + some.now.memory_usage();
    return bytes;
  }

 private:
  const Fix *const fix;
  const bool from_rows;
  std::vector<double> kv;
  std::vector<TakenOver> taken;    // by atom type, from 1
  PerAtomComm &exchange;
  PairData *pairs = nullptr;    // of the run, as long as its lists hold
  VolumeReferences references;
  SphereRecords<VolumeRecord> records;
  size_t inv_dlim = 0;                           // column of the bonds [1/length]
  VolumePasses::Forces on_bonds{nullptr, {}};    // as of the last evaluation

  using Ends = VolumePasses::Ends;
  static constexpr Ends BOTH = VolumePasses::BOTH;

  /// Values per atom: densities, and of own atoms what is to change them; of the first ones there are pulls.
  enum Density {
    BONDED,
    PULLING,
    PUSHING,
    CEASED
  };    // PUSHING: with plasticity, or across bodies. CEASED: with plasticity, the share that ceases to pull in this step
  struct Columns {
    bool some_push = false;
    /// After the densities, where bonds can break: shares of bonds that end in this step. to_new: the pair counts as a new one
    /// from then on. gone: it pushes at most from then on, as its atoms are in two bodies. to_new_of_older: to_new, for the older
    /// atom of a bond with one that came later.
    int to_new = PUSHING, gone = 0, to_new_of_older = 0, n = PUSHING;

    Columns() = default;
    Columns(const PairData &pairs, bool across)
    {
      const bool plastic = pairs.rules().plastic;
      some_push = plastic || (across && pairs.within() != BodyRule::ALL);
      to_new = plastic ? CEASED + 1 : some_push ? PUSHING + 1 : PUSHING;
      gone = to_new + 1;
      to_new_of_older = to_new + 2;
      n = pairs.bonds_can_fail() ? to_new + 3 : to_new;
    }
  };

  /// Pairs that have no other force here; their deq is their dlim. ends, column: for which of their atoms they count, and as
  /// which density. all: of the last packing, but of BESIDE_OPEN. now: those within dlim at the last evaluate().
  struct Others {
    Density column;
    Ends ends;
    PairList all{false}, now{false};
  };
  /// UNBONDED: pairs of one body that count as without a bond: never bonded, broken, or joined since. BESIDE_OPEN: those of them that
  /// only push. OF_LATER_ROW, OF_LATER_PARTNER: bonds with a later atom.
  enum { UNBONDED, BESIDE_OPEN, OF_TWO_BODIES, OF_LATER_ROW, OF_LATER_PARTNER, NOTHERS };
  std::array<Others, NOTHERS> others = {Others{PULLING, BOTH}, Others{PUSHING, BOTH},
                                        Others{PUSHING, BOTH}, Others{BONDED, VolumePasses::ROW},
                                        Others{BONDED, VolumePasses::PARTNER}};

  Columns columns;
  // of all atoms and ghosts; batches: the batch of each, then its openness at the packing
  AtomValues densities{columns.n}, pulls{2}, batches{2};
  std::vector<char> open;    // Openness of all atoms and ghosts; empty without plasticity
  bool any_open = false;
  std::vector<double> strains;    // of own atoms
  double energy_here = 0.0;

  // Spheres of which an effect keeps a damage pull the less. Where it has grown in this step: that before, of own atoms; else empty
  BondStore::Place damage;
  std::vector<double> damage_before;
  std::vector<double> lost_by_damage;    // of own atoms, at these positions; or empty [energy]
  double dissipated_here = 0.0;          // see Effect::dissipated()
  void note_damage();
  void find_lost_by_damage();
  void add_lost_by_damage();

  /// What an own atom keeps of its reference once bonds have broken, or atoms were torn open.
  struct Leaving {
    int i;
    VolumeReference reference;
  };
  bool bonds_end = false;          // before their dlim
  bool is_plastic = false;         // then a bond leaves at its dlim, without a share
  std::vector<int> far;            // atoms with a bond that breaks at the end of the step
  std::vector<Leaving> leaving;    // as of the last evaluate(), by i

  // what evaluate() found last
  void forget()
  {
    strains.clear();
    batches.clear();
    energy_here = 0.0;
  }

  // atoms outside the group have no volume energy, but are neighbors of those that do
  double kv_of(int i) const { return atom->mask[i] & fix->groupbit ? kv[atom->type[i]] : 0.0; }
  DensityNow density(int i) const
  {
    const double *const own = densities[i];
    return {own[BONDED], own[PULLING], columns.some_push ? own[PUSHING] : 0.0};
  }
  AtomColumn<double> densities_of(Density column) { return densities.column(column); }
  AtomColumn<const double> pulls_of(Density column) const { return pulls.column(column); }
  enum Openness { CLOSED, IS_OPEN, OPENS };
  // of an own atom. opens: do those that are beyond cavitation open now?
  Openness openness(int i, bool opens) const;
  template <class F> void set_openness(int n, F &&of);
  bool is_beside_open(int i, int j) const
  {
    return any_open && (open[i] != CLOSED || open[j] != CLOSED);
  }
  VolumeState state(int i) const { return state(i, damage ? damage.of(i) : 0.0); }
  VolumeState state(int i, double damage) const
  {
    const double kv = kv_of(i);
    return law.state(kv, reference(i), density(i),
                     is_plastic && kv > 0.0 ? taken[atom->type[i]] : TakenOver(), 1.0 - damage);
  }
  bool takes_over() const
  {
    return is_plastic && std::any_of(taken.begin(), taken.end(), [](const TakenOver &own) {
             return own.bulk > 0.0;
           });
  }
  const VolumeReference &reference(int i) const;
  double pull(int i, int j, Density column, Ends ends) const
  {
    return (ends & VolumePasses::ROW ? pulls_of(column).of(i) : 0.0) +
        (ends & VolumePasses::PARTNER ? pulls_of(column).of(j) : 0.0);
  }
  double batch(int i) const { return batches[i][0]; }

  // For which of its atoms a bond counts: for the later one alone, as the other one has its reference without it
  Ends ends_of_bond(int i, int j) const
  {
    return batch(i) == batch(j) ? BOTH
        : batch(i) > batch(j)   ? VolumePasses::ROW
                                : VolumePasses::PARTNER;
  }
  bool are_pair(int i, int j) const { return has_strain(i) && has_strain(j); }
  bool are_one_body(int i, int j) const { return !in_different_bodies(atom, store().within, i, j); }
  // once it has no bond, which remains when types or molecule IDs change
  bool counts(int i, int j) const { return across || are_one_body(i, j); }
  BondStore &store() const { return pairs->store(); }
  double dlim(int i, int j) const;
  template <class F> void for_each_pair(F &&f) const;
  void note_bonds_at_rest();
  std::optional<VolumeReference> find_change(int i);
  void find_beside_open();
  void fill_gaps(const std::vector<char> &newly_set);
  void add_leaving(const std::vector<int> &ended);
  Others &of_later(int i, int j)
  {
    return others[batch(i) > batch(j) ? OF_LATER_ROW : OF_LATER_PARTNER];
  }
  Others &unbonded(int i, int j) { return others[are_one_body(i, j) ? UNBONDED : OF_TWO_BODIES]; }
  static void add_pair(PairList &, int i, int j, double dlim, Error *);
  static void remove_pair(PairList &, int i, int j);
};

}    // namespace EVP
