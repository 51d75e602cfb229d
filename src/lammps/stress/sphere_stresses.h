// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/pairs/pairs.h"
#include "core/stress/stress.h"
#include "core/stress/stress_sums.h"
#include "lammps/pairs/effect.h"

#include <vector>

namespace EVP {

/// What is known of an own atom after the first forces that follow an update.
struct SphereStress {
  Tensor own, mean;    ///< of its pairs; the mean over it and those that it is bonded to [pressure]
  Vector force;        ///< of all its pairs
  double volume;    ///< of the solid; 0 where the row has no density: then the stresses are 0, too
  const double *means;    ///< over the same spheres, of the values that this reader put
};

/// An effect that needs the stresses of spheres.
class StressReader {
 public:
  /// Number of further values of a sphere, of which the reader gets the mean over the sphere and those that it is bonded to.
  virtual int averaged_width() const { return 0; }
  /// Writes those of own atom i.
  virtual void put_averaged(int /*i*/, double * /*values*/) const {}

  /// Before the first call of stress_known(), which follows for each own atom in turn.
  virtual void stresses_begin() {}
  virtual void stress_known(int i, const SphereStress &) = 0;

 protected:
  ~StressReader() = default;
};

/// Stresses of atoms and ghosts by the forces at the present positions, without damping: effects have them as of the last forces. Nothing
/// is changed.
void find_stresses_now(PairData &, StressSums &);

/// The stresses of spheres by the forces after an update, for the effects that read them, which stand before it in effects.cpp.
/// Without one it does not act.
class SphereStresses final : public Effect, protected Pointers {
 public:
  SphereStresses(LAMMPS *lmp, PairData &pair_data) : Pointers(lmp), pairs(pair_data) {}

  void rows_scaled(const Coefficients &) override;
  bool begin_run(PairData &) override { return !find_readers().empty(); }
  void keep_values(BondStore &) override;
  void update_effect() override;
  void before_forces(const ParticleView &) override;
  PairConsumer *reads_forces(const PairList &) override { return measures ? &stresses : nullptr; }
  void after_forces(const ParticleView &) override;

 private:
  PairData &pairs;
  std::vector<double> densities;    // by atom type, from 1; 0 of rows without
  bool measures = false;            // by the next forces
  StressSums stresses;

  // Columns: sum of stress [energy], volume, number of spheres, values of readers. own: of each atom and ghost; around: sums over it and
  // those that it is bonded to
  enum { VOLUME = StressSums::NSTRESS, COUNT, READERS };
  AtomValues own{READERS}, around{READERS};

  std::vector<StressReader *> find_readers() const;
};

}    // namespace EVP
