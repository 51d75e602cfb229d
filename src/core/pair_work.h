// SPDX-License-Identifier: GPL-2.0-only
//
// What all pairs hold and exert at one instant.
// Pure C++17.

#ifndef EVP_CORE_PAIR_WORK_H
#define EVP_CORE_PAIR_WORK_H

#include "core/force_loop.h"
#include "core/stored_energy.h"

#include <cmath>
#include <vector>

namespace EVP {

/// The pairs of one rank in the energy balance: the sums of what they store, and the forces from which
/// works and dissipation follow.
struct PairWork {
  StoredEnergy stored;
  /// On particles and ghosts, three values each [force]: of the law, and of the explicit damping that
  /// the laws have.
  std::vector<double> force, damping;

  /// Fills force and damping, ghosts hold reactions; returns the sums of this rank. Requires
  /// stored.assign(). view.f is not used. law_of(pair): its Law.
  ///
  /// All that this reads of a pair is at hand in a block of the force loop too: a tally of that loop
  /// can take its place.
  template <class LawOf>
  StoredEnergy::Sums evaluate(const PairList &list, const ParticleView &view, LawOf &&law_of)
  {
    force.assign((size_t) 3 * list.nall, 0.0);
    damping.assign((size_t) 3 * list.nall, 0.0);
    StoredEnergy::Sums sums{};
    for_each_pair(list, view.x, [&](const PlacedPair &p) {
      if (p.is_beyond()) return;
      const bool reacts = p.j < view.nreact;
      const double d = p.distance();
      const Law &law = law_of(p);
      // without newton both owners of a pair across MPI ranks hold it
      stored.add(sums, p.index, p, law, d, reacts ? 1.0 : 0.5);

      const auto add = [&](std::vector<double> &forces, double over_d) {
        const double f[3] = {over_d * p.g.dx, over_d * p.g.dy, over_d * p.g.dz};
        for (int c = 0; c < 3; c++) {
          forces[(size_t) 3 * p.i + c] += f[c];
          if (reacts) forces[(size_t) 3 * p.j + c] -= f[c];
        }
      };
      add(force, law.force(d, stored.deq_of(p.index)) / d);
      const double gamma = law.parameters().gamma;
      if (gamma > 0.0) add(damping, damping_over_distance(gamma, p.g, view.v[p.i], view.v[p.j]));
    });
    return sums;
  }

  double memory_usage() const
  {
    return stored.memory_usage() +
        (double) (force.capacity() + damping.capacity()) * sizeof(double);
  }
};

}    // namespace EVP

#endif
