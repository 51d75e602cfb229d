// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/block_law.h"

#include <cmath>
#include <vector>

namespace EVP {

/// A pair in sums over all MPI ranks, kept as one number: its size is 1, or 1/2 without newton, when both owners of a
/// pair across MPI ranks hold it; 2 more for a pair that was beyond its cut-off; negative for a new pair.
struct PairWeight {
  static constexpr double BEYOND = 2.0;

  bool is_bond, was_beyond;
  double size;
  EVP_INLINE explicit PairWeight(double kept) :
      is_bond(kept > 0.0), was_beyond(std::fabs(kept) >= BEYOND),
      size(was_beyond ? std::fabs(kept) - BEYOND : std::fabs(kept))
  {
  }
};

/// What the pairs of a list hold, block by block: of their energies what BlockLaw is of their forces.
class BlockEnergy {
 public:
  /// What a loop reads of pairs beside the block: deq as recorded [length], and PairWeight.
  struct Pairs {
    const double *deq, *weight;
  };

  /// What the pairs of a block hold, each times its weight, 0 beyond the cut-off [energy].
  struct Values {
    alignas(64) double first[Block::SIZE], second[Block::SIZE], contacts[Block::SIZE];
    alignas(64) double hardening[Block::SIZE], plastic[Block::SIZE];    ///< with offsets only
    alignas(64) double damping[Block::SIZE];    ///< force/d of it, where asked for [force/length]
    alignas(64) double passes[Block::SIZE];     ///< 1 where a pair has passed its cut-off, else 0
  };

  /// For the laws that the pairs of a list have. flows: see StoredEnergy::assign().
  void assign(const PairList &, const BlockLaw &, bool flows);

  /// Fills values. damps: their damping is asked for, at Block::approach. What contacts lose that end here is added to
  /// ended [energy].
  void operator()(const Block &, const Pairs &, bool damps, Values &, double &ended) const;

  /// What each pair of the list has stored where it passes its cut-off, times its weight [energy].
  void find_depths(const PairList &list, const Pairs &pairs, double *depths) const
  {
    depths_of(*this, list, pairs, depths);
  }

  /// What a bond with the offset p holds where it passes its cut-off, less its depth: one whose cut-off is near deq may
  /// have flowed in compression only, and so is not at the threshold there [energy].
  double beside_depth(const PackedPair &, double p) const;

  const Law *laws = nullptr;
  std::vector<StoredForm> forms;    ///< of each law, or one entry if all are alike
  Level level = Level::BASE;
  bool flows = false;

 private:
  void (*evaluate)(const BlockEnergy &, const Block &, const Pairs &, bool, Values &) = nullptr;
  void (*depths_of)(const BlockEnergy &, const PairList &, const Pairs &, double *) = nullptr;
};

}    // namespace EVP
