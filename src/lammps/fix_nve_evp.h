/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef FIX_CLASS
// clang-format off
FixStyle(nve/evp,FixNVEEVP);
// clang-format on
#else

#ifndef LMP_FIX_NVE_EVP_H
#define LMP_FIX_NVE_EVP_H

#include "core/body_solves.h"
#include "core/force_loop.h"
#include "fix.h"
#include "mover_places.h"
#include "nodal_exchange.h"

#include <vector>

namespace LAMMPS_NS {

/// Leapfrog with the damping of pair style evp/lj taken at the end of the step:
/// (M + dt C) v+ = M v- + dt (F(x) - T), then x += dt v+.
///
/// Each damper sees the opening rate of the whole step, (|r + dt v+| - |r|)/dt = u.v+ + turning (see
/// opening.h): where a pair turns without strain, u.v+ along its old direction u is not zero. T holds
/// gamma times what turning adds, first that of the last step, then corrected until it is that of v+.
///
/// Between steps atoms hold v = (v- + v+)/2, and f holds F plus the damping force that took v- to v+,
/// so that both half kicks are those of plain leapfrog and other fixes read the whole force.
class FixNVEEVP : public NodalExchange<Fix> {
 public:
  FixNVEEVP(class LAMMPS *, int, char **);
  ~FixNVEEVP() override;

  int setmask() override;
  void init() override;
  void setup(int) override;
  void post_force(int) override;
  void min_setup(int) override;
  void min_post_force(int) override;
  void initial_integrate(int) override;
  void final_integrate() override;
  void post_run() override;

  /// Damping force that f holds now [force], three values per local atom; empty without damping.
  const std::vector<double> &applied_damping() const { return applied; }

  /// Power that the dampers of this MPI rank take [energy/time], in the mean over the half step before
  /// the present places, or after them; pairs that another rank holds too count by half. Known where a
  /// fix evp/energy is defined.
  double power_before() const;
  double power_after() const;

  double compute_scalar() override;
  double compute_vector(int) override;

  double memory_usage() override;
  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;

 private:
  /// A dashpot between the atom of its row and j.
  struct Damper {
    double w[3];    ///< sqrt(gamma) u, u the unit vector at the last force evaluation
    int j;
    int pair;    ///< index in the packed list
  };

  double tolerance;
  int max_iterations;
  int others_groupbits;    // groups of the other fixes that move atoms by forces
  bool forces_follow;      // fixes defined after this one add forces, at set-up after its solve

  class PairNetwork *pair;
  std::vector<Damper> dampers;
  std::vector<EVP::PackedRow> damper_rows;
  std::vector<double> damper_scale;    // sqrt(gamma)/d of each damper
  std::vector<double> rate_before;     // sqrt(gamma) times its opening rate over the last step
  std::vector<double> rate_now;        // and at the present places; both where balance_wanted
  bool balance_wanted;                 // a fix evp/energy asks for the power of the dampers
  double
      most_turned;    // square of half the largest angle of a pair per step, since the last build
  bool turning_warned;
  std::vector<double> last_turning;    // as rate_before, what turning added; by pair of the list
  std::vector<double> last_force;      // of the last solve, over w; by index in the packed list
  long last_build;
  EVP::NodeSets connected;    // atoms and ghosts
  EVP::Bodies bodies;
  EVP::BodySolves solves_of_bodies;
  Nodal lowest;    // label of the body (its lowest ID), first and minus last rank with atoms of it
  long bodies_build;
  Nodal applied;        // damping force that f holds, from one solve to the kick after it; or empty
  double dt_turning;    // step of last_turning
  double dt_applied;    // step that it was solved for, 0 if it must be solved anew
  int vflag_now;

  Nodal velocities, reaction;    // with ghosts
  Nodal mobility, inertia;       // ftm2v / mass and its inverse, zero for atoms outside the group
  EVP::MoverPlaces movers;       // wanted where a fix move may turn or accelerate atoms
  Nodal prescribed;              // velocities after the step of atoms outside the group
  Nodal undamped;                // v* = v + h M^-1 F
  Nodal velocity, change, residual, direction, direction_product;

  int last_iterations, most_iterations;
  bigint all_iterations, solves;

  bool in_group(int i) const;
  void collect_dampers();
  void find_rates(double dt);
  void find_mean_rates();
  void warn_of_turning();
  template <class F> double power(F &&mean_rate) const;
  void kick();
  void solve_and_apply(double h);
  void remove_applied();
  int solve(double h);
  void find_bodies();
  void spread_lowest();
  std::vector<double> bodies_across() const;
  void check_groups() const;
  void want_places();
  void exchange_velocities(const Nodal &of);
  void check_partners(int i, int j) const;
  template <class F> void damping_product(F &&rate);
  int iterate(double h, int iteration);
  EVP::BodySolves::State judge_residuals();
  bool turning_settled(double h);
  void add_rounding(double h);
  void warm_start(double h);
  void store_applied(double h);
  void tally_virial();
};

}    // namespace LAMMPS_NS

#endif
#endif
