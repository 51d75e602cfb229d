// SPDX-License-Identifier: GPL-2.0-only

#include "core/block_energy.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace EVP {

// N: power of all laws, see Law::stored_power(); Many: of several laws; Flows: with offsets; Damps: damping is asked for
namespace {

  using Form = StoredForm;
  using Pairs = BlockEnergy::Pairs;
  using Values = BlockEnergy::Values;

  /// The offset that the force of a pair is evaluated with: its elastic part is within xi_s.
  EVP_INLINE double mapped(double p, double xi, double xi_s)
  {
    return std::min(std::max(p, xi - xi_s), xi + xi_s);
  }

  /// Pairs one by one, laws with any exponents.
  void evaluate_any(const BlockEnergy &own, const Block &block, const Pairs &pairs, bool damps,
                    Values &values)
  {
    for (int k = 0; k < block.n; k++) {
      const double dsq = block.distance_squared(k);
      const bool beyond = dsq > block.cutsq[k];
      const PairWeight weight(pairs.weight[k]);
      values.first[k] = values.second[k] = values.contacts[k] = 0.0;
      values.hardening[k] = values.plastic[k] = values.damping[k] = 0.0;
      values.passes[k] = beyond == weight.was_beyond ? 0.0 : 1.0;
      const Law &law = own.laws[block.kind[k] >> 1];
      if (own.flows && !(beyond && !weight.is_bond) &&
          block.flow.next_offset[k] != block.flow.offset[k])    // a bond flows up to its cut-off
        values.plastic[k] = weight.size *
            std::max(0.0, law.dissipated(block.flow.offset[k], block.flow.next_offset[k]));
      if (beyond) continue;
      const double d = std::sqrt(dsq), deq = pairs.deq[k], w = weight.size;
      if (damps) values.damping[k] = -law.parameters().gamma * block.approach[k] / dsq;
      if (!own.flows) {
        const Stored now = law.stored(d, deq);
        if (weight.is_bond) {
          values.first[k] = w * now.first;
          values.second[k] = w * now.second;
        } else
          values.contacts[k] = w * now.total();
        continue;
      }
      const double p = mapped(block.flow.offset[k], (d - deq) / deq, law.parameters().xi_s);
      if (weight.is_bond) {
        const Stored now = law.stored(d, deq, p);
        values.first[k] = w * now.first;
        values.hardening[k] = w * now.hardening;
      } else    // a stretched one has followed eq. 8 from an offset of 0
        values.contacts[k] = w * (p > 0.0 ? law.stored(d, deq) : law.stored(d, deq, p)).total();
    }
  }

  template <int N, bool Many, bool Flows, bool Damps>
  EVP_INLINE void evaluate(const BlockEnergy &own, const Block &block, const Pairs &pairs,
                           Values &values)
  {
    const int n = block.n;
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const double *const deq = pairs.deq;
    const double *const kept = pairs.weight;
    const double *const offset = block.flow.offset;
    const double *const next = block.flow.next_offset;
    const Form only = own.forms[0];
    const Form *form[Many ? Block::SIZE : 1];
    if constexpr (Many)
      for (int k = 0; k < n; k++) form[k] = &own.forms[block.kind[k] >> 1];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Form &c = Many ? *form[k] : only;
      const double dsq = block.distance_squared(k);
      const double xi = (std::sqrt(dsq) - deq[k]) * inv_deq[k];
      // selects of constants, and arithmetic: compilers make branches of others
      const double size = std::fabs(kept[k]);
      const double inside = dsq > cutsq[k] ? 0.0 : 1.0;
      const double was_beyond = size >= PairWeight::BEYOND ? 1.0 : 0.0;
      values.passes[k] = std::fabs(1.0 - inside - was_beyond);
      const double w = inside * (size - PairWeight::BEYOND * was_beyond);
      const double of_bond = std::max(std::copysign(w, kept[k]), 0.0);
      if constexpr (!Flows) {
        const auto at = c.point(xi);
        // 1/(1 + strain) and 1/d^2 from one division
        const double both = 1.0 / ((1.0 + at.strain) * (Damps ? dsq : 1.0));
        if constexpr (Damps)
          values.damping[k] = -inside * c.gamma * block.approach[k] * (both * (1.0 + at.strain));
        const Stored now = c.template stored<N>(at, Damps ? both * dsq : both);
        values.first[k] = of_bond * now.first;
        values.second[k] = of_bond * now.second;
        values.contacts[k] = (w - of_bond) * (now.first + now.second);
      } else {
        if constexpr (Damps) values.damping[k] = -inside * c.gamma * block.approach[k] / dsq;
        const double p = mapped(offset[k], xi, c.xi_s);
        const double elastic = std::min(std::max(xi - offset[k], -c.xi_s), c.xi_s);
        const auto now = c.template stored_after_flow<N>(elastic, p);
        values.first[k] = of_bond * now.first;
        values.hardening[k] = of_bond * now.hardening;
        values.contacts[k] = (w - of_bond) * now.contact;
      }
    }

    if constexpr (Flows) {
      if (std::memcmp(offset, next, n * sizeof(double)) == 0)
        std::fill_n(values.plastic, n, 0.0);
      else {
        EVP_INDEPENDENT
        for (int k = 0; k < n; k++) {
          const Form &c = Many ? *form[k] : only;
          const bool ended = block.distance_squared(k) > cutsq[k] && kept[k] < 0.0;
          const double w = ended ? 0.0
                                 : PairWeight(kept[k]).size;    // a bond flows up to its cut-off
          values.plastic[k] = w * c.template dissipated<N>(offset[k], next[k]);
        }
      }
    }
  }

  /// Contacts that have flowed, which are few, pair by pair: one that only repels holds what it has
  /// where its force vanishes from there to its end, where that is lost; up to its end it flows back.
  void mend_contacts(const BlockEnergy &own, const Block &block, const Pairs &pairs, Values &values,
                     double &ended)
  {
    const double *const kept = pairs.weight;
    const double *const offset = block.flow.offset;
    int count = 0;
    for (int k = 0; k < block.n; k++) count += (int) (kept[k] < 0.0) & (int) (offset[k] != 0.0);
    for (int k = 0; count && k < block.n; k++) {
      if (kept[k] > 0.0 || offset[k] == 0.0) continue;
      const Law &law = own.laws[block.kind[k] >> 1];
      const double cap = block.flow.cap[k], xi_s = law.parameters().xi_s;
      const double w = PairWeight(kept[k]).size, deq = pairs.deq[k];
      const bool has_ended = block.distance_squared(k) > block.cutsq[k];
      const double d = has_ended ? std::sqrt(block.cutsq[k]) * block.margin_removed[0]
                                 : std::sqrt(block.distance_squared(k));
      const double xi = (d - deq) / deq, flowed = mapped(offset[k], xi, xi_s);
      const double p = law.kept(flowed, offset[k], cap);
      if (has_ended) values.plastic[k] = w * std::max(0.0, law.dissipated(offset[k], p));
      if (cap >= 0.0) continue;
      if (has_ended)
        ended += w * law.locked(p);
      else if (law.flow_force(1.0 + xi, 1.0, flowed) < 0.0)
        values.contacts[k] = w * law.locked(p);
    }
  }

  template <int N, bool Many, bool Flows>
  void evaluate_at_level(const BlockEnergy &own, const Block &block, const Pairs &pairs, bool damps,
                         Values &values)
  {
    call_at(own.level, [&]() EVP_KERNEL {
      if (damps)
        evaluate<N, Many, Flows, true>(own, block, pairs, values);
      else
        evaluate<N, Many, Flows, false>(own, block, pairs, values);
    });
  }

  void depths_any(const BlockEnergy &own, const PairList &list, const Pairs &pairs, double *depths)
  {
    for (size_t k = 0; k < list.pairs.size(); k++) {
      const PackedPair pair = list.pairs[k];
      const Law &law = own.laws[pair.law];
      const double deq = pairs.deq[k];
      const double flown = (pair.cut - deq) / deq - law.parameters().xi_s;
      const bool has_flown = own.flows && pair.is_bond() && flown > 0.0;
      depths[k] = PairWeight(pairs.weight[k]).size *
          (has_flown ? law.stored(pair.cut, deq, flown) : law.stored(pair.cut, deq)).total();
    }
  }

  template <int N, bool Many>
  EVP_INLINE void depths(const BlockEnergy &own, const PairList &list, const Pairs &pairs,
                         double *out)
  {
    const int n = (int) list.pairs.size();
    const double *const inv_deq = list.pairs.inv_deq.data();
    const double *const cutsq = list.pairs.cutsq.data();
    const int *const kind = list.pairs.kind.data();
    const double *const deq = pairs.deq;
    const double *const kept = pairs.weight;
    const double of_new = list.pairs.margin_removed[0], of_bond = list.pairs.margin_removed[1];
    const double flows = own.flows ? 1.0 : 0.0;
    const Form *const forms = own.forms.data();
    const Form only = forms[0];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Form &c = Many ? forms[kind[k] >> 1] : only;
      const double is_bond = kept[k] > 0.0 ? 1.0 : 0.0, is_new = 1.0 - is_bond;
      const double cut = std::sqrt(cutsq[k]) * (is_bond * of_bond + is_new * of_new);
      const double xi = (cut - deq[k]) * inv_deq[k];
      const Stored all = c.template stored<N>(xi);
      const double flown = std::max(xi - c.xi_s, 0.0);
      const auto after_flow = c.template stored_after_flow<N>(xi - flown, flown);
      const double flowing = flows * is_bond;
      out[k] = (std::fabs(kept[k]) - PairWeight::BEYOND) *
          (flowing * (after_flow.first + after_flow.hardening) + (1.0 - flowing) * all.total());
    }
  }

  template <int N, bool Many>
  void depths_at_level(const BlockEnergy &own, const PairList &list, const Pairs &pairs,
                       double *out)
  {
    call_at(own.level, [&]() EVP_KERNEL {
      depths<N, Many>(own, list, pairs, out);
    });
  }

}    // namespace

void BlockEnergy::assign(const PairList &list, const BlockLaw &law, bool flows_in)
{
  laws = law.laws;
  level = law.level;
  flows = flows_in;
  forms.clear();
  evaluate = evaluate_any;
  depths_of = depths_any;

  std::vector<bool> used;    // by index of a law: do pairs have it?
  for (size_t k = 0; k < list.pairs.size(); k++) {
    const size_t own = list.pairs.kind[k] >> 1;
    if (own >= used.size()) used.resize(own + 1);
    used[own] = true;
  }
  if (used.empty()) return;    // no pair to go over
  const bool many = std::count(used.begin(), used.end(), true) > 1;
  const size_t last = used.size() - 1;
  const int power = laws[last].stored_power();
  bool common = true;
  for (size_t k = 0; k <= last; k++) {
    if (used[k]) common = common && laws[k].stored_power() == power;
    if (many || k == last) forms.push_back(laws[k].stored_form());
  }
  const auto choose = [&](auto n) {
    constexpr int N = decltype(n)::value;
    if (!common || power != N) return;
    if (flows)
      evaluate = many ? evaluate_at_level<N, true, true> : evaluate_at_level<N, false, true>;
    else
      evaluate = many ? evaluate_at_level<N, true, false> : evaluate_at_level<N, false, false>;
    depths_of = many ? depths_at_level<N, true> : depths_at_level<N, false>;
  };
  choose(std::integral_constant<int, 1>());
  choose(std::integral_constant<int, 2>());
  choose(std::integral_constant<int, 3>());
  choose(std::integral_constant<int, 4>());
  choose(std::integral_constant<int, 6>());
}

void BlockEnergy::operator()(const Block &block, const Pairs &pairs, bool damps, Values &values,
                             double &ended) const
{
  evaluate(*this, block, pairs, damps, values);
  if (flows && !block.only_bonds()) mend_contacts(*this, block, pairs, values, ended);
}

double BlockEnergy::beside_depth(const PackedPair &pair, double p) const
{
  const Law &law = laws[pair.law];
  const double r = pair.cut * pair.inv_deq;
  if (!flows || r - 1.0 >= law.parameters().xi_s) return 0.0;
  return law.stored(r, 1.0, law.flowed(r, 1.0, p)).total() - law.stored(r, 1.0).total();
}

}    // namespace EVP
