// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "core/coefficients.h"
#include "core/pairs.h"
#include "core/volume_energy.h"
#include "lammps_names.h"
#include "scene.h"

#include "atom.h"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

namespace EVP {

/// The volume energy of fix evp/volume on this MPI rank, which the pair style adds to its forces.
class VolumeForces : protected Pointers {
 public:
  using Values = PerAtomComm::Values;

  VolumeLaw law;

  /// kv: by atom type, from 1 [energy], or empty: those of the rows of the pair style, by set_kv().
  /// The exchange of VolumePasses::WIDTH values per atom is that of the fix.
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

  /// The pair of a bond that breaks counts as one that was never recorded.
  void pair_leaves(PairLists &, int i, int j, double dlim) const;

  /// A pair without a bond becomes one that is d apart. Returns 1/dlim, as the list of bonds has it.
  double pair_begins(PairLists &, int i, int j, double d, double alpha);

  /// Collective, after these: the references of their atoms.
  void commit_joins(const PairLists &);

  /// Collective. The same for one who asks at other positions: what the fix reports, and which bonds break, stays that of the
  /// forces.
  void evaluate_aside(const PairLists &);

  /// A bond of eq. 8 of own atom i that is past the end of the neighbor list breaks at the end of the step. Void with the
  /// next pack().
  void far_bond_leaves(int i) { far.push_back(i); }

  /// At the end of a step: the references lose the bonds that break, as evaluate() has found them.
  void commit();

  /// Collective, before the records are told where deq of these bonds has moved, and which have ended.
  void note_bonds_at_rest(const PairLists &);

  /// After evaluate(): what adds the forces of bonds to those that they have, and of the pairs without a bond, which have no
  /// other.
  VolumePasses::Forces on_bonds{nullptr, nullptr}, on_others{nullptr, nullptr};
  PairList &others() { return active; }

  // what others read, as of the last evaluate()

  /// Calls f(PlacedPair, 1/dlim, sum of -dU/drho of both atoms [energy]) for all pairs within their dlim, or zone.
  template <class F> void for_each_pair(const PairLists &lists, F &&f) const
  {
    for (const PairList *list : {&lists.bonds, &lists.unbonded})
      EVP::for_each_pair(*list, scene::rows(atom->x), [&](const PlacedPair &p) {
        const double inv_dlim = list == &lists.bonds ? list->inv_dlim[p.index] : p.inv_deq;
        if (p.distance() * inv_dlim < 1.0) f(p, inv_dlim, pull(p.i, p.j, list == &lists.unbonded));
      });
  }

  /// Force of a pair of atoms of a row with this alpha, at this distance [force], positive repels.
  double force(int i, int j, double d, double alpha, bool is_bond) const
  {
    if (2 * (size_t) std::max(i, j) >= pulls.size() || !are_pair(i, j, is_bond)) return 0.0;
    const double end = reach(alpha) * (atom->radius[i] + atom->radius[j]);
    return d < end ? -pull(i, j, !is_bond) * 2.0 * (1.0 - d / end) / end : 0.0;
  }

  /// Volume strain and energy of a local atom, energy of all of them.
  double strain(int i) const { return i < (int) strains.size() ? strains[i] : 0.0; }
  bool has_strain(int i) const
  {
    return 2 * (size_t) i < has_bonds.size() && has_bonds[2 * (size_t) i] != 0.0;
  }
  double energy(int i) const { return state(i).energy; }
  double energy() const { return energy_here; }

  VolumeStiffness stiffness(int i) const { return state(i).stiffness; }

  double memory_usage() const
  {
    return active.memory_usage() + bytes_of(densities, pulls, has_bonds, strains, far, leaving);
  }

 private:
  const std::string who;
  const int groupbit;
  const bool from_rows;
  std::vector<double> kv;
  PerAtomComm &exchange;
  BondStore *store = nullptr;    // of the last pack(), in the run and as long as its lists hold

  PairList active =
      PairList(false);     // pairs without a bond within their dlim at the last evaluate()
  bigint partners = -1;    // sum over the atoms with bonds, which tells whether they are the same
  Values densities, pulls, has_bonds;    // of all atoms and ghosts
  std::vector<double> strains;           // of own atoms
  double energy_here = 0.0;

  /// What an own atom keeps of its reference once bonds have broken.
  struct Leaving {
    int i;
    VolumeReference reference;
  };
  const EndingBonds *ending = nullptr;    // of the pairs; nullptr where none ends before its dlim
  bool end_at_dlim = false;        // then a bond leaves without a share, and no rule is needed
  std::vector<int> far;            // atoms with a bond that breaks at the end of the step
  std::vector<Leaving> leaving;    // as of the last evaluate(), by i
  enum Kind : size_t { COUNTED, OF_TWO_BODIES };    // of pairs before they join and after they end
  Values joined;    // shares of bonds that have just begun, by Kind; empty without

  // what evaluate() found last
  void forget()
  {
    strains.clear();
    has_bonds.clear();
    energy_here = 0.0;
  }

  // atoms outside the group have no volume energy, but are neighbors of those that do
  double kv_of(int i) const { return atom->mask[i] & groupbit ? kv[atom->type[i]] : 0.0; }
  DensityNow density(int i) const
  {
    return {densities[2 * (size_t) i], densities[2 * (size_t) i + 1]};
  }
  VolumeState state(int i) const { return law.state(kv_of(i), reference(i), density(i)); }
  const VolumeReference &reference(int i) const;
  double pull(int i, int j, size_t of) const
  {
    return pulls[2 * (size_t) i + of] + pulls[2 * (size_t) j + of];
  }
  // bonds remain when types or molecule IDs change
  bool are_pair(int i, int j, bool is_bond) const
  {
    return has_bonds[2 * (size_t) i] && has_bonds[2 * (size_t) j] &&
        (is_bond || !in_different_bodies(atom, store->within, i, j));
  }
  // pairs that no zone recorded count as little as the bonds that are not there
  double reach(double alpha) const
  {
    return store->zone > 0.0 ? std::min(store->zone, alpha) : alpha;
  }
  double dlim(const Coefficients &, int i, int j, bool is_bond) const;
  void set_references(const std::vector<NeighborDensity> &rest, bool takes);
  void set_gaps(const std::vector<char> &is_known);
  void fill_gaps(const PairLists &, bool at_rest_only);
  static void lose_partners(VolumeRecord &, const NeighborDensity &left);
  void find_leaving(const PairLists &, const std::vector<int> &ended);
  std::vector<NeighborDensity> at_rest(const Coefficients &, bool takes) const;
  bool is_new(int i) const;
  bigint sum_of_partners() const;
  double sum_of_reaches(const Coefficients &) const;
};

}    // namespace EVP
