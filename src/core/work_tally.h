// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/stored_energy.h"

#include <algorithm>
#include <array>
#include <vector>

namespace EVP {

/// The pairs of one rank in the energy balance, as the force loop finds them: what they store, and the
/// forces from which works and dissipation follow. Forces are those of the evaluation itself, at the
/// velocities that it saw.
class PairWork {
 public:
  StoredEnergy stored;

  /// Three values per particle and ghost [force], on ghosts reactions: of the pairs, damping included,
  /// which is empty without `separates`; and of the damping of their laws alone, empty where none acts.
  std::vector<double> force, damping;

  /// Three counts per particle and ghost: by how many boxes it is away from its owner. Empty where the
  /// box does no work on images.
  std::vector<double> images;

  /// Sums over the pairs of components of the force on i [force] times the count of j: xx, yy, zz, yz, xz
  /// and xy, the force being named first. `whole` with the damping of laws, `damping` that alone.
  struct {
    std::array<double, 6> whole, damping;
  } through{};

  /// Is `force` wanted? Not where nothing else acts, and ParticleView::f will hold the same.
  bool separates = true;

  /// At the beginning of a run, whose pairs may be those of another pair style.
  void forget()
  {
    fresh = false;
    stored.forget();
  }

  /// Whether there was an evaluation since the last call. Until then the first one counts: others at
  /// the same step are of commands that try out positions or coefficients.
  bool take()
  {
    const bool found = fresh;
    fresh = false;
    return found;
  }

  /// accumulate_forces() and what this holds. rest_distances(): deq of each pair of the list.
  template <bool Damping, class Tally, class Distances, class... More>
  void accumulate_forces(const PairList &list, const BlockLaw &law, const ParticleView &view,
                         Tally &&tally, Distances &&rest_distances, const More &...more)
  {
    if (fresh) return EVP::accumulate_forces<Damping>(list, law, view, tally, more...);
    const bool flows = view.histories.flow.offset != nullptr;
    if (stored.is_due(list, flows))
      stored.assign(list, law, rest_distances(), view.nreact, flows, view.histories.beyond);
    begin(list, view, Damping);
    EVP::accumulate_forces<Damping>(list, law, view,
                                    WorkTally<Damping, Tally>{*this, list, view, tally}, more...);
    end(view);
  }

  double memory_usage() const { return stored.memory_usage() + bytes_of(force, damping, images); }

 private:
  bool fresh = false;

  /// Beside the tally of the pair style.
  template <bool Damping, class Tally> struct WorkTally {
    PairWork &work;
    const PairList &list;
    const ParticleView &view;
    Tally &other;
    const bool energy = other.energy;
    static constexpr bool scatters = Damping;

    void operator()(const PairRange &range, const Block &block)
    {
      other(range, block);
      const BlockEnergy::Values &values = work.stored.add(list, range, block, Damping);
      if (!work.images.empty()) {
        add_through(range, block, block.force, work.through.whole);
        if constexpr (Damping) add_through(range, block, values.damping, work.through.damping);
      }
      if constexpr (Damping)
        scatter<true>(list, view, range, block, values.damping, rows(work.damping));
    }

    void add_through(const PairRange &range, const Block &block, const double *force,
                     std::array<double, 6> &sums) const
    {
      for (int k = 0; k < block.n; k++) {
        const int j = list.pairs.j[range.first + k];
        const double *const n = &work.images[(size_t) 3 * j];
        if (n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0) continue;
        const double scale = rank_share(j, view.nreact) * force[k];
        const double x = scale * block.xy[2 * k], y = scale * block.xy[2 * k + 1];
        const double z = scale * block.z[k];
        const double terms[6] = {x * n[0], y * n[1], z * n[2], y * n[2], x * n[2], x * n[1]};
        for (int c = 0; c < 6; c++) sums[c] += terms[c];
      }
    }
  };

  static double (*rows(std::vector<double> &values))[3]
  {
    return reinterpret_cast<double(*)[3]>(values.data());
  }

  // other styles may have added to f: what the loop adds is the difference, and no bit of f is another
  void begin(const PairList &list, const ParticleView &view, bool damps)
  {
    force.resize(separates ? (size_t) 3 * list.nall : 0);
    if (separates && view.nreact > 0)
      std::copy_n(view.f[0], (size_t) 3 * view.nreact, force.begin());
    damping.assign(damps ? (size_t) 3 * list.nall : 0, 0.0);
    through = {};
    stored.begin();
  }

  void end(const ParticleView &view)
  {
    fresh = true;
    if (!separates || view.nreact == 0) return;
    const double *const f = view.f[0];
    double *const own = force.data();
    EVP_INDEPENDENT
    for (int k = 0; k < 3 * view.nreact; k++) own[k] = f[k] - own[k];
  }
};

}    // namespace EVP
