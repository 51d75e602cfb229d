// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps/base/keeps_values.h"
#include "lammps/base/per_atom.h"
#include "lammps/volume/volume_forces.h"

#include <array>
#include <memory>
#include <vector>

namespace LAMMPS_NS {

/// An energy of the volume strain of each atom, by the density of its neighbors. Its forces are in those of the pair style,
/// its energy is here; what atoms keep for it is with the records of fix evp/bonds.
class FixEVPVolume :
    public EVP::WithPerAtomComm<Fix>,
    public EVP::KeepsValues,
    public EVP::Shares<EVP::VolumeForces> {
 public:
  FixEVPVolume(class LAMMPS *, int, char **);
  ~FixEVPVolume() override { atom->delete_callback(id, Atom::GROW); }

  int setmask() override { return FixConst::POST_FORCE | FixConst::MIN_POST_FORCE; }
  void init() override;
  void setup(int vflag) override { post_force(vflag); }
  void min_setup(int vflag) override { post_force(vflag); }
  void post_force(int) override;
  void min_post_force(int vflag) override { post_force(vflag); }

  // f_ID: energy. f_ID[1..4]: mean, lowest and highest volume strain of the atoms of the group that
  // have bonds, and how many of these are beyond cavitation. Per atom: volume strain
  double compute_scalar() override { return EVP::reduce_all(forces->energy(), MPI_SUM, world); }
  double compute_vector(int) override;

  std::shared_ptr<EVP::VolumeForces> share() const override { return forces; }

  /// Those that there are stay while the fix has nothing to do.
  void keep_values(EVP::BondStore &store) override
  {
    store.keep<EVP::VolumeRecord>(forces->acts() || store.has<EVP::VolumeRecord>());
  }

  double memory_usage() override { return forces->memory_usage() + EVP::bytes_of(shown); }
  void grow_arrays(int) override;
  void set_arrays(int i) override { shown[i] = 0.0; }
  void copy_arrays(int i, int j, int /*delflag*/) override { shown[j] = shown[i]; }

 private:
  std::shared_ptr<EVP::VolumeForces> forces;
  std::vector<double> shown;          // strains of atoms, for those who read f_ID
  std::array<double, 4> strains{};    // f_ID[1..4], as of the last evaluation
  bigint strains_step = -1;           // step of that, -1 if it must not be used again
};

}    // namespace LAMMPS_NS
