// SPDX-License-Identifier: GPL-2.0-only

#include "core/stored_energy.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace EVP {

/// The loops over pairs. N: power of all laws, see Law::stored_power(); Many: of several laws; Flows:
/// with offsets; Damps: damping is asked for.
struct StoredBlocks {
  using Form = StoredForm;
  using Pairs = StoredEnergy::Pairs;

  // added to the weight of a pair that was beyond its cut-off
  static constexpr double BEYOND = 2.0;

  /// A weight as it is kept.
  struct Weight {
    bool is_bond, was_beyond;
    double size;
    EVP_INLINE explicit Weight(double kept) :
        is_bond(kept > 0.0), was_beyond(std::fabs(kept) >= BEYOND),
        size(was_beyond ? std::fabs(kept) - BEYOND : std::fabs(kept))
    {
    }
  };

  /// The offset that the force of a pair is evaluated with: its elastic part is within xi_s.
  EVP_INLINE static double mapped(double p, double xi, double xi_s)
  {
    return std::min(std::max(p, xi - xi_s), xi + xi_s);
  }

  /// Pairs one by one, laws with any exponents.
  static void evaluate_any(StoredEnergy &own, const Block &block, const Pairs &pairs, bool damps)
  {
    StoredEnergy::Values &values = own.values;
    for (int k = 0; k < block.n; k++) {
      const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
      const double dsq = x * x + y * y + z * z;
      const bool beyond = dsq > block.cutsq[k];
      const Weight weight(pairs.weight[k]);
      values.first[k] = values.second[k] = values.contacts[k] = 0.0;
      values.hardening[k] = values.plastic[k] = values.damping[k] = 0.0;
      values.passes[k] = beyond == weight.was_beyond ? 0.0 : 1.0;
      const Law &law = own.laws[block.kind[k] >> 1];
      if (own.flows && !(beyond && !weight.is_bond) &&
          pairs.flow.next[k] != pairs.flow.offset[k])    // a bond flows up to its cut-off
        values.plastic[k] =
            weight.size * std::max(0.0, law.dissipated(pairs.flow.offset[k], pairs.flow.next[k]));
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
      const double p = mapped(pairs.flow.offset[k], (d - deq) / deq, law.parameters().xi_s);
      if (weight.is_bond) {
        const Stored now = law.stored(d, deq, p);
        values.first[k] = w * now.first;
        values.hardening[k] = w * now.hardening;
      } else    // a stretched one has followed eq. 8 from an offset of 0
        values.contacts[k] = w * (p > 0.0 ? law.stored(d, deq) : law.stored(d, deq, p)).total();
    }
  }

  template <int N, bool Many, bool Flows, bool Damps>
  EVP_INLINE static void evaluate(StoredEnergy &own, const Block &block, const Pairs &pairs)
  {
    StoredEnergy::Values &values = own.values;
    const int n = block.n;
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const double *const deq = pairs.deq;
    const double *const kept = pairs.weight;
    const double *const offset = pairs.flow.offset;
    const double *const next = pairs.flow.next;
    const Form only = own.forms[0];
    const Form *form[Many ? Block::SIZE : 1];
    if constexpr (Many)
      for (int k = 0; k < n; k++) form[k] = &own.forms[block.kind[k] >> 1];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Form &c = Many ? *form[k] : only;
      const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
      const double dsq = x * x + y * y + z * z;
      const double xi = (std::sqrt(dsq) - deq[k]) * inv_deq[k];
      // selects of constants, and arithmetic: compilers make branches of others
      const double size = std::fabs(kept[k]);
      const double inside = dsq > cutsq[k] ? 0.0 : 1.0, was_beyond = size >= BEYOND ? 1.0 : 0.0;
      values.passes[k] = std::fabs(1.0 - inside - was_beyond);
      const double w = inside * (size - BEYOND * was_beyond);
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
          const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
          const bool ended = x * x + y * y + z * z > cutsq[k] && kept[k] < 0.0;
          const double w = ended ? 0.0 : Weight(kept[k]).size;    // a bond flows up to its cut-off
          values.plastic[k] = w * c.template dissipated<N>(offset[k], next[k]);
        }
      }
    }
  }

  /// Contacts that have flowed, which are few, pair by pair: one that only repels holds what it has
  /// where its force vanishes from there to its end, where that is lost; up to its end it flows back.
  static void mend_contacts(StoredEnergy &own, const Block &block, const Pairs &pairs)
  {
    const double *const kept = pairs.weight;
    const double *const offset = pairs.flow.offset;
    int count = 0;
    for (int k = 0; k < block.n; k++) count += (int) (kept[k] < 0.0) & (int) (offset[k] != 0.0);
    for (int k = 0; count && k < block.n; k++) {
      if (kept[k] > 0.0 || offset[k] == 0.0) continue;
      const Law &law = own.laws[block.kind[k] >> 1];
      const double cap = pairs.flow.cap[k], xi_s = law.parameters().xi_s;
      const double w = Weight(kept[k]).size, deq = pairs.deq[k];
      const bool has_ended = block.distance_squared(k) > block.cutsq[k];
      const double d = has_ended ? std::sqrt(block.cutsq[k]) * block.margin_removed[0]
                                 : std::sqrt(block.distance_squared(k));
      const double xi = (d - deq) / deq, flowed = mapped(offset[k], xi, xi_s);
      const double p = law.kept(flowed, offset[k], cap);
      if (has_ended) own.values.plastic[k] = w * std::max(0.0, law.dissipated(offset[k], p));
      if (cap >= 0.0) continue;
      if (has_ended)
        own.ended += w * law.locked(p);
      else if (law.flow_force(1.0 + xi, 1.0, flowed) < 0.0)
        own.values.contacts[k] = w * law.locked(p);
    }
  }

  EVP_INLINE static void add_up(StoredEnergy::LaneSums &found, const StoredEnergy::Values &values,
                                int n, bool flows)
  {
    add_to(found.first, n, values.first);
    add_to(found.contacts, n, values.contacts);
    found.passes = {};
    add_to(found.passes, n, values.passes);
    if (flows) {
      add_to(found.hardening, n, values.hardening);
      add_to(found.plastic, n, values.plastic);
    } else
      add_to(found.second, n, values.second);
  }
  EVP_INLINE static void add_to(LaneSum &sum, int n, const double *values)
  {
    sum.add(n, [values](int k) EVP_KERNEL {
      return values[k];
    });
  }

  template <int N, bool Many, bool Flows>
  static void evaluate_at_level(StoredEnergy &own, const Block &block, const Pairs &pairs,
                                bool damps)
  {
    call_at(own.level, [&]() EVP_KERNEL {
      if (damps)
        evaluate<N, Many, Flows, true>(own, block, pairs);
      else
        evaluate<N, Many, Flows, false>(own, block, pairs);
    });
  }

  static void depth_any(StoredEnergy &own, const PairList &list)
  {
    for (size_t n = 0; n < own.deq.size(); n++) {
      const PackedPair pair = list.pairs[n];
      const Law &law = own.laws[pair.law];
      const double flown = (pair.cut - own.deq[n]) / own.deq[n] - law.parameters().xi_s;
      const bool has_flown = own.flows && pair.is_bond() && flown > 0.0;
      own.depth[n] = Weight(own.weight[n]).size *
          (has_flown ? law.stored(pair.cut, own.deq[n], flown) : law.stored(pair.cut, own.deq[n]))
              .total();
    }
  }

  /// What a pair has stored where it passes its cut-off.
  template <int N, bool Many> EVP_INLINE static void depth(StoredEnergy &own, const PairList &list)
  {
    const int n = (int) own.deq.size();
    const double *const inv_deq = list.pairs.inv_deq.data();
    const double *const cutsq = list.pairs.cutsq.data();
    const int *const kind = list.pairs.kind.data();
    const double *const deq = own.deq.data();
    const double *const kept = own.weight.data();
    double *const out = own.depth.data();
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
      out[k] = (std::fabs(kept[k]) - BEYOND) *
          (flowing * (after_flow.first + after_flow.hardening) + (1.0 - flowing) * all.total());
    }
  }

  template <int N, bool Many> static void depth_at_level(StoredEnergy &own, const PairList &list)
  {
    call_at(own.level, [&]() EVP_KERNEL {
      depth<N, Many>(own, list);
    });
  }

  template <int N> static void choose(StoredEnergy &own, bool many)
  {
    if (own.flows)
      own.evaluate = many ? evaluate_at_level<N, true, true> : evaluate_at_level<N, false, true>;
    else
      own.evaluate = many ? evaluate_at_level<N, true, false> : evaluate_at_level<N, false, false>;
    own.find_depth = many ? depth_at_level<N, true> : depth_at_level<N, false>;
  }
};

void StoredEnergy::assign(const PairList &list, const BlockLaw &law, std::vector<double> deq_in,
                          int nreact, bool flows_in, bool breaks_in)
{
  breaks = breaks_in;
  build = list.build;
  is_new = true;
  flows = flows_in;
  deq = std::move(deq_in);
  // none is within its cut-off yet: the next evaluation adds the depths of those that are
  weight.resize(deq.size());
  for (size_t k = 0; k < deq.size(); k++)
    weight[k] = std::copysign(rank_share(list.pairs.j[k], nreact) + StoredBlocks::BEYOND,
                              list.pairs.kind[k] & 1 ? 1.0 : -1.0);
  bonds_depth = contacts_depth = {};
  choose(law, list);
  depth.resize(deq.size());
  find_depth(*this, list);
}

// the loops for the laws that the pairs have
void StoredEnergy::choose(const BlockLaw &law, const PairList &list)
{
  laws = law.laws;
  level = law.level;
  forms.clear();
  evaluate = StoredBlocks::evaluate_any;
  find_depth = StoredBlocks::depth_any;

  int least = 0, most = -1;
  for (size_t k = 0; k < deq.size(); k++) {
    const int own = list.pairs.kind[k] >> 1;
    if (most < 0) least = own;
    least = std::min(least, own);
    most = std::max(most, own);
  }
  if (most < 0) return;    // no pair to go over
  const bool many = least != most;
  std::vector<bool> used(most + 1);
  for (size_t k = 0; k < deq.size(); k++) used[list.pairs.kind[k] >> 1] = true;
  const int power = laws[most].stored_power();
  bool common = true;
  for (int k = 0; k <= most; k++) {
    if (used[k]) common = common && laws[k].stored_power() == power;
    if (many) forms.push_back(laws[k].stored_form());
  }
  if (!many) forms.push_back(laws[most].stored_form());
  if (!common) return;
  if (power == 1) StoredBlocks::choose<1>(*this, many);
  if (power == 2) StoredBlocks::choose<2>(*this, many);
  if (power == 3) StoredBlocks::choose<3>(*this, many);
  if (power == 4) StoredBlocks::choose<4>(*this, many);
  if (power == 6) StoredBlocks::choose<6>(*this, many);
}

void StoredEnergy::set_largest_depth(double sum)
{
  int exponent;
  std::frexp(sum, &exponent);
  unit = sum > 0.0 ? std::ldexp(1.0, exponent + 1) : 0.0;
  bonds_depth = contacts_depth = {};
  for (size_t k = 0; k < weight.size(); k++) {
    const StoredBlocks::Weight own(weight[k]);
    if (!own.was_beyond) add_depth(own.is_bond, depth[k], false);
  }
}

double StoredEnergy::beside_depth(const PackedPair &pair, double p) const
{
  const Law &law = laws[pair.law];
  const double r = pair.cut * pair.inv_deq;
  if (!flows || r - 1.0 >= law.parameters().xi_s) return 0.0;
  return law.stored(r, 1.0, law.flowed(r, 1.0, p)).total() - law.stored(r, 1.0).total();
}

void StoredEnergy::note_passed(const PairList &list, const double (*x)[3])
{
  if (!flows || breaks || is_due(list, flows)) return;
  for_each_pair(list, x, [&](const PlacedPair &p) {
    const StoredBlocks::Weight own(weight[p.index]);
    if (own.is_bond && p.is_beyond() != own.was_beyond)
      passed += (own.was_beyond ? -own.size : own.size) * beside_depth(p, p.offset);
  });
}

const StoredEnergy::Values &StoredEnergy::add(const PairList &list, const PairRange &range,
                                              const Block &block, const FlowView &flow, bool damps)
{
  FlowView here;
  if (flows)
    here = {flow.offset + range.first, flow.next + range.first,
            flow.cap ? flow.cap + range.first : nullptr};
  double *const kept = weight.data() + range.first;
  const Pairs pairs = {deq.data() + range.first, kept, here};
  evaluate(*this, block, pairs, damps);
  if (here.cap && !block.only_bonds()) StoredBlocks::mend_contacts(*this, block, pairs);
  call_at(level, [&]() EVP_KERNEL {
    StoredBlocks::add_up(found, values, block.n, flows);
  });
  if (found.passes.total() != 0.0) {
    changed = true;
    const bool counts = flows && !breaks && !finds_anew;
    for (int k = 0; k < block.n; k++) {
      if (values.passes[k] == 0.0) continue;
      const StoredBlocks::Weight own(kept[k]);
      const size_t at = range.first + k;
      if (counts && own.is_bond)    // an offset stays as it is beyond the cut-off
        ended += own.was_beyond ? -own.size * beside_depth(list.pairs[at], flow.offset[at])
                                : own.size * beside_depth(list.pairs[at], flow.next[at]);
      add_depth(own.is_bond, depth[range.first + k], !own.was_beyond);
      kept[k] += std::copysign(StoredBlocks::BEYOND, own.was_beyond ? -kept[k] : kept[k]);
    }
  }
  return values;
}

void StoredEnergy::note_broken(const PairList &list, size_t k, double p, double rest)
{
  if (is_due(list, flows)) return;    // the next evaluation begins with the list as it is then
  const StoredBlocks::Weight own(weight[k]);
  if (!own.was_beyond) add_depth(true, depth[k], true);
  add_depth(broken, depth[k], false);
  const PackedPair pair = list.pairs[k];
  born -= own.size * beside_depth(pair, p);
  weight[k] = -(own.size + StoredBlocks::BEYOND);
  depth[k] = 0.0;
  if (rest > 0.0) deq[k] = rest;
}

}    // namespace EVP
