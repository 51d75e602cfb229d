// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/force_loop.h"
#include "core/pair_list.h"
#include "core/simd.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace EVP {

/// Energy of the volume strain of each particle over its bonds, and the forces that follow from it.
///
///     U = 1/2 sum_i kv_i theta_i^2,   theta_i = 3/W_i sum_j w_ij (d_ij/deq_ij - 1),
///     w_ij = 1 - (deq_ij/dlim_ij)^2,   W_i = sum_j w_ij over all bonds that were recorded
///
/// theta is the trace of the strain where a body deforms alike everywhere. A pair beyond its cut-off
/// leaves the sum, not W_i. kv is an energy per particle, all else here has no dimension.
///
/// Pass one adds up the strains of each particle. Between the passes their owners make g = dU/dtheta
/// times 3/W, an energy. Pass two, in the force loop, adds -w_ij (g_i + g_j)/deq_ij to each pair.
class VolumeEnergy {
 public:
  explicit VolumeEnergy(Level level_in = best_level()) : level(level_in) {}

  /// Of a bond: it fades as deq nears dlim [both lengths], so that none enters or leaves with a jump at
  /// rest.
  static double weight(double deq, double dlim)
  {
    const double ratio = deq / dlim;
    return std::max(0.0, 1.0 - ratio * ratio);
  }

  /// Volume strain of a particle from the sum over its pairs; 0 where it has no bond.
  static double strain(double sum, double weight_sum)
  {
    return weight_sum > 0.0 ? 3.0 * sum / weight_sum : 0.0;
  }

  /// What its pairs see of a particle [energy].
  static double pull(double kv, double strain, double weight_sum)
  {
    return weight_sum > 0.0 ? 3.0 * kv * strain / weight_sum : 0.0;
  }

  /// Second derivative of its energy by the sum over its pairs [energy].
  static double stiffness(double kv, double weight_sum)
  {
    return weight_sum > 0.0 ? 9.0 * kv / (weight_sum * weight_sum) : 0.0;
  }

  /// Takes the weights of a list that was just packed. dlim(i, pair): of a bond [length].
  template <class Dlim> void pack(const PairList &list, Dlim &&dlim)
  {
    const size_t n = list.pairs.size();
    if (weights.size() < n) {
      weights.resize(n + n / 4);
      openings.resize(weights.size());
    }
    for (const PackedRow &row : list.rows)
      for (int k = row.first; k < row.last; k++) {
        const PackedPair pair = list.pairs[k];
        weights[k] = pair.is_bond() ? weight(1.0 / pair.inv_deq, dlim(row.i, pair)) : 0.0;
        openings[k] = weights[k] * pair.inv_deq;
      }
  }

  /// Pair k is no bond any more.
  void drop(size_t k)
  {
    if (k < weights.size()) weights[k] = openings[k] = 0.0;    // else the list is being packed
  }

  double weight_of(int k) const { return weights[k]; }

  /// Adds w (d/deq - 1) of each pair within its cut-off to sums of both particles, those below
  /// view.nreact.
  void add_strains(const PairList &list, const ParticleView &view, double *sums)
  {
    Block block;
    const auto add_block = [&](const PairRange &range) {
      gather<false>(list, view, range, block);
      call_at(level, [&]() EVP_KERNEL {
        evaluate(block, &weights[range.first], &openings[range.first]);
      });
      scatter(list, view.nreact, range, block, sums);
    };
    for_each_block(list, add_block, weights.data(), openings.data());
  }

  /// Pass two: called by the force loop with each block.
  struct Forces {
    static constexpr bool axial = true;
    const PairList &list;
    const double *openings, *pulls;

    void operator()(const PairRange &range, Block &block) const
    {
      const int *const partner = list.pairs.j.data();
      const double *const opening = openings, *const pull = pulls;
      range.for_each_row([&](int i, int first, int last) {
        const double own = pull[i];
        EVP_UNROLL
        for (int k = first; k < last; k++)
          block.axial[k - range.first] = -(own + pull[partner[k]]) * opening[k];
      });
    }
  };

  /// pulls: g of all particles and ghosts.
  Forces forces(const PairList &list, const double *pulls) const
  {
    return {list, openings.data(), pulls};
  }

  double memory_usage() const { return bytes_of(weights, openings); }

 private:
  Level level;
  std::vector<double> weights;     // of the packed pairs, 0 where none was recorded
  std::vector<double> openings;    // of each, w/deq [1/length]

  // the strains go to block.energy, which the force loop fills anew
  static EVP_INLINE void evaluate(Block &block, const double *weight, const double *opening)
  {
    const double *const cutsq = block.cutsq;
    const int n = block.n;
    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const double dsq = block.distance_squared(k);
      const double strain = opening[k] * std::sqrt(dsq) - weight[k];
      block.energy[k] = dsq > cutsq[k] ? 0.0 : strain;
    }
  }

  static void scatter(const PairList &list, int nreact, const PairRange &range, const Block &block,
                      double *sums)
  {
    const int *const partner = list.pairs.j.data();
    range.for_each_row([&](int i, int first, int last) {
      double own = 0.0;
      EVP_UNROLL
      for (int k = first; k < last; k++) {
        const int j = partner[k];
        const double strain = block.energy[k - range.first];
        own += strain;
        if (j < nreact) sums[j] += strain;
      }
      sums[i] += own;
    });
  }
};

}    // namespace EVP
