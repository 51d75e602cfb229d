// SPDX-License-Identifier: GPL-2.0-only

#include "core/block_law.h"
#include "core/pair_list.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace EVP {

namespace {

  /// 1/d, s = 1/e and 1/(1 + p) from one division.
  struct Reciprocals {
    double inv_d, s, s_flow;
    EVP_INLINE Reciprocals(double d, double e, double flow)
    {
      const double w = 1.0 / (e * flow * d);
      s = w * (flow * d);
      s_flow = w * (e * d);
      inv_d = w * (e * flow);
    }
  };

  /// Pairs whose flow stays, of laws that share the powers P.
  template <class P, bool Many, bool Damping, bool Energy>
  EVP_INLINE void evaluate_flow(const BlockLaw &law, Block &block)
  {
    const P powers;
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const int *const kind = block.kind;
    const double *const offset = block.offset;
    double *const next_offset = block.next_offset;
    const int n = block.n;
    const Law::Constants only = law.constants[0];
    const Law::Constants *own[Many ? Block::SIZE : 1];
    if constexpr (Many)
      for (int k = 0; k < n; k++) own[k] = &law.constants[kind[k] >> 1];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Law::Constants &c = Many ? *own[k] : only;
      const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
      const double dsq = x * x + y * y + z * z;
      const bool is_bond = kind[k] & 1, is_beyond = dsq > cutsq[k];
      const double d = std::sqrt(is_beyond ? cutsq[k] : dsq);    // so far a bond flows
      const double p = offset[k];
      const double flowed = c.flowed(d * inv_deq[k], p);
      const double e = d * inv_deq[k] - flowed;
      const Reciprocals one_over(d, e, 1.0 + flowed);
      const PowerPair q = powers(one_over.s), q_flow = powers(one_over.s_flow);

      const bool repels_only = !is_bond && only_repels(cutsq[k], inv_deq[k]);
      double f = c.force(one_over.s, q, one_over.s_flow, q_flow);
      f = repels_only && f < 0.0 ? 0.0 : f;
      f *= inv_deq[k] * one_over.inv_d;
      if constexpr (Damping) f -= c.gamma * block.approach[k] * (one_over.inv_d * one_over.inv_d);
      block.force[k] = is_beyond ? 0.0 : f;

      const double kept = c.kept(flowed, p, is_bond, repels_only);
      next_offset[k] = is_beyond && !is_bond ? CONTACT_ENDED : kept;
    }
    if constexpr (Energy)
      for (int k = 0; k < n; k++) block.energy[k] = law.flow_energy(block, k);
  }

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

  /// Pairs whose flow stays, of any laws, one by one.
  template <bool Damping, bool Energy> void evaluate_any_flow(const BlockLaw &law, Block &block)
  {
    for (int k = 0; k < block.n; k++) {
      const double dsq = block.distance_squared(k), p = block.offset[k];
      const bool is_bond = block.kind[k] & 1;
      const bool is_beyond = dsq > block.cutsq[k];
      const Law &own = law.laws[block.kind[k] >> 1];
      const double d = std::sqrt(is_beyond ? block.cutsq[k] : dsq), inv_deq = block.inv_deq[k];
      const bool repels_only = !is_bond && only_repels(block.cutsq[k], inv_deq);
      const double flowed = own.flowed(d * inv_deq, 1.0, p);
      block.next_offset[k] = is_beyond && !is_bond ? CONTACT_ENDED
                                                   : own.kept(flowed, p, is_bond, repels_only);
      block.force[k] = 0.0;
      if constexpr (Energy) block.energy[k] = law.flow_energy(block, k);
      if (is_beyond) continue;
      const double f = own.flow_force(d * inv_deq, 1.0, flowed);
      if (!(repels_only && f < 0.0)) block.force[k] = f * inv_deq / d;
      if constexpr (Damping) block.force[k] -= own.parameters().gamma * block.approach[k] / dsq;
    }
  }

  /// Laws with exponents of their own, or others than the fixed ones: pair by pair.
  template <bool Damping, bool Energy> void evaluate_any(const BlockLaw &law, Block &block)
  {
    for (int k = 0; k < block.n; k++) {
      const double dsq = block.distance_squared(k);
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

  template <class P, bool Many, bool Flow, bool Damping, bool Energy>
  void evaluate_at_level(const BlockLaw &law, Block &block)
  {
    if constexpr (std::is_same_v<P, AnyPowers>)
      (Flow ? evaluate_any_flow<Damping, Energy> : evaluate_any<Damping, Energy>) (law, block);
    else
      call_at(law.level, [&]() EVP_KERNEL {
        if constexpr (Flow)
          evaluate_flow<P, Many, Damping, Energy>(law, block);
        else
          evaluate<P, Many, Damping, Energy>(law, block);
      });
  }

  template <class P, bool Many, bool Flow>
  void choose(const BlockLaw &law, Block &block, bool damping, bool energy)
  {
    if (damping)
      (energy ? evaluate_at_level<P, Many, Flow, true, true>
              : evaluate_at_level<P, Many, Flow, true, false>) (law, block);
    else
      (energy ? evaluate_at_level<P, Many, Flow, false, true>
              : evaluate_at_level<P, Many, Flow, false, false>) (law, block);
  }

}    // namespace

double BlockLaw::flow_energy(const Block &block, int k) const
{
  const double dsq = block.distance_squared(k);
  if (dsq > block.cutsq[k] && !block.incremental) return 0.0;
  const int bond = block.kind[k] & 1;
  const double inv_deq = block.inv_deq[k];
  const double rc = std::sqrt(block.cutsq[k]) * inv_deq * block.margin_removed[bond];
  return laws[block.kind[k] >> 1].flow_energy(
      std::min(std::sqrt(dsq) * inv_deq, rc), 1.0, block.offset[k], rc, bond,
      !bond && only_repels(block.cutsq[k], inv_deq), block.incremental);
}

void BlockLaw::assign(const std::vector<Law> &laws_in, const std::vector<int> &used, bool flows,
                      Level level_in)
{
  level = level_in;
  laws = laws_in.data();
  constants.clear();
  function = flows ? choose<AnyPowers, true, true> : choose<AnyPowers, true, false>;
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
    if (flows)
      function = alike ? choose<P, false, true> : choose<P, true, true>;
    else
      function = alike ? choose<P, false, false> : choose<P, true, false>;
  });
}

}    // namespace EVP
