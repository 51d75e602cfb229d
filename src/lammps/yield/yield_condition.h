// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/pairs/pair_block.h"
#include "core/yield/yield.h"
#include "lammps/pairs/effect.h"

#include <tuple>
#include <vector>

namespace EVP {

/// Adds up the stresses of spheres from the forces of a loop: half of the virial of each pair, without damping.
class StressSums final : public PairConsumer {
 public:
  /// Of particles and ghosts, below nreact with the reactions: -1/2 sum of F/d r (x) r [energy], tension is positive; then the force
  /// of all their pairs, which is the change of f by the loop.
  AtomValues sums{(int) Tensor().size() + 3};

  void begin(int nall, const ParticleView &);
  void end(const ParticleView &);
  int nreact = 0;
  bool damped = false;    ///< do the blocks have forces of the damping?

  void operator()(const PairRange &, PairBlock &) override;
};

/// Spheres flow at the flow stress of their row ('yield' of a row, with plasticity): see yielding.
class YieldCondition final : public Effect, protected Pointers {
 public:
  YieldCondition(LAMMPS *lmp, PairData &pair_data) : Pointers(lmp), pairs(pair_data) {}

  void rows_scaled(const Coefficients &) override;
  bool begin_run(PairData &) override { return acts; }
  void keep_values(BondStore &) override;
  bool uses(double Row::*member) const override { return member == &Row::yield; }
  std::string describe() const override;

  void pairs_packed(const NeighList *) override;
  void begin_update() override;
  void update_effect() override;
  void multiply_hardening(std::vector<double> &shares) const override;
  void strains_updated(const BondStore &, bool have_flowed) override;
  void multiply_limits(std::vector<double> &factors) const override;

  // stresses are those of the forces after an update, and are taken at the next one
  void before_forces(const ParticleView &) override;
  PairConsumer *reads_forces(const PairList &) override { return measures ? &stresses : nullptr; }
  void after_forces(const ParticleView &) override;
  void committed() override;

 private:
  PairData &pairs;
  SphereRecords<YieldRecord> records;
  std::vector<Row> rows;    // by atom type, from 1; of those without the condition yield is 0
  bool acts = false, measures = false, masses_checked = false;
  StressSums stresses;
  std::vector<double> strains;          // plastic, of own atoms before the update
  std::vector<double> flow_stresses;    // of own atoms at these; 0 without the condition

  // of atoms and ghosts: sums of stress [energy], of volume and of factors, and how many they are; own ones, and with those around
  enum { VOLUME = std::tuple_size<Tensor>::value, FACTOR, COUNT, WIDTH };
  AtomValues own{WIDTH}, around{WIDTH};

  std::vector<Vector> forces_of_pairs;    // of own atoms, in a step with stresses

  void add_neighbors(const PairList &bonds, int nreact);
  void note_other_force(int i, const Vector &force);
  const Row &row_of(int i) const;
  double volume_of(int i) const;
  void demand_mass_of_solid(int type, double spacing) const;
};

}    // namespace EVP
