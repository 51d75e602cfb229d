// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/yield/yield.h"
#include "lammps/stress/sphere_stresses.h"

#include <vector>

namespace EVP {

/// Spheres flow at the flow stress of their row ('yield' of a row, with plasticity): see yielding.
class YieldCondition final : public Effect, public StressReader, protected Pointers {
 public:
  YieldCondition(LAMMPS *lmp, PairData &pair_data) : Pointers(lmp), pairs(pair_data) {}

  void rows_scaled(const Coefficients &) override;
  bool begin_run(PairData &) override { return acts; }
  void keep_values(BondStore &) override;
  bool uses(double Row::*member) const override { return member == &Row::yield; }
  std::string describe() const override;

  void pairs_packed(const NeighList *) override;
  void begin_update() override;
  void multiply_hardening(std::vector<double> &shares) const override;
  void strains_updated(const BondStore &, bool have_flowed) override;
  void multiply_limits(std::vector<double> &factors) const override;

  StressReader *stress_reader() override { return this; }
  int averaged_width() const override { return 1; }
  void put_averaged(int i, double *values) const override { *values = records[i].factor; }
  void stresses_begin() override { of_pairs.clear(); }
  void stress_known(int i, const SphereStress &) override;
  void committed() override;

 private:
  PairData &pairs;
  SphereRecords<YieldRecord> records;
  std::vector<Row> rows;    // by atom type, from 1; of those without the condition yield is 0
  bool acts = false, masses_checked = false;
  std::vector<double> strains;          // plastic, of own atoms before the update
  std::vector<double> flow_stresses;    // of own atoms at these; 0 without the condition

  struct OfPairs {
    Vector force;
    double volume;
  };
  std::vector<OfPairs> of_pairs;    // of own atoms, in a step with stresses

  void note_other_force(int i, const Vector &force, double volume);
  const Row &row_of(int i) const;
  void demand_mass_of_solid(int type, double spacing) const;
};

}    // namespace EVP
