// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law.h"
#include "core/pair_list.h"
#include "core/simd.h"

#include <vector>

namespace EVP {

/// Up to SIZE pairs between gathering and scattering. Relative positions are from j to i.
struct Block {
  static constexpr int SIZE = BLOCK_SIZE;

  int n;                    ///< pairs in this block
  const double *inv_deq;    ///< of each pair, see PackedPair
  const double *cutsq;
  const double *margin_removed;    ///< see PackedPairs
  const int *kind;                 ///< 2 law + is_bond

  // with flow that stays
  FlowArrays flow;
  bool incremental;    ///< energies hold what flow from `offset` dissipates

  alignas(64) double xy[2 * SIZE];      ///< relative position: x and y side by side [length]
  alignas(64) double z[SIZE];           ///< [length]
  alignas(64) double approach[SIZE];    ///< (x_i - x_j).(v_i - v_j), read with damping only
  alignas(64) double axial[SIZE];       ///< force added to that of the law, where asked for [force]
  alignas(64) double force[SIZE];       ///< result: force/d [force/length], 0 beyond the cut
  alignas(64) double energy[SIZE];      ///< result where asked for [energy], 0 beyond the cut

  EVP_INLINE double distance_squared(int k) const
  {
    return xy[2 * k] * xy[2 * k] + xy[2 * k + 1] * xy[2 * k + 1] + z[k] * z[k];
  }
  bool only_bonds() const
  {
    int bonds = 0;
    for (int k = 0; k < n; k++) bonds += kind[k] & 1;
    return bonds == n;
  }
  template <int Component> double relative(int k) const
  {
    return Component < 2 ? xy[2 * k + Component] : z[k];
  }
};

/// The laws of all pairs of a list, and the fastest way through a block of these pairs on the machine
/// that runs. The numbers are the same on every instruction set: no step of a sum is fused or moved.
class BlockLaw {
 public:
  /// laws: indexed by PackedPair::law; owned by the caller, who must not move them. used: indices of
  /// those that the pairs have. Where these are alike, one set of constants is for all pairs. flows:
  /// by the return map from block.offset.
  void assign(const std::vector<Law> &laws, const std::vector<int> &used, bool flows = false,
              Level level = best_level());

  /// What else than the forces of the law is asked for: those of its damping and Block::axial, energies.
  struct Asked {
    bool damping, energy, axial;
  };

  /// Fills block.force, and block.energy where asked for.
  void operator()(Block &block, const Asked &asked) const { function(*this, block, asked); }

  const Law *laws = nullptr;
  std::vector<LawConstants> constants;    ///< of each law, or one entry if all are alike
  Level level = Level::BASE;

 private:
  void (*function)(const BlockLaw &, Block &, const Asked &) = nullptr;
};

}    // namespace EVP
