// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "compute.h"
#include "lammps/base/per_atom.h"
#include "lammps/timestep/stable_timesteps.h"

namespace LAMMPS_NS {

/// Largest stable timesteps of the pairs that interact now. Atoms outside the group are held.
class ComputeEVPDt : public EVP::WithPerAtomComm<Compute> {
 public:
  ComputeEVPDt(class LAMMPS *, int, char **);
  ~ComputeEVPDt() override { delete[] vector; }

  void init() override;
  double compute_scalar() override;
  void compute_vector() override;
  double memory_usage() override { return limits.memory_usage(); }

 private:
  EVP::StableTimesteps limits;
  bigint linearised_step = -1;    // -1 if it must not be used again
  bool lanczos_warned = false;    // of an eigenvalue, in this run

  void linearise();
  void warn_of_eigenvalues();
};

}    // namespace LAMMPS_NS
