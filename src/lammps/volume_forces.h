// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "core/coefficients.h"
#include "core/volume_energy.h"
#include "lammps_names.h"
#include "per_atom.h"
#include "scene.h"

#include "atom.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

namespace EVP {

/// The volume energy of fix evp/volume on this MPI rank, which the pair style adds to its forces.
class VolumeForces : protected Pointers {
 public:
  /// What goes with an atom, into restart files too but for the strain. All 0 where it has no bond.
  struct Record {
    double weight_sum;    ///< W of core/volume_energy.h, taken when the bonds were first seen
    double sum_deq;       ///< of these bonds [length]: tells whether they are those of the store
    double strain;        ///< as of the last evaluate()
  };

  using Values = PerAtomComm::Values;

  /// kv: by atom type, from 1 [energy], or empty: those of the rows of the pair style, by take_kv().
  /// Records and exchange of one value per atom are those of the fix.
  VolumeForces(LAMMPS *, const std::string &who, int groupbit, const std::vector<double> &kv,
               std::vector<Record> &records, PerAtomComm &);

  /// Of the fix there is, nullptr without, and where it has nothing to do.
  static std::shared_ptr<VolumeForces> find(const Modify *);

  /// Calls kv(type) for all types where KV is that of the rows of the pair style.
  template <class KV> static void take_kv(const Modify *modify, KV &&kv)
  {
    const auto forces = scene::find_shared<VolumeForces>(modify, "evp/volume", "volume");
    if (!forces || !forces->from_rows) return;
    for (int type = 1; type < (int) forces->kv.size(); type++) forces->kv[type] = kv(type);
    if (!forces->acts()) forces->forget();
  }

  /// Is KV that of the rows of the pair style?
  bool is_of_rows() const { return from_rows; }

  /// False where no row of the pair style has a kv: it costs no time then.
  bool acts() const
  {
    return !from_rows || std::any_of(kv.begin(), kv.end(), [](double value) {
      return value > 0.0;
    });
  }

  /// The fix goes: it must not be asked any more.
  void close() { closed = true; }
  bool is_closed() const { return closed; }

  // what the pairs call

  /// Takes the weights of a list that was just packed; where all MPI ranks do, of new bonds too.
  void pack(const PairList &bonds, const BondStore &, const Coefficients &, bool collective);

  /// Collective. Strains and energies at the present positions.
  void evaluate(const PairLists &, const ParticleView &);

  /// After evaluate(), see VolumeEnergy.
  template <class Tally>
  void add_forces(const PairLists &lists, const ParticleView &view, Tally &&tally) const
  {
    energies.add_forces(lists.bonds, view, pulls.data(), tally);
  }

  // what others read, as of the last evaluate()

  /// Force of a bond between particles with these indices [force], positive repels.
  double force(int i, int j, double deq, double dlim) const
  {
    if ((size_t) std::max(i, j) >= pulls.size()) return 0.0;
    return -VolumeEnergy::weight(deq, dlim) * (pulls[i] + pulls[j]) / deq;
  }

  /// The same of a packed pair within its cutoff.
  double force(const PlacedPair &p) const { return -opening_of(p) * (pulls[p.i] + pulls[p.j]); }

  /// Volume strain of a local atom, over its recorded bonds.
  double strain(int i) const { return records[i].strain; }

  /// Energy of a local atom, of all of them.
  double energy(int i) const { return 0.5 * kv_of(i) * strain(i) * strain(i); }
  double energy() const { return energy_here; }

  /// Energy that a local atom loses as pairs leave the sum whose shares add up to this.
  double jump(int i, double left) const
  {
    const double theta = VolumeEnergy::strain(left, records[i].weight_sum);
    return kv_of(i) * theta * (strain(i) + 0.5 * theta);
  }

  /// Share of the sums of both atoms that a packed pair has at its cutoff.
  double share_at_cut(const PackedPair &pair, size_t index) const
  {
    return energies.weight_of((int) index) * (pair.cut * pair.inv_deq - 1.0);
  }

  // its stiffness sum_i K_i b_i b_i^T, with b_i the derivative of the sum of atom i

  /// Derivative of the sums of both atoms by the length of their pair [1/length].
  double opening_of(const PlacedPair &p) const { return energies.weight_of(p.index) * p.inv_deq; }

  /// K_i of a local atom [energy].
  double stiffness(int i) const { return VolumeEnergy::stiffness(kv_of(i), records[i].weight_sum); }

  double memory_usage() const { return energies.memory_usage() + bytes_of(pulls, sums); }

 private:
  const std::string who;
  const int groupbit;
  const bool from_rows;
  std::vector<double> kv;
  std::vector<Record> &records;
  PerAtomComm &exchange;

  VolumeEnergy energies;
  long version = -1;    // of the store whose bonds the records are of
  bool closed = false;
  Values sums, pulls;    // of all atoms and ghosts
  double energy_here = 0.0;

  // what evaluate() found last
  void forget()
  {
    for (Record &record : records) record.strain = 0.0;
    energy_here = 0.0;
  }

  // atoms outside the group have no volume energy, but are neighbors of those that do
  double kv_of(int i) const { return atom->mask[i] & groupbit ? kv[atom->type[i]] : 0.0; }
  void take_records(const BondStore &, const Coefficients &);
  bool are_of(const BondStore &) const;
};

}    // namespace EVP
