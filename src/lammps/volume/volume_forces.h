// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_store.h"
#include "core/law/coefficients.h"
#include "core/pairs/pairs.h"
#include "core/volume/volume_energy.h"
#include "core/volume/volume_record.h"
#include "lammps/base/lammps_names.h"
#include "lammps/base/scene.h"

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
class VolumeForces : protected Pointers {
 public:
  using Values = PerAtomComm::Values;

  VolumeLaw law;

  /// kv: by atom type, from 1 [energy], or empty: those of the rows of the pair style, by set_kv().
  /// The exchange of npulls() and ncolumns() values per atom is that of the fix.
  VolumeForces(LAMMPS *, const std::string &who, int groupbit, const std::vector<double> &kv,
               PerAtomComm &);

  /// Of the fix there is, nullptr without, and where it has nothing to do.
  static std::shared_ptr<VolumeForces> find(const Modify *);

  /// Where these are those of the rows of the pair style.
  void set_kv(int type, double now)
  {
    kv[type] = now;
    if (!acts()) forget();
  }

  bool is_of_rows() const { return from_rows; }

  /// False where no row of the pair style has a kv: it costs no time then.
  bool acts() const
  {
    return !from_rows || std::any_of(kv.begin(), kv.end(), [](double value) {
      return value > 0.0;
    });
  }

  /// How many values per atom evaluate() sends to owners, and to ghosts.
  static int ncolumns(const PairRules &rules) { return Columns(rules).n; }
  static int npulls(const PairRules &rules) { return rules.plastic ? 3 : 2; }

  // what the pairs call

  /// Collective. Takes the pairs of a neighbor list, and the references of new bonds. ending: which bonds end.
  void pack(const NeighList *, PairLists &, BondStore &, const Coefficients &, const PairRules &,
            const EndingBonds &ending);

  /// Collective. Strains and energies at the present positions.
  void evaluate(const PairLists &, const ParticleView &);

  void evaluate(const PairLists &lists)
  {
    evaluate(lists, {scene::rows(atom->x), nullptr, nullptr, lists.nreact});
  }

  /// A bond of the list that ends, and is still in it, counts as a pair that was never recorded.
  void bond_ends(PairLists &, int k);

  /// Collective. The same as evaluate() for one who asks at other positions: what a commit() uses, strains and the energy of
  /// all atoms stay those of the forces; the rest is of these positions until the next evaluate().
  void evaluate_aside(const PairLists &);

  /// A bond of eq. 8 of own atom i that is past the end of the neighbor list breaks at the end of the step. Void with the
  /// next pack().
  void far_bond_leaves(int i) { far.push_back(i); }

  /// At the end of a step: what evaluate() has found of the references comes into force.
  void commit();

  // with plasticity, when limits move on and at a packing: which atoms and ghosts are torn open

  enum Openness { CLOSED, IS_OPEN, OPENS };

  /// Of an own atom, by its record. now: do those that are beyond cavitation open now?
  Openness openness(int i, bool now) const
  {
    const VolumeRecord &own = records[i];
    if (own.reference.is(VolumeReference::OPEN)) return IS_OPEN;
    return now && own.strain > law.cavitation && kv_of(i) > 0.0 ? OPENS : CLOSED;
  }
  /// of(i): Openness of n atoms and ghosts.
  template <class F> void set_openness(int n, F &&of)
  {
    open.resize(n);
    for (int i = 0; i < n; i++) open[i] = (char) of(i);
    any_open = std::any_of(open.begin(), open.end(), [](char one) {
      return one != CLOSED;
    });
  }

  /// Collective, before the records are told where deq of these bonds has moved, and which have ended.
  void note_bonds_at_rest(const PairLists &);

  /// Adds the forces of evaluate() to those that bonds have.
  VolumePasses::Forces on_bonds{nullptr, {nullptr, 0}};

  /// After evaluate(), calls f(list, what adds its forces) for pairs that have no other.
  template <class F> void for_each_other(F &&f)
  {
    for (Others &some : others) {
      VolumePasses::Forces forces(some.now.inv_deq.data(), pulls_of(some.column), some.ends);
      f(some.now, forces);
    }
  }

  // what others read, as of the last evaluate()

  /// Calls f(PlacedPair, does it count as a bond, 1/dlim, sum of -dU/drho of the atoms for which it counts [energy]) for all
  /// pairs within their dlim, or zone.
  template <class F> void for_each_pair(const PairLists &lists, F &&f) const
  {
    const auto *const x = scene::rows(atom->x);
    EVP::for_each_pair(lists.bonds, x, [&](const PlacedPair &p) {
      const double inv_dlim = lists.bonds.inv_dlim[p.index];
      if (p.distance() * inv_dlim < 1.0) f(p, true, inv_dlim, pull(p.i, p.j, BONDED, BOTH));
    });
    for (const auto &[list, column, ends] :
         {std::tuple(&lists.unbonded, PULLING, BOTH),
          {&others[OF_LATER_ROW].all, BONDED, VolumePasses::ROW},
          {&others[OF_LATER_PARTNER].all, BONDED, VolumePasses::PARTNER}})
      EVP::for_each_pair(*list, x, [&, column = column, ends = ends](const PlacedPair &p) {
        const bool only_pushes = column == PULLING && is_beside_open(p.i, p.j);
        if (p.distance() * p.inv_deq < 1.0)
          f(p, column == BONDED, p.inv_deq, pull(p.i, p.j, only_pushes ? PUSHING : column, ends));
      });
  }

  /// Force of a pair of atoms of a row with this alpha, at this distance [force], positive repels. bond: does it count as one?
  double force(int i, int j, double d, double alpha, bool bond) const;

  /// Volume strain and energy of a local atom, energy of all of them.
  double strain(int i) const { return i < (int) strains.size() ? strains[i] : 0.0; }
  bool has_strain(int i) const { return stride * (size_t) i < batches.size() && batch(i) > 0.0; }
  double energy(int i) const { return state(i).energy; }
  double energy() const { return energy_here; }

  VolumeStiffness stiffness(int i) const { return state(i).stiffness; }

  double memory_usage() const
  {
    double bytes = bytes_of(densities, pulls, batches, strains, open, far, leaving);
    for (const Others &some : others) bytes += some.all.memory_usage() + some.now.memory_usage();
    return bytes;
  }

 private:
  const std::string who;
  const int groupbit;
  const bool from_rows;
  std::vector<double> kv;
  PerAtomComm &exchange;
  // of the last pack(), in the run and as long as its lists hold
  BondStore *store = nullptr;
  SphereRecords<VolumeRecord> records;
  const Coefficients *coefficients = nullptr;

  using Ends = VolumePasses::Ends;
  static constexpr Ends BOTH = VolumePasses::BOTH;

  /// Values per atom: densities, and of own atoms what is to change them; of the first ones there are pulls.
  enum Density {
    BONDED,
    PULLING,
    PUSHING,
    CEASED
  };    // the last two with plasticity; the last: to pull in this step
  struct Columns {
    /// After the densities, where bonds can break: shares of bonds that end in this step. to_new: the pair counts as a new one
    /// from then on. gone: it does not count any more, as its atoms are in two bodies. to_new_of_older: to_new, for the older
    /// atom of a bond with one that came later.
    int to_new, gone, to_new_of_older, n;

    explicit Columns(const PairRules &rules) : to_new(rules.plastic ? CEASED + 1 : PUSHING)
    {
      gone = to_new + 1;
      to_new_of_older = to_new + 2;
      n = rules.breaks() ? to_new + 3 : to_new;
    }
  };

  /// Pairs that have no other force here; their deq is their dlim. ends, column: for which of their atoms they count, and as
  /// which density. all: of the last pack(), of bonds with a later atom only. now: those within dlim at the last evaluate().
  struct Others {
    Density column;
    Ends ends;
    PairList all{false}, now{false};
  };
  enum { UNBONDED, BESIDE_OPEN, OF_LATER_ROW, OF_LATER_PARTNER, NOTHERS };
  std::array<Others, NOTHERS> others = {Others{PULLING, BOTH}, Others{PUSHING, BOTH},
                                        Others{BONDED, VolumePasses::ROW},
                                        Others{BONDED, VolumePasses::PARTNER}};

  bigint partners = -1;    // sum over the atoms with bonds, which tells whether they are the same
  Columns columns{PairRules()};
  int stride = 2;    // of pulls and batches
  // of all atoms and ghosts; batches: the batch of each, then its openness at the packing
  Values densities, pulls, batches;
  std::vector<char> open;    // Openness of all atoms and ghosts; empty without plasticity
  bool any_open = false;
  std::vector<double> strains;    // of own atoms
  double energy_here = 0.0;

  /// What an own atom keeps of its reference once bonds have broken, or atoms were torn open.
  struct Leaving {
    int i;
    VolumeReference reference;
  };
  const EndingBonds *ending = nullptr;    // of the pairs; nullptr where none ends before its dlim
  bool is_plastic = false;                // then a bond leaves at its dlim, without a share
  std::vector<int> far;                   // atoms with a bond that breaks at the end of the step
  std::vector<Leaving> leaving;           // as of the last evaluate(), by i

  // what evaluate() found last
  void forget()
  {
    strains.clear();
    batches.clear();
    energy_here = 0.0;
  }

  // atoms outside the group have no volume energy, but are neighbors of those that do
  double kv_of(int i) const { return atom->mask[i] & groupbit ? kv[atom->type[i]] : 0.0; }
  DensityNow density(int i) const
  {
    const double *const own = &densities[columns.n * (size_t) i];
    return {own[BONDED], own[PULLING], is_plastic ? own[PUSHING] : 0.0};
  }
  VolumePasses::Column<double> densities_of(Density column)
  {
    return {densities.data() + column, columns.n};
  }
  VolumePasses::Column<const double> pulls_of(Density column) const
  {
    return {pulls.data() + column, stride};
  }
  bool is_beside_open(int i, int j) const
  {
    return any_open && (open[i] != CLOSED || open[j] != CLOSED);
  }
  VolumeState state(int i) const { return law.state(kv_of(i), reference(i), density(i)); }
  const VolumeReference &reference(int i) const;
  double pull(int i, int j, Density column, Ends ends) const
  {
    return (ends & VolumePasses::ROW ? pulls_of(column).of(i) : 0.0) +
        (ends & VolumePasses::PARTNER ? pulls_of(column).of(j) : 0.0);
  }
  double batch(int i) const { return batches[stride * (size_t) i]; }

  // For which of its atoms a bond counts: for the later one alone, as the other one has its reference without it
  Ends ends_of_bond(int i, int j) const
  {
    return batch(i) == batch(j) ? BOTH
        : batch(i) > batch(j)   ? VolumePasses::ROW
                                : VolumePasses::PARTNER;
  }
  // bonds remain when types or molecule IDs change
  bool are_pair(int i, int j, bool is_bond) const
  {
    return has_strain(i) && has_strain(j) &&
        (is_bond || !in_different_bodies(atom, store->within, i, j));
  }
  // pairs that no zone recorded count as little as the bonds that are not there
  double reach(double alpha) const
  {
    return store->zone > 0.0 ? std::min(store->zone, alpha) : alpha;
  }
  double dlim(int i, int j, bool is_bond) const;
  std::optional<VolumeReference> find_change(int i);
  void find_beside_open(const PairLists &);
  std::vector<char> set_references(const std::vector<NeighborDensity> &rest, bool takes,
                                   const std::vector<double> &to_be);
  void set_gaps(const std::vector<char> &is_known);
  void fill_gaps(const PairLists &, const std::vector<char> &taken);
  static void lose_partners(VolumeRecord &, const NeighborDensity &left);
  void add_leaving(const PairLists &, const std::vector<int> &ended);
  std::vector<NeighborDensity> at_rest(const std::vector<double> &to_be) const;
  Others &of_later(int i, int j)
  {
    return others[batch(i) > batch(j) ? OF_LATER_ROW : OF_LATER_PARTNER];
  }
  static void add_pair(PairList &, int i, int j, double dlim, Error *);
  static void remove_pair(PairList &, int i, int j);
  std::vector<double> batches_to_be(bool takes) const;
  bool is_new(int i) const;
  bigint sum_of_partners() const;
  std::vector<double> reaches() const;
  std::vector<VolumeScene::Exclusion> exclusions() const;
};

}    // namespace EVP
