// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/base/simd.h"
#include "core/pairs/pair_block.h"
#include "core/pairs/pairs.h"
#include "core/timestep/stiffness_matrix.h"
#include "core/volume/volume_record.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

namespace EVP {

/// Density of a particle now: of its bonds, of pairs without a bond that pull, and of those that only push.
struct DensityNow {
  double bonded, pulling, pushing = 0.0;
};

/// Energy of a particle, -dU/drho by each density, stiffness [energy]; its volume strain.
struct VolumeState {
  double energy, bonded, pulling, pushing;
  DensityStiffness stiffness;
  double strain;
};

/// What the volume energy takes over from bonds that yield under pressure, as no metal does: bulk/2 [y - from]^2 beside kv y^2/2.
struct TakenOver {
  double bulk = 0.0;    ///< what the bonds of a particle store, less the 1/2 theta^2 [energy]
  double from = 0.0;    ///< strain where they yield
};

/// U = kv u(theta) of the volume strain theta = (rho0 - rho)/G, rho being the density of all pairs that pull.
///
/// Expanded: u = theta^2/2 up to `cavitation`, from where the derivative falls, to 0 at twice that: what is torn pulls no
/// more. Compressed: pairs without a bond fill the gap first, without force. Where two surfaces close, others come to a
/// particle that had fewer neighbors than the interior, which is no compression. With [y] = max(y, 0), in units of G,
///
///     1/2 [bonded - rho0]^2 + 1/2 [all - rho0 - gap]^2 - 1/2 [bonded - rho0 - gap]^2
///
/// which is theta^2/2 without a gap, and where all pairs are bonds; its derivatives never jump. With pairs that do not pull it
/// is added to the energy of an expansion, too: such pairs push as `all` exceeds the density of the interior, and never pull.
/// In its last term the gap is without the shares of pairs that pull no more: as they cease to, it stays, and so does the energy.
///
/// Of a particle that is torn no pair without a bond pulls.
///
/// What is taken over goes with the strain y that has the same u = y^2/2. Expanded it grows no further from MOST_TAKEN_OVER on, and
/// falls beyond `cavitation` as the rest does.
class VolumeLaw {
 public:
  static constexpr double NEVER = std::numeric_limits<double>::infinity();
  static constexpr double MOST_TAKEN_OVER = 0.006;
  double cavitation = 0.15;    ///< NEVER: no end

  /// tension: share of what an expansion stores, and so of its pull, that is left; the stiffness is that of all.
  VolumeState state(double kv, const VolumeReference &reference, const DensityNow &densities,
                    const TakenOver &taken = {}, double tension = 1.0) const
  {
    const double slope = reference.own.slope;
    if (!(slope > 0.0)) return {};
    const bool torn = reference.is_torn();
    const DensityNow now = that_act(torn, densities);
    const bool some_push = torn || now.pushing > 0.0;
    const double per_slope = 1.0 / slope, scale = kv * per_slope;
    const double theta = strain(reference, now);
    VolumeState state = {0.5 * kv * theta * theta, scale * theta, scale * theta, 0.0,
                         {0.0, scale * per_slope}, theta};
    if (theta > cavitation) {
      const double left = std::max(0.0, 2.0 * cavitation - theta);
      state.energy = kv * (cavitation * cavitation - 0.5 * left * left);
      state.bonded = state.pulling = scale * left;
    }
    const bool takes = taken.bulk > 0.0 && theta > taken.from && cavitation > taken.from;
    if (takes) take_over_expanded(taken, theta, per_slope, state);
    if (theta > 0.0 && tension < 1.0) {
      state.energy *= tension;
      state.bonded *= tension;
      state.pulling *= tension;
    }
    if (theta < 0.0 || some_push) {
      const double compressed = (now.bonded - reference.own.rho) * per_slope;
      const double own = std::max(0.0, compressed), gap = reference.gap * per_slope;
      const double total = some_push ? compressed + (now.pulling + now.pushing) * per_slope
                                     : -theta;
      const double beyond = std::max(0.0, total - gap);
      const double counted = std::max(0.0, own - gap + reference.lost * per_slope);
      const double squared = own * own + beyond * beyond - counted * counted;
      const bool yields = taken.bulk > 0.0 && squared > taken.from * taken.from;
      const double y = yields ? std::sqrt(squared)
                              : 0.0;    // which takes time, and few particles yield
      const double more = yields ? y - taken.from : 0.0, inv_y = yields ? 1.0 / y : 0.0;
      const double bulk_over_kv = yields ? taken.bulk / kv : 0.0;
      const double times = 1.0 + bulk_over_kv * more * inv_y;
      const double expanded = theta > 0.0 ? state.energy : 0.0,
                   pull = theta > 0.0 ? state.bonded : 0.0;
      state.energy = expanded + 0.5 * kv * squared;
      if (more > 0.0) state.energy += 0.5 * taken.bulk * more * more;
      state.bonded = pull - scale * times * (own + beyond - counted);
      state.pushing = -scale * times * beyond;
      state.pulling = torn ? state.pushing : pull - scale * times * beyond;
      if (gap > 0.0 || some_push) {
        const double one = scale * per_slope, of_all = beyond > 0.0 ? one : 0.0;
        if (theta > 0.0 && !torn)
          state.stiffness = {0.0, one + of_all};
        else
          state.stiffness = {counted > 0.0 ? 0.0 : one, of_all};
      }
      if (more > 0.0) {
        const double slope = (own + beyond - counted) * inv_y;    // of y, more than 1 in a gap
        state.stiffness =
            stiffened(state.stiffness, 1.0 + bulk_over_kv * std::max(1.0, slope * slope));
      }
    }
    if (takes) state.stiffness.total += taken.bulk * per_slope * per_slope;
    return state;
  }

  // The reference after an event, at the densities before it. The energy does not change, nor does the strain where it is positive,
  // nor the density from which the pairs that only push begin to push.

  /// Bonds have broken that have this share of the density; no pair without a bond pulls from then on.
  static VolumeReference without(const VolumeReference &before, const DensityNow &now, double share)
  {
    VolumeReference after = without_pull(before, now, share, now.pulling);
    after.set(VolumeReference::BROKEN);
    return after;
  }

  /// It was torn open.
  static VolumeReference opened(const VolumeReference &before, const DensityNow &now)
  {
    VolumeReference after = without_pull(before, now, 0.0, now.pulling);
    after.set(VolumeReference::OPEN);
    return after;
  }

  /// Pairs with such a share pull no more, as others were torn open.
  static VolumeReference beside_open(const VolumeReference &before, const DensityNow &now,
                                     double share)
  {
    return without_pull(before, now, 0.0, share);
  }

  /// A bond that did not count, as its partner came later, has broken: it counts as a new pair from now on.
  static VolumeReference beside(const VolumeReference &before, const DensityNow &now, double share)
  {
    VolumeReference after = without(before, now, 0.0);
    after.gap += share;
    after.lost += share;
    return after;
  }

 private:
  static DensityStiffness stiffened(const DensityStiffness &stiffness, double times)
  {
    return {times * stiffness.bonded, times * stiffness.total};
  }
  void take_over_expanded(const TakenOver &taken, double theta, double per_slope,
                          VolumeState &state) const
  {
    const auto stored = [](double more) {
      const double most = std::min(more, MOST_TAKEN_OVER);
      return most * (more - 0.5 * most);
    };
    double more = std::min(theta - taken.from, MOST_TAKEN_OVER), held = stored(theta - taken.from);
    if (theta > cavitation) {
      const double left = std::max(0.0, 2.0 - theta / cavitation);
      more = left * std::min(cavitation - taken.from, MOST_TAKEN_OVER);
      held = stored(cavitation - taken.from) +
          0.5 * cavitation * (1.0 - left * left) *
              std::min(cavitation - taken.from, MOST_TAKEN_OVER);
    }
    state.energy += taken.bulk * held;
    state.bonded += taken.bulk * more * per_slope;
    state.pulling += taken.bulk * more * per_slope;
  }
  static DensityNow that_act(bool torn, const DensityNow &now)
  {
    return torn ? DensityNow{now.bonded, 0.0, now.pulling + now.pushing} : now;
  }
  static double strain(const VolumeReference &reference, const DensityNow &now)
  {
    return (reference.own.rho - (now.bonded + now.pulling)) * (1.0 / reference.own.slope);
  }
  static VolumeReference without_pull(const VolumeReference &before, const DensityNow &densities,
                                      double of_bonds, double of_others)
  {
    const bool torn = before.is_torn();
    const DensityNow now = that_act(torn, densities);
    const double slope = before.own.slope, theta = strain(before, now);
    const double bonded = now.bonded - of_bonds, pulling = torn ? 0.0 : now.pulling - of_others;
    const double denser = (before.own.rho - now.bonded) / slope;    // by bonds: below 0
    double rho = bonded + pulling + theta * slope;
    if (!(theta > 0.0))
      rho = denser < 0.0 ? bonded + denser * slope : std::min(before.own.rho, bonded + pulling);
    const double lost = before.own.rho - rho;
    return {{rho, slope}, before.gap + lost, before.torn, before.lost + lost};
  }
};

/// What goes over pairs twice: for the densities, then for the forces. Between them the owners of the particles make their
/// pulls, -dU/drho, of the densities. Both have several values per particle, see DensityNow.
struct VolumePasses {
  /// Particles for which a pair counts: that of its row, its partner.
  enum Ends { ROW = 1, PARTNER = 2, BOTH = 3 };

  /// Adds t^2 of each pair to the densities of its ends, those below view.nreact. inv_dlim: of each pair.
  /// ending: takes those that end.
  static void add_densities(const PairList &pairs, const std::vector<double> &inv_dlim,
                            const ParticleView &view, AtomColumn<double> densities,
                            Ends ends = BOTH, EndingBonds *ending = nullptr)
  {
    PairBlock block;
    for_each_block(
        pairs,
        [&](const PairRange &range) {
          gather<false>(view, range, block);
          if (ending) (*ending)(range, block);
          call_vectorized([&, own = inv_dlim.data() + range.first]() EVP_KERNEL {
            const int n = block.n;
            EVP_INDEPENDENT
            for (int k = 0; k < n; k++) {
              const double t = 1.0 - std::sqrt(block.distance_squared(k)) * own[k];
              block.elastic[k] = t > 0.0 ? t * t : 0.0;
            }
          });
          add(range, block.elastic, ends & PARTNER ? view.nreact : 0, ends & ROW, densities);
        },
        inv_dlim.data());
  }

  /// Takes those pairs of a list that are within their dlim, which is their deq.
  static void find_active(const PairList &pairs, const ParticleView &view, PairList &active)
  {
    PairBlock block;
    active.clear(BOND_MARGIN, Flow::REVERSIBLE);
    for_each_block(pairs, [&](const PairRange &range) {
      gather<false>(view, range, block);
      const int past = call_vectorized([&]() EVP_KERNEL {
        return count_past_cutoff(block);
      });
      if (past == block.n || !active.make_room(block.n - past)) return;
      range.for_each_row([&](int i, int first, int last) {
        int n = 0;
        for (int k = first; k < last; k++)
          if (!(block.distance_squared(k - range.first) > block.cutsq[k - range.first]))
            active.set(active.size() + n++, pairs.j[k], 1.0 / pairs.inv_deq[k],
                       1.0 / pairs.inv_deq[k]);
        active.add_row(i, n);
      });
    });
  }

  /// Adds to the forces of a block of pairs -(pull_i + pull_j) 2 t/dlim of each, with the pulls of its ends.
  class Forces final : public PairConsumer {
   public:
    /// inv_dlim: of each pair of the list.
    Forces(const double *inv_dlim_in, AtomColumn<const double> pulls_in, Ends ends_in = BOTH) :
        inv_dlim_of(inv_dlim_in), pulls(pulls_in), ends(ends_in)
    {
    }

    void operator()(const PairRange &range, PairBlock &block) override
    {
      const double *const inv_dlim = inv_dlim_of + range.first;
      alignas(64) double pull[PairBlock::SIZE];    // of both particles
      const int *const partner = range.list.j.data();
      range.for_each_row([&](int i, int first, int last) {
        const double own = ends & ROW ? pulls.of(i) : 0.0;
        if (!(ends & PARTNER))
          return (void) std::fill(pull + (first - range.first), pull + (last - range.first), own);
        EVP_UNROLL
        for (int k = first; k < last; k++) pull[k - range.first] = own + pulls.of(partner[k]);
      });
      call_vectorized([&]() EVP_KERNEL {
        const int n = block.n;
        EVP_INDEPENDENT
        for (int k = 0; k < n; k++) {
          const double inv_d = 1.0 / std::sqrt(block.distance_squared(k));
          const double added = pull[k] * 2.0 * inv_dlim[k] * (inv_d - inv_dlim[k]);
          const double within = inv_d > inv_dlim[k] ? added : 0.0;    // no &&: vectorized
          block.force[k] -= block.distance_squared(k) > block.cutsq[k] ? 0.0 : within;
        }
      });
    }

   private:
    const double *inv_dlim_of;
    AtomColumn<const double> pulls;
    Ends ends;
  };

 private:
  static void add(const PairRange &range, const double *of_block, int nreact, bool to_row,
                  AtomColumn<double> sums)
  {
    const int *const partner = range.list.j.data();
    range.for_each_row([&](int i, int first, int last) {
      double own = 0.0;
      EVP_UNROLL
      for (int k = first; k < last; k++) {
        const int j = partner[k];
        own += of_block[k - range.first];
        if (j < nreact) sums.of(j) += of_block[k - range.first];
      }
      if (to_row) sums.of(i) += own;
    });
  }
};

}    // namespace EVP
