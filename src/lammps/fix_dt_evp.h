/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef FIX_CLASS
// clang-format off
FixStyle(dt/evp,FixDtEVP);
// clang-format on
#else

#ifndef LMP_FIX_DT_EVP_H
#define LMP_FIX_DT_EVP_H

#include "fix.h"
#include "nodal_exchange.h"

#include <string>

namespace LAMMPS_NS {

/// Keeps the step at a fraction of the largest stable one, and short enough that no pair is carried
/// through its threshold strain unresolved, and that none turns by much that fix nve/evp damps.
class FixDtEVP : public NodalExchange<Fix> {
 public:
  FixDtEVP(class LAMMPS *, int, char **);
  ~FixDtEVP() override;

  int setmask() override;
  void post_constructor() override;
  void init() override;
  void setup(int) override;
  void end_of_step() override;

  double compute_scalar() override;
  double compute_vector(int) override;
  double memory_usage() override;

 private:
  enum Ruler { NOTHING, STABILITY, SPEED, MAXIMUM, GROWTH, TURNING };

  /// The pair whose relative speed allows the smallest step.
  struct FastestPair {
    double dt;
    double id_i, id_j;
    double turns;    ///< 1 if it turns too fast, 0 if it opens or closes too fast
  };

  double fraction;    // of the stable step
  double maximum;     // of the step [time]
  std::string compute_id;
  class ComputeEVPDt *compute;
  class PairNetwork *pair;

  Nodal velocity;    // with ghosts
  double stable_step;
  FastestPair fastest;
  Ruler ruler;
  bool speed_reported;

  void set_step(bool may_jump);
  FastestPair find_fastest(double dt);
  bool may_meet() const;
  void change_step(double dt);
};

}    // namespace LAMMPS_NS

#endif
#endif
