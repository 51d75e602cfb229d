// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/energy_balance.h"
#include "pair_data.h"
#include "per_atom.h"
#include "step_work.h"

#include <memory>

namespace EVP {

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
/// What pairs hold, and their forces, the pair style's force loop leaves in `work`.
class FixEVPEnergy : public EVP::AtomRecords<EVP::WithPerAtomComm<Fix>, EVP::AtomPast> {
 public:
  FixEVPEnergy(class LAMMPS *, int, char **);

  int setmask() override
  {
    using namespace FixConst;
    return POST_INTEGRATE | PRE_EXCHANGE | PRE_NEIGHBOR | END_OF_STEP;
  }
  void init() override;
  void setup(int) override;
  void post_integrate() override;
  void pre_exchange() override;
  void setup_pre_neighbor() override { note_images(); }
  void pre_neighbor() override;
  void end_of_step() override;

  double compute_scalar() override;
  double compute_vector(int n) override { return entries[n]; }
  double memory_usage() override { return AtomRecords::memory_usage() + work->memory_usage(); }
  void set_arrays(int) override;

  /// "work": std::shared_ptr<EVP::PairWork>, for the pair style.
  void *extract(const char *name, int &dim) override
  {
    dim = 0;
    return strcmp(name, "work") == 0 ? &work : nullptr;
  }

 private:
  enum Entry {
    KINETIC,
    FIRST,
    SECOND,
    LOST,
    CONTACTS,
    DISSIPATED,
    PRESCRIBED,
    OTHERS,
    PLASTIC,
    HARDENING,
    BROKEN,
    VOLUME,
    BOX,
    NENTRIES
  };

  /// What atoms and pairs hold at one instant [energy].
  struct Instant {
    double kinetic, volume;
    EVP::PairWork::Sums pairs;
  };

  /// What happens in a step [energy].
  struct Works {
    double dissipated, prescribed, others, box;
  };

  /// Of an MPI rank, then of all.
  struct Totals {
    Instant instant;
    Works works;
  };

  EVP::PairData *pair_data = nullptr;
  class FixEVPBonds *bonds = nullptr;           // if there is one
  const class FixNVEEVP *implicit = nullptr;    // if there is one
  int integrated_groupbits = 0;                 // groups of the fixes that move atoms by forces
  bool started = false;
  double dt_step = 0.0;    // of the step under way: at its end another fix may have changed it
  Instant start{}, last{};
  double dissipated_at_begin = 0.0;    // of the step under way, on this MPI rank

  double taken = 0.0;    // by damping; DISSIPATED is the most that it was so far
  double entries[NENTRIES] = {};
  std::shared_ptr<EVP::PairWork> work = std::make_shared<EVP::PairWork>();
  EVP::BoxWork box{*work};

  bool is_integrated(int i) const { return atom->mask[i] & integrated_groupbits; }
  template <class F> void with_forces(F &&f) const;
  bool is_solved() const;
  bool others_act() const;
  void take_work(bool at_setup);
  Instant instant_here() const;
  double kinetic_here() const;
  double damping_of_box() const;
  void note_images();
  Totals over_all_ranks(Totals totals) const;
  Works works_of_step();
  void unwrap(int i, double *x) const;
  void end_instant();
};

}    // namespace LAMMPS_NS
