// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/base/simd.h"
#include "core/pairs/pair_block.h"
#include "core/stress/stress.h"

#include <algorithm>
#include <tuple>

namespace EVP {

/// Adds n values of an atom.
EVP_INLINE void add_values(double *to, const double *from, int n)
{
  for (int c = 0; c < n; c++) to[c] += from[c];
}

/// Adds to `around` of both ends of each bond of an MPI rank the values of the other end, below nreact.
inline void add_bonded(const PairList &bonds, int nreact, const AtomValues &own, AtomValues &around)
{
  constexpr int AHEAD = 8;    // pairs ahead whose values are prefetched
  const int width = own.width();
  call_vectorized([&, last = (int) bonds.size() - 1]() EVP_KERNEL {
    for (const PackedRow &row : bonds.rows) {
      double *const to = around[row.i];
      const double *const from = own[row.i];
      for (int n = row.first; n < row.last; n++) {
        const int j = bonds.j[n], later = bonds.j[std::min(n + AHEAD, last)];
        prefetch(own[later], width * sizeof(double));
        prefetch(around[later], width * sizeof(double));
        add_values(to, own[j], width);
        if (j < nreact) add_values(around[j], from, width);
      }
    }
  });
}

/// Adds up the stresses of spheres from the forces of a loop: half of the virial of each pair, without damping.
class StressSums final : public PairConsumer {
 public:
  static constexpr int NSTRESS = std::tuple_size<Tensor>::value;

  static constexpr int WIDTH = NSTRESS + 3;

  /// Of particles and ghosts, below nreact with the reactions: -1/2 sum of F/d r (x) r [energy], tension is positive; then the force
  /// of all their pairs, which is the change of f by the loop.
  AtomValues sums{WIDTH};

  /// Before the loop.
  void start(int nall, const ParticleView &view)
  {
    nreact = view.nreact;
    damped = view.v != nullptr;
    sums.assign(nall, 0.0);
    if (!view.f) return;    // commit() looks for what changes, without forces
    for (int i = 0; i < nall; i++)
      for (int c = 0; c < 3; c++) sums[i][NSTRESS + c] = -view.f[i][c];
  }

  void operator()(const PairRange &range, PairBlock &block) override
  {
    call_vectorized([&]() EVP_KERNEL {
      const int *const partner = range.list.j.data() + range.first;
      double half[PairBlock::SIZE];
      for (int k = 0; k < block.n; k++) {
        prefetch(sums[partner[k]], NSTRESS * sizeof(double));
        half[k] = -0.5 * (damped ? block.force[k] - block.damping[k] : block.force[k]);
      }
      range.for_each_row([&](int i, int first, int last) EVP_KERNEL {
        double total[NSTRESS] = {};
        for (int k = first - range.first; k < last - range.first; k++) {
          const double x = block.relative(0, k), y = block.relative(1, k), z = block.relative(2, k);
          const double hx = half[k] * x, hy = half[k] * y;
          const double share[NSTRESS] = {hx * x, hy * y, half[k] * z * z, hx * y, hx * z, hy * z};
          add_values(total, share, NSTRESS);
          if (partner[k] < nreact) add_values(sums[partner[k]], share, NSTRESS);
        }
        add_values(sums[i], total, NSTRESS);
      });
    });
  }

  /// After the loop.
  void add_forces(const ParticleView &view)
  {
    for (int i = 0; i < (int) sums.size(); i++) add_values(sums[i] + NSTRESS, view.f[i], 3);
  }

 private:
  int nreact = 0;
  bool damped = false;    // do the blocks have forces of the damping?
};

}    // namespace EVP
