// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_FIX_EVP_ENERGY_H
#define LMP_FIX_EVP_ENERGY_H

#include "atom_records.h"
#include "core/stored_energy.h"
#include "nodal_exchange.h"

namespace EVP {

/// What acts on an atom at an end of a step [force].
struct AtomForces {
  double working[3];    ///< on a mover the forces of pairs; else all forces but those
  double damping[3];    ///< explicit one, which is in neither
};

/// An atom at the beginning of a step.
struct AtomPast {
  double x[3];    ///< unwrapped
  AtomForces forces;
};

}    // namespace EVP

namespace LAMMPS_NS {

/// The energy balance: where the work that is put into a body goes, from its definition on.
///
/// Exact for the leapfrog but for the trapezoid of the pair forces. Each step is taken from its own half
/// kicks, with its own dt and the damping that was applied in it, whichever fix changed them before.
class FixEVPEnergy : public AtomRecords<NodalExchange<Fix>, EVP::AtomPast> {
 public:
  FixEVPEnergy(class LAMMPS *, int, char **);

  int setmask() override { return FixConst::POST_INTEGRATE | FixConst::END_OF_STEP; }
  void init() override;
  void setup(int) override;
  void post_integrate() override;
  void end_of_step() override;

  double compute_scalar() override;
  double compute_vector(int n) override { return entries[n]; }
  double memory_usage() override { return AtomRecords::memory_usage() + pair_work.memory_usage(); }
  void set_arrays(int) override;

 private:
  enum Entry { KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED, MOVERS, OTHERS, NENTRIES };

  /// What atoms and pairs hold at one instant, over all MPI ranks [energy].
  struct Instant {
    double kinetic;
    EVP::StoredEnergy::Sums pairs;
  };

  class PairNetwork *network = nullptr;
  const class FixNVEEVP *implicit = nullptr;    // if there is one
  int driven_groupbits = 0;                     // groups of the fixes that move atoms by forces
  bool started = false;
  double dt_step = 0.0;    // of the step under way: at its end another fix may have changed it
  Instant start{}, last{};
  double dissipated_at_begin = 0.0;    // of the step under way, on this MPI rank
  double taken = 0.0;                  // by damping; DISSIPATED is the most that it was so far
  double entries[NENTRIES] = {};
  EVP::PairWork pair_work;

  bool is_driven(int i) const { return atom->mask[i] & driven_groupbits; }
  double half_kick(int i) const;
  bool is_solved() const;
  EVP::AtomForces forces_on(int i) const;
  double dissipated_in_half_step(bool at_begin) const;
  void evaluate(bool at_setup);
  void end_instant();
  void advance();
};

}    // namespace LAMMPS_NS

#endif
