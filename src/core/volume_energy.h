// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "core/pair_block.h"
#include "core/pairs.h"
#include "core/simd.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

namespace EVP {

/// Density of a particle now, by its bonds and by pairs without one.
struct DensityNow {
  double bonded, unbonded;
  double total() const { return bonded + unbonded; }
};

/// No less than d2U/drho2 of a particle is [energy]: by the density of its bonds alone, and by that of all its pairs.
struct VolumeStiffness {
  double bonded, total;
};

/// Energy of a particle, -dU/drho by either density, stiffness [energy]; its volume strain.
struct VolumeState {
  double energy, bonded, unbonded;
  VolumeStiffness stiffness;
  double strain;
};

/// U = kv u(theta) of the volume strain theta = (rho0 - rho)/G.
///
/// Expanded: u = theta^2/2 up to `cavitation`, from where the derivative falls, to 0 at twice that: what is torn pulls no
/// more. Compressed: pairs without a bond fill the gap first, without force. Where two surfaces close, others come to a particle that
/// had fewer neighbors than the interior, which is no compression. With [y] = max(y, 0), in units of G,
///
///     u = 1/2 [bonded - rho0]^2 + 1/2 [rho - rho0 - gap]^2 - 1/2 [bonded - rho0 - gap]^2
///
/// which is theta^2/2 without a gap, and where all pairs are bonds; its derivatives never jump.
///
/// Torn: theta is that of the bonds alone, and the two terms with the gap are added whatever its sign, so that surfaces
/// of a crack never pull on each other. In the last term the gap is without the shares of the bonds that broke: as they
/// break it stays, and so does the energy.
class VolumeLaw {
 public:
  static constexpr double NEVER = std::numeric_limits<double>::infinity();
  double cavitation = 0.15;    ///< NEVER: no end

  VolumeState state(double kv, const VolumeReference &reference, const DensityNow &now) const
  {
    const double slope = reference.own.slope;
    if (!(slope > 0.0)) return {};
    const double per_slope = 1.0 / slope;
    const bool torn = reference.torn != 0.0;
    const double theta = strain(reference, now), scale = kv * per_slope;
    VolumeState state = {
        0.5 * kv * theta * theta, scale * theta, scale * theta, {0.0, scale * per_slope}, theta};
    if (theta > cavitation) {
      const double left = std::max(0.0, 2.0 * cavitation - theta);
      state.energy = kv * (cavitation * cavitation - 0.5 * left * left);
      state.bonded = state.unbonded = scale * left;
    }
    if (theta < 0.0 || torn) {
      const double compressed = (now.bonded - reference.own.rho) * per_slope;
      const double own = std::max(0.0, compressed), gap = reference.gap * per_slope;
      const double total = torn ? compressed + now.unbonded * per_slope : -theta;
      const double beyond = std::max(0.0, total - gap);
      const double counted = std::max(0.0, own - gap + reference.lost * per_slope);
      const double expanded = theta > 0.0 ? state.energy : 0.0,
                   pull = theta > 0.0 ? state.bonded : 0.0;
      state.energy = expanded + 0.5 * kv * (own * own + beyond * beyond - counted * counted);
      state.bonded = pull - scale * (own + beyond - counted);
      state.unbonded = -scale * beyond;
      if (gap > 0.0 || torn)
        state.stiffness = {counted > 0.0 ? 0.0 : scale * per_slope,
                           beyond > 0.0 ? scale * per_slope : 0.0};
    }
    return state;
  }

  /// The reference after bonds have broken that have this share of the density now. They count as new pairs from then on.
  /// The volume strain stays, and new pairs push from the same density on as before: the energy does not jump.
  static VolumeReference without(const VolumeReference &before, const DensityNow &now, double share)
  {
    const double slope = before.own.slope, theta = strain(before, now);
    const double bonded = (before.own.rho - now.bonded) / slope;
    const double rho = now.bonded - share + (theta > 0.0 ? theta : std::min(0.0, bonded)) * slope;
    const double lost = before.own.rho - rho;
    return {{rho, slope}, before.gap + lost, 1.0, before.lost + lost};
  }

  /// The reference after pairs without a bond have become bonds that have this share of the density now: the energy does
  /// not jump, and new pairs push from the same density on as before.
  static VolumeReference with(const VolumeReference &before, const DensityNow &now, double share)
  {
    const double pushes_from = before.own.rho + before.gap, bonded = now.bonded + share;
    VolumeReference after = before;
    if (before.torn != 0.0) {
      after.own.rho += share;
      after.lost -= share;
    } else {
      const auto beyond = [](double density, double from) {
        return std::max(0.0, density - from);
      };
      const double own = beyond(now.bonded, before.own.rho), then = beyond(now.bonded, pushes_from),
                   counted = beyond(bonded, pushes_from);
      const double denser = std::sqrt(own * own - then * then + counted * counted);
      after.own.rho = denser > 0.0 ? bonded - denser : std::max(before.own.rho, bonded);
    }
    after.gap = pushes_from - after.own.rho;
    return after;
  }

 private:
  static double strain(const VolumeReference &reference, const DensityNow &now)
  {
    const double rho = reference.torn != 0.0 ? now.bonded : now.total();
    return (reference.own.rho - rho) * (1.0 / reference.own.slope);
  }
};

/// What goes over pairs twice: for the densities, then for the forces. Between them the owners of the particles make their
/// pulls, -dU/drho, of the densities. Both have WIDTH values per particle, of bonds, and of pairs without a bond.
struct VolumePasses {
  static constexpr int WIDTH = 2;

  /// Adds t^2 of each pair to the densities of both particles, those below view.nreact. inv_dlim: of each pair.
  /// densities: where those of these pairs begin. ending: takes those that end.
  static void add_densities(const PairList &pairs, const std::vector<double> &inv_dlim,
                            const ParticleView &view, double *densities,
                            EndingBonds *ending = nullptr)
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
          add_to_both(range, block.elastic, view.nreact, densities);
        },
        inv_dlim.data());
  }

  /// Takes those pairs of a list that are within their dlim, which is their deq.
  static void find_active(const PairList &pairs, const ParticleView &view, PairList &active)
  {
    PairBlock block;
    active.clear(BOND_MARGIN, Flow::FORGETS);
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

  /// Adds to the forces of a block of pairs -(pull_i + pull_j) 2 t/dlim of each.
  class Forces final : public PairConsumer {
   public:
    /// inv_dlim: of each pair of the list.
    Forces(const double *inv_dlim_in, const double *pulls_in) :
        inv_dlim_of(inv_dlim_in), pulls(pulls_in)
    {
    }

    void operator()(const PairRange &range, PairBlock &block) override
    {
      const double *const inv_dlim = inv_dlim_of + range.first;
      alignas(64) double pull[PairBlock::SIZE];    // of both particles
      const int *const partner = range.list.j.data();
      range.for_each_row([&](int i, int first, int last) {
        const double own = pulls[WIDTH * (size_t) i];
        EVP_UNROLL
        for (int k = first; k < last; k++)
          pull[k - range.first] = own + pulls[WIDTH * (size_t) partner[k]];
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
    const double *inv_dlim_of, *pulls;
  };

 private:
  static void add_to_both(const PairRange &range, const double *of_block, int nreact, double *sums)
  {
    const int *const partner = range.list.j.data();
    range.for_each_row([&](int i, int first, int last) {
      double own = 0.0;
      EVP_UNROLL
      for (int k = first; k < last; k++) {
        const int j = partner[k];
        own += of_block[k - range.first];
        if (j < nreact) sums[WIDTH * (size_t) j] += of_block[k - range.first];
      }
      sums[WIDTH * (size_t) i] += own;
    });
  }
};

}    // namespace EVP
