// SPDX-License-Identifier: GPL-2.0-only

#include "core/block_law.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace EVP {

namespace {

  /// Caps of a block of bonds, which need not be read from the list.
  struct BondCaps {
    double values[Block::SIZE];
    BondCaps() { std::fill_n(values, Block::SIZE, BOND_CAP); }
  };
  const BondCaps BOND_CAPS;

  /// Energy of pair k of a block whose flow stays, 0 beyond its cut.
  double flow_energy(const BlockLaw &law, const Block &block, int k)
  {
    const double d = std::sqrt(block.distance_squared(k)), inv_deq = block.inv_deq[k];
    const int bond = block.kind[k] & 1;
    if (d * d > block.cutsq[k] && !block.incremental) return 0.0;
    if (block.cutsq[k] == 0.0) return 0.0;    // broken, and no contacts act
    const double rc = std::sqrt(block.cutsq[k]) * inv_deq * block.margin_removed[bond];
    return law.laws[block.kind[k] >> 1].flow_energy(std::min(d * inv_deq, rc), 1.0,
                                                    block.flow.offset[k], rc, block.flow.cap[k],
                                                    block.incremental);
  }

  // a contact ends, or has an energy of its own
  template <bool Energy> void mend_contact(const BlockLaw &law, Block &block, int k)
  {
    const FlowArrays &flow = block.flow;
    if constexpr (Energy) block.energy[k] = flow_energy(law, block, k);
    if (*flow.moves && has_ended(flow.next_offset[k])) flow.spent[k] = -flow.work[k];
  }

  /// Pairs whose flow stays, of laws that share the powers P. Mostly none flows: what is spent comes last.
  template <class P, bool Many, bool Damping, bool Energy, bool Axial>
  EVP_INLINE void evaluate_flow(const BlockLaw &law, Block &block)
  {
    const P powers;
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const int *const kind = block.kind;
    const FlowArrays flow = block.flow;
    const int n = block.n;
    const double incremental = block.incremental, of_bond = block.margin_removed[1];
    const bool has_contacts = !block.only_bonds();
    const double *const caps = has_contacts ? flow.cap : BOND_CAPS.values;
    const LawConstants only = law.constants[0];
    const LawConstants *own[Many ? Block::SIZE : 1];
    if constexpr (Many)
      for (int k = 0; k < n; k++) own[k] = &law.constants[kind[k] >> 1];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const LawConstants &c = Many ? *own[k] : only;
      const double dsq = block.distance_squared(k);
      const double d = std::sqrt(dsq > cutsq[k] ? cutsq[k] : dsq);    // so far a bond flows
      const double cap = caps[k];
      const double r = d * inv_deq[k];
      const double flowed = c.flowed(r, flow.offset[k]);
      const double after = 1.0 + flowed, e = r - flowed;

      // all reciprocals from one division
      const double ed = e * d, w = 1.0 / (ed * after);
      const double s = w * d * after, inv_d = w * e * after, s_after = w * ed;
      const PowerPair q = powers(s), q_after = powers(s_after);

      double f = c.first_force(s, q) + c.flow_force(s_after, q_after);
      f = cap < 0.0 ? (f < 0.0 ? 0.0 : f) : f;
      f *= inv_deq[k] * inv_d;
      if constexpr (Axial) f += block.axial[k] * inv_d;
      if constexpr (Damping) f -= c.gamma * block.approach[k] * (inv_d * inv_d);
      block.force[k] = dsq > cutsq[k] ? 0.0 : f;

      const double kept = c.kept(flowed, flow.offset[k], cap);
      const double ended = cap < BOND_CAP ? CONTACT_ENDED : kept;
      flow.next_offset[k] = dsq > cutsq[k] ? ended : kept;

      if constexpr (Energy) {
        const double rc = std::sqrt(cutsq[k]) * inv_deq[k] * of_bond;
        const double from = incremental * flow.offset[k] + (1.0 - incremental) * flowed;
        const double at_cut = c.flowed(rc, from), s_cut = 1.0 / (rc - at_cut);
        const double s_flow = 1.0 / (1.0 + at_cut);
        const double stored = c.energy(e, q, s_after, q_after) -
            c.energy(rc - at_cut, powers(s_cut), s_flow, powers(s_flow));
        block.energy[k] = dsq > cutsq[k] ? 0.0 : stored;
      }
    }

    const bool moves = std::memcmp(flow.offset, flow.next_offset, n * sizeof(double)) != 0;
    *flow.moves = moves;
    if (moves) {
      EVP_INDEPENDENT
      for (int k = 0; k < n; k++) {
        const LawConstants &c = Many ? *own[k] : only;
        const double p0 = flow.offset[k], p1 = flow.next_offset[k];
        const double both = 1.0 / ((1.0 + p0) * (1.0 + p1));
        const double s0 = both * (1.0 + p1), s1 = both * (1.0 + p0);
        flow.spent[k] =
            c.dissipated(p0, c.flow_force(s0, powers(s0)), p1, c.flow_force(s1, powers(s1)));
        if constexpr (Energy) block.energy[k] += incremental * flow.spent[k];
      }
    }
    if (!has_contacts) return;
    for (int k = 0; k < n; k++)
      if (!(kind[k] & 1)) mend_contact<Energy>(law, block, k);
  }

  /// All pairs of a block whose laws share the powers P.
  template <class P, bool Many, bool Damping, bool Energy, bool Axial>
  EVP_INLINE void evaluate(const BlockLaw &law, Block &block)
  {
    const P powers;
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const int *const kind = block.kind;
    const double of_new = block.margin_removed[0], of_bond = block.margin_removed[1];
    const int n = block.n;
    const LawConstants only = law.constants[0];
    const LawConstants *own[Many ? Block::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many)
      for (int k = 0; k < n; k++) own[k] = &law.constants[kind[k] >> 1];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const LawConstants &c = Many ? *own[k] : only;
      const double dsq = block.distance_squared(k);
      const double d = std::sqrt(dsq);
      const double r = d * inv_deq[k];
      const auto at = c.point(r);

      // 1/d and s = 1/(r - offset) from one division
      const double w = 1.0 / (at.shifted * d);
      const double s = w * d;
      const double inv_d = w * at.shifted;
      const PowerPair q = powers(s);

      double f = c.force(at, s, q) * (inv_deq[k] * inv_d);
      if constexpr (Axial) f += block.axial[k] * inv_d;
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
  template <bool Damping, bool Energy, bool Axial>
  void evaluate_any_flow(const BlockLaw &law, Block &block)
  {
    const FlowArrays &flow = block.flow;
    for (int k = 0; k < block.n; k++) {
      const bool is_bond = block.kind[k] & 1,
                 is_beyond = block.distance_squared(k) > block.cutsq[k];
      const Law &own = law.laws[block.kind[k] >> 1];
      const double p = flow.offset[k], inv_deq = block.inv_deq[k];
      const double d = std::sqrt(std::min(block.distance_squared(k), block.cutsq[k]));
      const double flowed = own.flowed(d * inv_deq, 1.0, p);
      const double kept = own.kept(flowed, p, flow.cap[k]);
      flow.next_offset[k] = is_beyond && !is_bond ? CONTACT_ENDED : kept;
      flow.spent[k] = is_beyond && !is_bond ? -flow.work[k] : own.dissipated(p, kept);
      *flow.moves = true;
      if constexpr (Energy) block.energy[k] = flow_energy(law, block, k);
      block.force[k] = 0.0;
      if (is_beyond) continue;
      const double f = own.flow_force(d * inv_deq, 1.0, flowed);
      if (!(flow.cap[k] < 0.0 && f < 0.0)) block.force[k] = f * inv_deq / d;
      if constexpr (Axial) block.force[k] += block.axial[k] / d;
      if constexpr (Damping) block.force[k] -= own.parameters().gamma * block.approach[k] / (d * d);
    }
  }

  /// Laws with exponents of their own, or others than the fixed ones: pair by pair.
  template <bool Damping, bool Energy, bool Axial>
  void evaluate_any(const BlockLaw &law, Block &block)
  {
    for (int k = 0; k < block.n; k++) {
      const double dsq = block.distance_squared(k);
      block.force[k] = block.energy[k] = 0.0;
      if (dsq > block.cutsq[k]) continue;
      const Law &own = law.laws[block.kind[k] >> 1];
      const double d = std::sqrt(dsq), inv_deq = block.inv_deq[k];
      block.force[k] = own.force(d * inv_deq, 1.0) * inv_deq / d;
      if constexpr (Axial) block.force[k] += block.axial[k] / d;
      if constexpr (Damping) block.force[k] -= own.parameters().gamma * block.approach[k] / dsq;
      if constexpr (Energy)
        block.energy[k] = own.energy(d * inv_deq, 1.0,
                                     std::sqrt(block.cutsq[k]) * inv_deq *
                                         block.margin_removed[block.kind[k] & 1]);
    }
  }

  template <class P, bool Many, bool Flow, bool Damping, bool Energy, bool Axial>
  void evaluate_at_level(const BlockLaw &law, Block &block)
  {
    if constexpr (std::is_same_v<P, AnyPowers>)
      (Flow ? evaluate_any_flow<Damping, Energy, Axial>
            : evaluate_any<Damping, Energy, Axial>) (law, block);
    else
      call_at(law.level, [&]() EVP_KERNEL {
        if constexpr (Flow)
          evaluate_flow<P, Many, Damping, Energy, Axial>(law, block);
        else
          evaluate<P, Many, Damping, Energy, Axial>(law, block);
      });
  }

  template <class P, bool Many, bool Flow>
  void choose(const BlockLaw &law, Block &block, const BlockLaw::Asked &asked)
  {
    const auto with = [&](auto damping, auto energy) {
      (asked.axial ? evaluate_at_level<P, Many, Flow, damping, energy, true>
                   : evaluate_at_level<P, Many, Flow, damping, energy, false>) (law, block);
    };
    using std::true_type, std::false_type;
    if (asked.damping)
      asked.energy ? with(true_type(), true_type()) : with(true_type(), false_type());
    else
      asked.energy ? with(false_type(), true_type()) : with(false_type(), false_type());
  }

}    // namespace

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
