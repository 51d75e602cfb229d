/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef COMPUTE_CLASS
// clang-format off
ComputeStyle(evp/dt,ComputeEVPDt);
// clang-format on
#else

#ifndef LMP_COMPUTE_EVP_DT_H
#define LMP_COMPUTE_EVP_DT_H

#include "compute.h"
#include "nodal_exchange.h"

#include <vector>

namespace LAMMPS_NS {

/// Largest stable steps of the network of pairs that interact now, its atoms outside the group held.
class ComputeEVPDt : public NodalExchange<Compute> {
 public:
  ComputeEVPDt(class LAMMPS *, int, char **);
  ~ComputeEVPDt() override;

  void init() override;
  void setup() override;
  double compute_scalar() override;
  void compute_vector() override;
  double memory_usage() override;

  /// Collective, in a run. Warns once if the step is above the limit.
  void warn_of_step();

 private:
  /// An interacting pair with at least one free atom, linearised: forces on i are
  /// -(axial u u^T + across (1 - u u^T)) (x_i - x_j) and -damping u u^T (v_i - v_j).
  struct Link {
    int i, j;
    double u[3];
    double axial, across;    // [force/length]
    double damping;          // [force/velocity]
  };

  /// Weights of axial stiffness, transverse stiffness and damping in an operator.
  struct Mix {
    double axial, across, damping;
  };

  static constexpr double NO_LIMIT = 1.0e20;     // nothing interacts: any step is stable
  static constexpr double TOLERANCE = 1.0e-4;    // of an eigenvalue; half of it in the step

  class PairNetwork *pair;
  std::vector<Link> links;
  Nodal motion, reaction;    // with ghosts
  bigint computed_step;      // of what vector holds, -1 if it must not be used again
  bool warned;               // of the step, in this run
  bool unsettled_warned;     // of an eigenvalue, in this run

  /// Positive root of dt^2 a + 2 dt b = 4 (velocity Verlet with damping at half-step velocities).
  static double root_of(double a, double b);

  bool all_implicit() const;
  bool is_free(int i) const;
  void collect_links();
  double largest_eigenvalue(const Mix &);
  void apply(const Mix &, const std::vector<double> &, std::vector<double> &);
  double explicit_step(double lambda_k, double lambda_c);
  double implicit_step(double lambda_axial, double lambda_across) const;
  double paper_step() const;
  double row_sum_step();
};

}    // namespace LAMMPS_NS

#endif
#endif
