// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/joining/joining.h"
#include "lammps/stress/sphere_stresses.h"

#include <string>
#include <vector>

namespace EVP {

/// A criterion by which two bodies join ('contact join all exposure'): see joining.
class Joining final :
    public Effect,
    public StressReader,
    public JoiningCriterion,
    protected Pointers {
 public:
  Joining(LAMMPS *lmp, PairData &pair_data) : Pointers(lmp), pairs(pair_data) {}

  void rows_scaled(const Coefficients &) override;
  bool begin_run(PairData &) override;
  void keep_values(BondStore &) override;
  std::string describe() const override;

  void pairs_packed(const NeighList *) override;
  void begin_update() override;
  void strains_updated(const BondStore &, bool have_flowed) override;
  int shared_width(Sharing) const override { return asks_pressure() ? 1 + NSTRESS : 1; }
  void put_shared(Sharing, const ValuesOfAtoms &) const override;
  void set_shared(Sharing, const ValuesOfAtoms &) override;
  const JoiningCriterion *joining() const override { return this; }
  bool may_join(int i, int j, const Vector &r) const override;

  StressReader *stress_reader() override { return asks_pressure() ? this : nullptr; }
  void stresses_begin() override;
  void stress_known(int i, const SphereStress &) override;

 private:
  static constexpr int NSTRESS = StressSums::NSTRESS;

  PairData &pairs;
  SphereRecords<JoiningRecord> records;
  SphereRecords<RelativeStressRecord> stresses;
  std::vector<Row> rows;          // by atom type, from 1
  std::vector<double> strains;    // plastic, of own atoms as last seen
  std::vector<double> factors;    // of their limits
  BondStore::Place yield_factors;
  AtomValues shared{1};    // of atoms and ghosts: exposure, stress over flow stress
  bool acts = false;

  bool asks_pressure() const;
  void note_touched();
};

}    // namespace EVP
