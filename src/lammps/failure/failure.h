// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/failure/failure.h"
#include "lammps/stress/sphere_stresses.h"

#include <vector>

namespace EVP {

/// Ductile failure ('damage' and 'rupture' of a row, with plasticity): spheres fail by their plastic strain and their stress, lose
/// their limit, and part: see failing.
class Failure final :
    public Effect,
    public StressReader,
    public FailureCriterion,
    protected Pointers {
 public:
  Failure(LAMMPS *lmp, PairData &pair_data) : Pointers(lmp), pairs(pair_data) {}

  void rows_scaled(const Coefficients &) override;
  bool begin_run(PairData &) override { return acts; }
  void keep_values(BondStore &) override;
  bool uses(double Row::*member) const override;
  bool ends_bonds() const override { return true; }
  std::string describe() const override { return ", spheres fail by the damage of their row"; }

  void begin_update() override;
  void strains_updated(const BondStore &, bool have_flowed) override;
  bool weakens_bonds() const override { return true; }
  void multiply_limits_of_bonds(std::vector<double> &factors) const override;
  int shared_width(Sharing) const override { return 1; }
  void put_shared(Sharing, const ValuesOfAtoms &) const override;
  void set_shared(Sharing, const ValuesOfAtoms &) override;
  const FailureCriterion *failure() const override { return any_parted ? this : nullptr; }
  bool fails(int i, int j) const override { return parted[i] || parted[j]; }
  bool bars_joining(int i, int j) const override { return fails(i, j); }

  StressReader *stress_reader() override { return this; }
  int averaged_width() const override { return 1; }
  void put_averaged(int i, double *values) const override { *values = records[i].growth; }
  void stress_known(int i, const SphereStress &) override;

 private:
  PairData &pairs;
  SphereRecords<FailureRecord> records;
  std::vector<Row> rows;    // by atom type, from 1
  bool acts = false, any_parted = false, warned = false;
  std::vector<double> strains;    // plastic, of own atoms as last seen
  BondStore::Place rates;         // of plastic strains, where an effect keeps them [1/time]
  std::vector<char> parted;       // of atoms and ghosts

  const Row &row_of(int i) const;
  double thickness(int i) const;
  double heat_of(int i) const;
  bool has_failed(BondStore &) const;
  void begin(int i, double strain);
  void take_given(const BondStore &);
  void warn();
};

}    // namespace EVP
