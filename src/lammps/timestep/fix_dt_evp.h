// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"
#include "fix.h"
#include "lammps/base/per_atom.h"
#include "lammps/pairs/pair_data.h"
#include "lammps/timestep/stable_timesteps.h"
#include "update.h"

#include <array>

namespace LAMMPS_NS {

/// Keeps dt at a fraction of the largest stable timestep, and short enough that no pair rotates by much that fix
/// nve/evp damps, and, where the user asks for it, that none passes its threshold strain unresolved.
class FixDtEVP : public EVP::WithPerAtomComm<Fix> {
 public:
  FixDtEVP(class LAMMPS *, int, char **);

  int setmask() override { return FixConst::PRE_REVERSE | FixConst::END_OF_STEP; }
  void init() override;
  void setup_pre_reverse(int, int) override    // before fix nve/evp solves by that timestep
  {
    if (update->whichflag == 1) set_dt(true);
  }
  void end_of_step() override { set_dt(false); }

  // f_ID: dt. f_ID[1..5]: largest stable dt, dt that resolves the motion of all pairs, what limits dt
  // (1 stability, 2 displacement, 3 max, 4 growth, 5 rotation), IDs of the fastest pair
  double compute_scalar() override { return update->dt; }
  double compute_vector(int n) override
  {
    const FastestPair &fastest = by_rotation.dt < by_displacement.dt ? by_rotation
                                                                     : by_displacement;
    return std::array{stable_dt, fastest.dt, (double) limit, fastest.id_i, fastest.id_j}[n];
  }
  double memory_usage() override { return EVP::bytes_of(velocity) + limits.memory_usage(); }

 private:
  /// What limits dt; the numbers are those of f_ID[3].
  enum Limit { NOTHING, STABILITY, DISPLACEMENT, MAXIMUM, GROWTH, ROTATION };

  /// The pair whose relative velocity allows the smallest timestep.
  struct FastestPair {
    double dt;
    double id_i, id_j;
  };

  static constexpr double NO_LIMIT = EVP::StableTimesteps::NO_LIMIT;

  double fraction = 0.0;             // of the stable timestep
  double maximum = NO_LIMIT;         // of dt [time]
  double displacement = NO_LIMIT;    // of a pair along its axis in a step, over xi_s deq
  EVP::PairData *pair_data = nullptr;
  EVP::StableTimesteps limits;

  EVP::AtomValues velocity{3};    // with ghosts
  double stable_dt = NO_LIMIT;
  // row sums bound the largest stable timestep from below: the ratio to this bound, and the bound, when last by eigenvalues
  double last_ratio = 0.0, last_bound = 0.0;
  FastestPair by_displacement = {NO_LIMIT, 0.0, 0.0};    // along its axis
  FastestPair by_rotation = by_displacement;             // across it
  Limit limit = NOTHING;
  bool displacement_warned = false, rotation_warned = false;

  bool is_resolved() const { return displacement < NO_LIMIT; }
  double find_stable_dt();
  void set_dt(bool at_setup);
  void report_limit(double dt);
  void warn_of_displacement(double dt);
  bool find_fastest(double dt);
  void change_dt(double dt);
};

}    // namespace LAMMPS_NS
