// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_FIX_DT_EVP_H
#define LMP_FIX_DT_EVP_H

#include "fix.h"
#include "nodal_exchange.h"

#include <string>

namespace LAMMPS_NS {

/// Keeps dt at a fraction of the largest stable timestep, and short enough that no pair is carried
/// through its threshold strain unresolved, and that none turns by much that fix nve/evp damps.
class FixDtEVP : public NodalExchange<Fix> {
 public:
  FixDtEVP(class LAMMPS *, int, char **);
  ~FixDtEVP() override;

  int setmask() override { return FixConst::END_OF_STEP; }
  void post_constructor() override;
  void init() override;
  void setup(int) override;
  void end_of_step() override { set_dt(false); }

  double compute_scalar() override;
  double compute_vector(int) override;
  double memory_usage() override { return (double) (velocity.capacity() * sizeof(double)); }

 private:
  /// What limits dt; the numbers are those of f_ID[3].
  enum Limit { NOTHING, STABILITY, SPEED, MAXIMUM, GROWTH, TURNING };

  /// The pair whose relative velocity allows the smallest timestep.
  struct FastestPair {
    double dt;
    double id_i, id_j;
    double turns;    ///< 1 if it turns too fast, 0 if it opens or closes too fast
  };

  double fraction;    // of the stable timestep
  double maximum;     // of dt [time]
  std::string compute_id;
  class ComputeEVPDt *compute;
  class PairNetwork *pair;

  Nodal velocity;    // with ghosts
  double stable_dt;
  FastestPair fastest;
  Limit limit;
  bool speed_reported;

  void set_dt(bool at_setup);
  bool find_fastest(double dt);
  void change_dt(double dt);
};

}    // namespace LAMMPS_NS

#endif
