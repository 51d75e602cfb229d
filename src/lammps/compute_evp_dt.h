// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "compute.h"
#include "core/linear_network.h"
#include "nodal_exchange.h"
#include "pair_network.h"

#include <vector>

namespace LAMMPS_NS {

/// Largest stable timesteps of the network of pairs that interact now, its atoms outside the group
/// held.
class ComputeEVPDt : public EVP::NodalExchange<Compute> {
 public:
  static constexpr double NO_LIMIT = 1.0e20;    ///< nothing interacts: any timestep is stable

  ComputeEVPDt(class LAMMPS *, int, char **);
  ~ComputeEVPDt() override { delete[] vector; }

  void init() override;
  void setup() override;
  double compute_scalar() override;
  void compute_vector() override;
  double memory_usage() override { return linear.memory_usage(); }

  /// Collective, in a run. Warns once if the timestep is above the limit.
  void warn_of_timestep();

 private:
  EVP::LinearNetwork linear;
  std::vector<double>
      above_volume;               // axial stiffness that is not below the volume energy's, by link
  double paper_dt = NO_LIMIT;     // eqs. 6 and 7
  bigint computed_step = -1;      // of what vector holds, -1 if it must not be used again
  bool limit_warned = false;      // in this run: of dt
  bool lanczos_warned = false;    // of an eigenvalue

  bool all_implicit() const;
  void linearise();
  void take_atoms(const EVP::VolumeForces *);
  std::vector<double> take_pairs(const EVP::PairNetwork *);
  double largest_eigenvalue(const EVP::LinearNetwork::Mix &);
  double explicit_dt(double lambda_k, double lambda_c);
  double implicit_dt(double lambda_axial, double lambda_across) const;
  double row_sum_dt() const;
};

}    // namespace LAMMPS_NS
