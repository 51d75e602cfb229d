// SPDX-License-Identifier: GPL-2.0-only

#include "core/block_law.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace EVP {

namespace {

  /// All pairs of a block whose laws share the powers P.
  template <class P, bool Many, bool Damping, bool Energy>
  EVP_INLINE void evaluate(const BlockLaw &law, Block &block)
  {
    const P powers;
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const int *const kind = block.kind;
    const double of_new = block.margin_removed[0], of_bond = block.margin_removed[1];
    const int n = block.n;
    const Law::Constants only = law.constants[0];
    const Law::Constants *own[Many ? Block::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many)
      for (int k = 0; k < n; k++) own[k] = &law.constants[kind[k] >> 1];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Law::Constants &c = Many ? *own[k] : only;
      const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
      const double dsq = x * x + y * y + z * z;
      const double d = std::sqrt(dsq);
      const double r = d * inv_deq[k];
      const auto at = c.point(r);

      // 1/d and s = 1/(r - offset) from one division
      const double w = 1.0 / (at.shifted * d);
      const double s = w * d;
      const double inv_d = w * at.shifted;
      const PowerPair q = powers(s);

      double f = c.force(at, s, q) * (inv_deq[k] * inv_d);
      if constexpr (Damping) f -= c.gamma * block.approach[k] * (inv_d * inv_d);
      block.force[k] = dsq > cutsq[k] ? 0.0 : f;

      if constexpr (Energy) {
        const double rc = std::sqrt(cutsq[k]) * inv_deq[k] * (kind[k] & 1 ? of_bond : of_new);
        const auto cut = c.point(rc);
        const double e = c.energy(at, q) - c.energy(cut, powers(1.0 / cut.shifted));
        block.energy[k] = dsq > cutsq[k] ? 0.0 : e;
      }
    }
  }

  /// Laws with exponents of their own, or others than the fixed ones: pair by pair.
  template <bool Damping, bool Energy> void evaluate_any(const BlockLaw &law, Block &block)
  {
    for (int k = 0; k < block.n; k++) {
      const double *const xy = block.xy + 2 * k;
      const double dsq = xy[0] * xy[0] + xy[1] * xy[1] + block.z[k] * block.z[k];
      block.force[k] = block.energy[k] = 0.0;
      if (dsq > block.cutsq[k]) continue;
      const Law &own = law.laws[block.kind[k] >> 1];
      const double d = std::sqrt(dsq), inv_deq = block.inv_deq[k];
      block.force[k] = own.force(d * inv_deq, 1.0) * inv_deq / d;
      if constexpr (Damping) block.force[k] -= own.parameters().gamma * block.approach[k] / dsq;
      if constexpr (Energy)
        block.energy[k] = own.energy(d * inv_deq, 1.0,
                                     std::sqrt(block.cutsq[k]) * inv_deq *
                                         block.margin_removed[block.kind[k] & 1]);
    }
  }

  template <class P, bool Many, bool Damping, bool Energy>
  void evaluate_at_level(const BlockLaw &law, Block &block)
  {
    if constexpr (std::is_same_v<P, AnyPowers>)
      evaluate_any<Damping, Energy>(law, block);
    else
      call_at(law.level, [&]() EVP_KERNEL {
        evaluate<P, Many, Damping, Energy>(law, block);
      });
  }

  template <class P, bool Many>
  void choose(const BlockLaw &law, Block &block, bool damping, bool energy)
  {
    if (damping)
      (energy ? evaluate_at_level<P, Many, true, true>
              : evaluate_at_level<P, Many, true, false>) (law, block);
    else
      (energy ? evaluate_at_level<P, Many, false, true>
              : evaluate_at_level<P, Many, false, false>) (law, block);
  }

}    // namespace

void BlockLaw::assign(const std::vector<Law> &laws_in, const std::vector<int> &used, Level level_in)
{
  level = level_in;
  laws = laws_in.data();
  constants.clear();
  function = choose<AnyPowers, true>;
  if (used.empty()) return;    // no pair to go over

  const Row &row = laws[used.front()].parameters();
  bool alike = true, common_powers = true;
  for (const int k : used) {
    const Row &own = laws[k].parameters();
    alike = alike && own == row;
    common_powers = common_powers && own.m1 == row.m1 && own.n1 == row.n1 && own.m2 == row.m1 &&
        own.n2 == row.n1;
  }
  if (alike)
    constants.push_back(laws[used.front()].constants());
  else
    for (const Law &law : laws_in) constants.push_back(law.constants());

  with_powers(common_powers ? row.m1 : 0.0, row.n1, [&](auto powers) {
    using P = decltype(powers);
    function = alike ? choose<P, false> : choose<P, true>;
  });
}

}    // namespace EVP
