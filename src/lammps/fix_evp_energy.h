/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef FIX_CLASS
// clang-format off
FixStyle(evp/energy,FixEVPEnergy);
// clang-format on
#else

#ifndef LMP_FIX_EVP_ENERGY_H
#define LMP_FIX_EVP_ENERGY_H

#include "core/stored_energy.h"
#include "fix.h"
#include "nodal_exchange.h"

#include <array>
#include <vector>

namespace LAMMPS_NS {

/// The energy balance: where the work that is put into a body goes, from its definition on.
///
/// Exact for the leapfrog but for the trapezoid of the pair forces. Each step is taken from its own half
/// kicks, with its own dt and the damping that was applied in it, whichever fix changed them before.
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
  enum Entry { KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED, MOVERS, OTHERS, NENTRIES };

  /// What atoms and pairs hold at one instant, over all MPI ranks [energy].
  struct Instant {
    double kinetic;
    EVP::StoredEnergy::Sums pairs;
  };

  /// An atom at the beginning of a step: where it was and what acted on it.
  struct Past {
    double x[3];          ///< unwrapped
    double working[3];    ///< see working_force()
    double damping[3];    ///< explicit one
  };
  static constexpr int PAST_SIZE = 9;

  class PairNetwork *pair;
  const class FixNVEEVP *implicit;    // nullptr without
  int driven_groupbits;               // groups of the fixes that move atoms by forces
  bool started;
  double dt_step;    // of the step under way: at its end another fix may have changed it
  Instant start, last;
  double dissipated_at_begin;    // of the step under way, on this MPI rank
  double taken;                  // by damping; DISSIPATED is the most that it was so far
  std::array<double, NENTRIES> ledger;
  double **past;    // a Past per local atom

  Nodal velocities;                   // with ghosts: those that explicit damping saw
  Nodal pair_force, damping_force;    // with ghosts: of the pairs, explicit damping apart

  EVP::StoredEnergy stored;

  bool is_driven(int i) const;
  double half_kick(int i) const;
  bool is_solved() const;
  double solved_damping(int i, int c) const;
  double working_force(int i, int c) const;
  double dissipated_in_half_step(bool at_begin) const;
  void evaluate(bool at_setup);
  void find_depths(const EVP::PairList &);
  void find_largest_depth();
  void remember_places();
  void remember_forces();
  void advance();
  void update_states();
};

}    // namespace LAMMPS_NS

#endif
#endif
