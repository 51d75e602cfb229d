// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/coefficients.h"
#include "core/pair_list.h"
#include "core/pair_rules.h"
#include "core/single_particles.h"
#include "ghost_sums.h"
#include "lammps_names.h"

#include <vector>

namespace EVP {

/// Warns of a timestep that is unstable for certain, which nothing else does where neither compute evp/dt nor fix dt/evp
/// is defined. Only atoms that follow the forces on them count.
class TimestepCheck : protected Pointers {
 public:
  TimestepCheck(LAMMPS *lmp, const PairList &list_in, const Coefficients &coefficients_in,
                const PairRules &rules_in, GhostSums &sums_in) :
      Pointers(lmp),
      list(list_in), coefficients(coefficients_in), rules(rules_in), sums(sums_in)
  {
  }

  /// Collective, at the set-up of a run, with the packed pairs at the present positions. damped: does any pair have
  /// a damping, of its own or by fix nve/evp?
  void warn(bool damped);

 private:
  const PairList &list;
  const Coefficients &coefficients;
  const PairRules &rules;
  GhostSums &sums;

  bool may_be_unstable(const std::vector<double> &inverse_mass);
  SingleParticles linearise(bool damped) const;
};

}    // namespace EVP
