/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef FIX_CLASS
// clang-format off
FixStyle(evp/energy,FixEVPEnergy);
// clang-format on
#else

#ifndef LMP_FIX_EVP_ENERGY_H
#define LMP_FIX_EVP_ENERGY_H

#include "fix.h"
#include "nodal_exchange.h"

#include <array>
#include <vector>

namespace LAMMPS_NS {

/// The energy ledger: where the work that is put into a body goes, from its definition on.
///
/// Exact for the leapfrog but for the trapezoid of the pair forces: kinetic energy as the mean of
/// the two half steps, work as the mean force at both ends times the displacement, dissipation as
/// the damping force times the mean velocity.
class FixEVPEnergy : public NodalExchange<Fix> {
 public:
  FixEVPEnergy(class LAMMPS *, int, char **);
  ~FixEVPEnergy() override;

  int setmask() override;
  void init() override;
  void setup(int) override;
  void post_integrate() override;
  void end_of_step() override;

  double compute_scalar() override;
  double compute_vector(int) override;

  double memory_usage() override;
  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;

 private:
  static constexpr int VELOCITIES = 6;    // per atom: of both velocities that pairs ask for
  enum Entry { KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED, MOVERS, OTHERS, NENTRIES };

  /// What the pairs hold and do at one instant, over all processes.
  struct Instant {
    double kinetic, first, second, depth, contacts;    ///< [energy]
    double dissipation;                                ///< [energy/time]
  };

  /// An atom at the last step: where it was and what acted on it.
  struct Past {
    double x[3];         ///< unwrapped
    double pairs[3];     ///< force of the pairs, damping included
    double others[3];    ///< all other force
  };
  static constexpr int PAST_SIZE = 9;

  class PairEVPLJ *pair;
  const class FixNVEEVP *implicit;    // nullptr without
  int driven_groupbits;               // groups of the fixes that move atoms by forces
  bool started;
  double depth_at_start;
  double dt_step;    // of the step under way: at its end another fix may have changed it
  Instant start, last;
  std::array<double, NENTRIES> ledger;
  double **past;    // a Past per local atom

  Nodal velocities;    // with ghosts, six each: at the step, and half a step before it
  Nodal pair_force;    // with ghosts

  bool is_driven(int i) const;
  double half_kick(int i) const;
  void find_velocities(bool at_setup);
  Instant evaluate();
  void advance(const Instant &now, double dt);
  void remember();
};

}    // namespace LAMMPS_NS

#endif
#endif
