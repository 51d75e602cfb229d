// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/damping/dampers.h"
#include "lammps/base/per_atom.h"
#include "lammps/damping/damping_solver.h"
#include "lammps/pairs/effect.h"
#include "lammps/pairs/pair_data.h"

#include "domain.h"

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/// Leapfrog with the damping of pair style evp/lj taken at the end of the step:
/// (M + dt C) v+ = M v- + dt (F(x) - T), then x += dt v+.
///
/// Each damper sees the separation rate of the whole step, (|r + dt v+| - |r|)/dt = u.v+ + rotation (see
/// EVP::separation_rate): where a pair rotates without strain, u.v+ along its old direction u is not zero.
///
/// Between steps atom->v is (v- + v+)/2, and atom->f is F plus the damping force that took v- to v+,
/// so that both half kicks are those of plain leapfrog and other fixes read the whole force.
/// The records are unwrapped positions at the last solve, where a fix move may turn or accelerate atoms.
class FixNVEEVP :
    public EVP::AtomRecords<EVP::WithPerAtomComm<Fix>, std::array<double, 3>>,
    public EVP::EffectOfFix,
    public EVP::SolvedDamping {
 public:
  FixNVEEVP(class LAMMPS *, int, char **);
  ~FixNVEEVP() override { atom->delete_callback(id, Atom::GROW); }

  int setmask() override
  {
    using namespace FixConst;
    return INITIAL_INTEGRATE | FINAL_INTEGRATE | POST_FORCE | MIN_POST_FORCE | POST_RUN;
  }
  void init() override;
  void setup(int) override;
  void post_force(int vflag) override { vflag_now = vflag; }
  void initial_integrate(int) override;
  void final_integrate() override;
  void post_run() override { warn_of_rotation(); }

  // no damping acts in a minimization: the virial of the last run must not stay in its pressure
  void min_setup(int vflag) override { v_init(vflag); }
  void min_post_force(int vflag) override { v_init(vflag); }

  // see EVP::Effect and EVP::SolvedDamping; powers are known where an effect asks for them

  int damped_groupbits() const override { return groupbit; }
  bool updates_each_step() const override { return true; }
  std::string describe() const override { return " by fix nve/evp"; }
  const EVP::SolvedDamping *solved_damping() const override { return this; }
  const EVP::AtomValues &applied_damping() const override { return applied; }
  double power_before() const override { return dampers.power(false); }
  double power_after() const override { return dampers.power(true); }
  double power_of_box() const override;

  // f_ID: iterations of the last solve; f_ID[1], f_ID[2]: their mean and maximum in this run
  double compute_scalar() override { return last_iterations; }
  double compute_vector(int n) override
  {
    if (n == 1) return most_iterations;
    return solves ? (double) all_iterations / solves : 0.0;
  }

  double memory_usage() override
  {
    return dampers.memory_usage() + solver.memory_usage() + AtomRecords::memory_usage() +
        EVP::bytes_of(velocities, image_velocities, prescribed, applied);
  }
  void set_arrays(int i) override
  {
    if (keeps_records()) domain->unmap(atom->x[i], atom->image[i], records[i].data());
  }

 private:
  EVP::PairData *pair_data = nullptr;
  int others_groupbits = 0;    // groups of the other fixes that move atoms by forces
  std::vector<std::pair<const Fix *, std::string>> null_moves;    // of style move; components NULL
  bool forces_follow = false;    // fixes defined later add forces, at set-up after its solve
  bool powers_wanted = false;    // an effect asks for those of the dampers
  bool rotation_warned = false;
  bool positions_known = false;    // the records are those of the last solve

  EVP::Dampers dampers;
  EVP::DampingSolver solver;
  EVP::AtomValues velocities{
      3};    // with ghosts: mean ones over the last step; where powers_wanted
  EVP::AtomValues image_velocities{3};    // of periodic images against their owners; likewise
  EVP::AtomValues prescribed{3};          // velocities after the step, used outside the group
  EVP::AtomValues applied{
      3};                     // damping force in f, from one solve to the kick after it; or empty
  double dt_applied = 0.0;    // timestep that it was solved for, 0 if it must be solved anew
  int vflag_now = 0;

  int last_iterations = 0, most_iterations = 0;
  bigint all_iterations = 0, solves = 0;

  bool in_group(int i) const { return atom->mask[i] & groupbit; }
  void check_groups() const;
  void find_null_moves();
  void stop_at_integrated(int i) const;
  void collect_dampers();
  void find_rates(double dt);
  void remember_positions();
  template <class F> void for_each_mean_velocity(double dt, F &&f) const;
  void warn_of_rotation();
  void kick(bool after);
  void solve_and_apply(double h);
  void tally_virial();
};

}    // namespace LAMMPS_NS
