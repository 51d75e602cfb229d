// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/fault.h"
#include "core/pair_block.h"
#include "core/pairs.h"
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
/// theta is the trace of the strain where a body deforms alike everywhere. A pair past its cutoff
/// leaves the sum, not W_i. kv is an energy per particle, all else here has no dimension.
///
/// Pass one adds up the strains of each particle. Between the passes their owners make g = dU/dtheta
/// times 3/W, an energy. Pass two adds -w_ij (g_i + g_j)/deq_ij to the force of each pair.
class VolumeEnergy {
 public:
  explicit VolumeEnergy(InstructionSet level_in = best_instruction_set()) : level(level_in) {}

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
    return weight_sum > 0.0 ? (fault(HALF_VOLUME_FORCE) ? 1.5 : 3.0) * kv * strain / weight_sum
                            : 0.0;
  }

  /// Second derivative of its energy by the sum over its pairs [energy].
  static double stiffness(double kv, double weight_sum)
  {
    return weight_sum > 0.0 ? 9.0 * kv / (weight_sum * weight_sum) : 0.0;
  }

  /// Takes the weights of bonds that were just packed. dlim(i, pair): of a bond [length].
  template <class Dlim> void pack(const PairList &bonds, Dlim &&dlim)
  {
    const size_t n = bonds.size();
    if (weights.size() < n) {
      weights.resize(n + n / 4);
      openings.resize(weights.size());
    }
    for (const PackedRow &row : bonds.rows)
      for (int k = row.first; k < row.last; k++) {
        const PackedPair pair = bonds[k];
        weights[k] = weight(1.0 / pair.inv_deq, dlim(row.i, pair));
        openings[k] = weights[k] * pair.inv_deq;
      }
  }

  double weight_of(int k) const { return weights[k]; }

  /// Pass one: adds w (d/deq - 1) of each bond within its cutoff to sums of both particles, those below view.nreact.
  void add_strains(const PairList &bonds, const ParticleView &view, double *sums)
  {
    PairBlock block;
    const auto add_block = [&](const PairRange &range) {
      gather<false>(view, range, block);
      const double *const weight = &weights[range.first], *const opening = &openings[range.first];
      call_at(level, [&]() EVP_KERNEL {
        find_strains(block, weight, opening);
      });
      add_to_both(range, block.elastic, view.nreact, sums);
    };
    for_each_block(bonds, add_block, weights.data(), openings.data());
  }

  /// Pass two: adds the forces to view.f. pulls: g of all particles and ghosts. tally: as in accumulate_forces().
  template <class Tally>
  void add_forces(const PairList &bonds, const ParticleView &view, const double *pulls,
                  Tally &&tally) const
  {
    PairBlock block;
    const int *const partner = bonds.j.data();
    const auto add_block = [&](const PairRange &range) {
      gather<false>(view, range, block);
      range.for_each_row([&](int i, int first, int last) {
        const double own = pulls[i];
        EVP_UNROLL
        for (int k = first; k < last; k++) {
          const int b = k - range.first;
          const double dsq = block.distance_squared(b);
          block.force[b] = dsq > block.cutsq[b]
              ? 0.0
              : -(own + pulls[partner[k]]) * openings[k] / std::sqrt(dsq);
        }
      });
      tally(range, block);
      scatter(range, block, block.force, view.nreact, view.f);
    };
    for_each_block(bonds, add_block, openings.data());
  }

  double memory_usage() const { return bytes_of(weights, openings); }

 private:
  InstructionSet level;
  std::vector<double> weights;     // of the packed pairs, 0 where none was recorded
  std::vector<double> openings;    // of each, w/deq [1/length]

  static EVP_INLINE void find_strains(PairBlock &block, const double *weight, const double *opening)
  {
    const double *const cutsq = block.cutsq;
    const int n = block.n;
    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const double dsq = block.distance_squared(k);
      const double strain = opening[k] * std::sqrt(dsq) - weight[k];
      block.elastic[k] = dsq > cutsq[k] ? 0.0 : strain;
    }
  }

  static void add_to_both(const PairRange &range, const double *of_block, int nreact, double *sums)
  {
    const int *const partner = range.list.j.data();
    range.for_each_row([&](int i, int first, int last) {
      double own = 0.0;
      EVP_UNROLL
      for (int k = first; k < last; k++) {
        const int j = partner[k];
        const double strain = of_block[k - range.first];
        own += strain;
        if (j < nreact) sums[j] += strain;
      }
      sums[i] += own;
    });
  }
};

}    // namespace EVP
