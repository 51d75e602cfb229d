/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef COMPUTE_CLASS
// clang-format off
ComputeStyle(evp/dt,ComputeEVPDt);
// clang-format on
#else

#ifndef LMP_COMPUTE_EVP_DT_H
#define LMP_COMPUTE_EVP_DT_H

#include "compute.h"

#include <vector>

namespace LAMMPS_NS {

/// Largest stable steps of the network of pairs that interact now, its atoms outside the group held.
class ComputeEVPDt : public Compute {
 public:
  ComputeEVPDt(class LAMMPS *, int, char **);
  ~ComputeEVPDt() override;

  void init() override;
  void setup() override;
  double compute_scalar() override;
  void compute_vector() override;
  double memory_usage() override;

  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;

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

  class PairEVPLJ *pair;
  std::vector<Link> links;
  std::vector<double> nodal;    // three values per atom and ghost, exchanged
  std::vector<double> result;
  bigint computed_step;     // of what vector holds, -1 if it must not be used again
  bool warned;              // of the step, in this run
  bool unsettled_warned;    // of an eigenvalue, in this run

  bool all_implicit() const;
  bool is_free(int i) const;
  double inverse_mass(int i) const;
  void collect_links();
  double largest_eigenvalue(const Mix &);
  void apply(const Mix &, const std::vector<double> &, std::vector<double> &);
  double explicit_step(double lambda_k, double lambda_c);
  double implicit_step(double lambda_axial, double lambda_across) const;
  double paper_step() const;
  double row_sum_step();
  void sum_to_owners(std::vector<double> &);
};

}    // namespace LAMMPS_NS

#endif
#endif
