/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef FIX_CLASS
// clang-format off
FixStyle(nve/evp,FixNVEEVP);
// clang-format on
#else

#ifndef LMP_FIX_NVE_EVP_H
#define LMP_FIX_NVE_EVP_H

#include "fix.h"

#include <vector>

namespace LAMMPS_NS {

/// Leapfrog with the damping of pair style evp/lj taken at the end of the step:
/// (M + dt C) v+ = M v- + dt F(x), then x += dt v+.
///
/// Between steps atoms hold v = (v- + v+)/2, and f holds F plus the damping force that took v- to v+,
/// so that both half kicks are those of plain leapfrog and other fixes read the whole force.
class FixNVEEVP : public Fix {
 public:
  FixNVEEVP(class LAMMPS *, int, char **);
  ~FixNVEEVP() override;

  int setmask() override;
  void init() override;
  void setup(int) override;
  void post_force(int) override;
  void initial_integrate(int) override;
  void final_integrate() override;

  /// Damping force that f holds now [force], [local atom][3]; all zero without implicit damping.
  const double *const *applied_damping() const { return applied; }

  double compute_scalar() override;
  double compute_vector(int) override;

  double memory_usage() override;
  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;

 private:
  /// A dashpot of strength gamma along u, the unit vector at the last force evaluation.
  struct Damper {
    int i, j;
    double u[3], gamma;
    double d;    ///< distance then, for the virial
  };
  using Nodal = std::vector<double>;    ///< three values per atom

  double tolerance;
  int max_iterations;
  int others_groupbits;    // groups of the other fixes that move atoms by forces

  class PairEVPLJ *pair;
  std::vector<Damper> dampers;
  double **applied;     // damping force that f holds, per local atom
  double dt_applied;    // step that it was solved for
  int vflag_now;

  Nodal exchanged, reaction;    // with ghosts
  Nodal mobility;               // ftm2v / mass, zero for atoms outside the group
  Nodal velocity, residual, direction, direction_product;

  int last_iterations, most_iterations;
  bigint all_iterations, solves;

  bool in_group(int i) const;
  double inverse_mass(int i) const;
  void collect_dampers();
  void kick();
  void solve_and_apply(double h);
  void remove_applied();
  int solve(double h);
  void exchange_velocities(const Nodal &of);
  void damping_product();
  void store_applied(double h);
  void tally_virial();
};

}    // namespace LAMMPS_NS

#endif
#endif
