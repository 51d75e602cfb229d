// SPDX-License-Identifier: GPL-2.0-only
//
// Sums of energy and virial over all pairs, taken from whole blocks.
// Pure C++17.

#ifndef EVP_CORE_TALLIES_H
#define EVP_CORE_TALLIES_H

#include "core/force_loop.h"

namespace EVP {

/// A fixed number of partial sums: vectors of any width then add in the same order.
class LaneSum {
 public:
  static constexpr int LANES = 8;
  template <class Term> void add(int n, Term &&term)
  {
    double sums[LANES];    // apart from what term reads, so that they stay in registers
    std::copy(lanes, lanes + LANES, sums);
    int k = 0;
    for (; k + LANES <= n; k += LANES)
      for (int lane = 0; lane < LANES; lane++) sums[lane] += term(k + lane);
    for (int lane = 0; k + lane < n; lane++) sums[lane] += term(k + lane);
    std::copy(sums, sums + LANES, lanes);
  }
  double total() const
  {
    double sum = 0.0;
    for (const double lane : lanes) sum += lane;
    return sum;
  }

 private:
  double lanes[LANES] = {};
};

/// Energy [energy] and virial (sum of r F as xx yy zz xy xz yz) [energy] of the pairs of a list.
class SumTally {
 public:
  static constexpr bool active = true;
  const bool energy;    ///< energies are wanted

  /// nreact: pairs with a partner beyond it count half, as the MPI rank that owns it has them too.
  SumTally(const PairList &list_in, int nreact_in, bool energy_in, bool virial_in) :
      energy(energy_in), list(list_in), nreact(nreact_in), virial(virial_in)
  {
  }

  void operator()(const PairRange &range, const Block &block)
  {
    const int *const j = list.pairs.j() + range.first;
    for (int k = 0; k < block.n; k++) weight[k] = j[k] < nreact ? 1.0 : 0.5;
    if (energy)
      energies.add(block.n, [&](int k) {
        return weight[k] * block.energy[k];
      });
    if (!virial) return;
    for (int k = 0; k < block.n; k++) weight[k] *= block.force[k];
    const auto add = [&](LaneSum &sum, auto &&product) {
      sum.add(block.n, [&](int k) {
        return weight[k] * product(block.xy[2 * k], block.xy[2 * k + 1], block.z[k]);
      });
    };
    add(virials[0], [](double x, double, double) {
      return x * x;
    });
    add(virials[1], [](double, double y, double) {
      return y * y;
    });
    add(virials[2], [](double, double, double z) {
      return z * z;
    });
    add(virials[3], [](double x, double y, double) {
      return x * y;
    });
    add(virials[4], [](double x, double, double z) {
      return x * z;
    });
    add(virials[5], [](double, double y, double z) {
      return y * z;
    });
  }

  double total_energy() const { return energies.total(); }
  double total_virial(int component) const { return virials[component].total(); }

 private:
  const PairList &list;
  const int nreact;
  const bool virial;
  LaneSum energies, virials[6];
  double weight[Block::SIZE];    // of each pair of the block, for the virial times force/d
};

}    // namespace EVP

#endif
