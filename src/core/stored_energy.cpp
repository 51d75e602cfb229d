// SPDX-License-Identifier: GPL-2.0-only

#include "core/stored_energy.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace EVP {

namespace {

  /// The offset that the force of a pair is evaluated with: that of its elastic part within xi_s.
  EVP_INLINE double mapped(double p, double xi, double xi_s)
  {
    return std::min(std::max(p, xi - xi_s), xi + xi_s);
  }

  /// Weight of a pair: without newton both owners of a pair across MPI ranks hold it.
  EVP_INLINE double weight_of(int j, int nreact)
  {
    return j < nreact ? 1.0 : 0.5;
  }

}    // namespace

/// The loops over pairs, N: power of all laws, see Law::stored_power(), 0 where they have none in common.
struct StoredBlocks {
  using Form = Law::StoredForm;

  /// Pairs one by one, laws with any exponents.
  static void evaluate_any(const StoredEnergy &own, const Block &block,
                           const StoredEnergy::Pairs &pairs, StoredEnergy::Values &values)
  {
    for (int k = 0; k < block.n; k++) {
      const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
      const double dsq = values.dsq[k] = x * x + y * y + z * z;
      values.first[k] = values.second[k] = values.contacts[k] = 0.0;
      values.hardening[k] = values.plastic[k] = 0.0;
      values.beyond[k] = dsq > block.cutsq[k];
      if (values.beyond[k]) continue;
      const Law &law = own.laws[block.kind[k] >> 1];
      const bool is_bond = block.kind[k] & 1;
      const double d = std::sqrt(dsq), deq = pairs.deq[k], w = weight_of(pairs.j[k], own.nreact);
      if (!own.flows) {
        const Law::Stored now = law.stored(d, deq);
        if (is_bond) {
          values.first[k] = w * now.first;
          values.second[k] = w * now.second;
        } else
          values.contacts[k] = w * now.total();
        continue;
      }
      const double xi = (d - deq) / deq, xi_s = law.parameters().xi_s;
      const double p = pairs.flow.offset[k], next = pairs.flow.next[k];
      const double at = mapped(p, xi, xi_s);
      if (is_bond) {
        const Law::Stored now = law.stored(d, deq, at);
        values.first[k] = w * now.first;
        values.hardening[k] = w * now.hardening;
      } else    // stretched it has followed eq. 8 from an offset of 0
        values.contacts[k] = w * (at > 0.0 ? law.stored(d, deq) : law.stored(d, deq, at)).total();
      if (next != p) values.plastic[k] = w * law.dissipated(p, next);
    }
  }

  /// All pairs of a block; Many: of several laws; Flows: with offsets.
  template <int N, bool Many, bool Flows>
  EVP_INLINE static void evaluate(const StoredEnergy &own, const Block &block,
                                  const StoredEnergy::Pairs &pairs, StoredEnergy::Values &values)
  {
    const int n = block.n, nreact = own.nreact;
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const int *const kind = block.kind;
    const double *const deq = pairs.deq;
    const int *const j = pairs.j;
    const double *const offset = pairs.flow.offset;
    const double *const next = pairs.flow.next;
    const Form only = own.forms[0];
    const Form *form[Many ? Block::SIZE : 1];
    if constexpr (Many)
      for (int k = 0; k < n; k++) form[k] = &own.forms[kind[k] >> 1];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Form &c = Many ? *form[k] : only;
      const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
      const double dsq = x * x + y * y + z * z;
      const double xi = (std::sqrt(dsq) - deq[k]) * inv_deq[k];
      const double w = dsq > cutsq[k] ? 0.0 : weight_of(j[k], nreact);
      const double of_bond = kind[k] & 1 ? w : 0.0;
      values.dsq[k] = dsq;
      if constexpr (!Flows) {
        const Law::Stored now = c.template stored<N>(xi);
        values.first[k] = of_bond * now.first;
        values.second[k] = of_bond * now.second;
        values.contacts[k] = (w - of_bond) * (now.first + now.second);
      } else {
        const double p = mapped(offset[k], xi, c.xi_s);
        const double elastic = std::min(std::max(xi - offset[k], -c.xi_s), c.xi_s);
        const Law::Stored now = c.template stored<N>(elastic, p);
        const double contact = p > 0.0 ? c.template stored<N>(xi).total() : now.total();
        values.first[k] = of_bond * now.first;
        values.hardening[k] = of_bond * now.hardening;
        values.contacts[k] = (w - of_bond) * contact;
      }
    }
    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) values.beyond[k] = values.dsq[k] > cutsq[k];

    if constexpr (Flows) {
      if (std::memcmp(offset, next, n * sizeof(double)) == 0) {
        std::fill_n(values.plastic, n, 0.0);
        return;
      }
      EVP_INDEPENDENT
      for (int k = 0; k < n; k++) {
        const Form &c = Many ? *form[k] : only;
        const double w = values.dsq[k] > cutsq[k] ? 0.0 : weight_of(j[k], nreact);
        values.plastic[k] = w * c.template dissipated<N>(offset[k], next[k]);
      }
    }
  }

  template <int N, bool Many, bool Flows>
  static void evaluate_at_level(const StoredEnergy &own, const Block &block,
                                const StoredEnergy::Pairs &pairs, StoredEnergy::Values &values)
  {
    call_at(own.level, [&]() EVP_KERNEL {
      evaluate<N, Many, Flows>(own, block, pairs, values);
    });
  }

  static void depth_any(StoredEnergy &own, const PairList &list)
  {
    for (size_t n = 0; n < own.deq.size(); n++) {
      const PackedPair pair = list.pairs[n];
      const Law &law = own.laws[pair.law];
      const double flown = (pair.cut - own.deq[n]) / own.deq[n] - law.parameters().xi_s;
      const bool has_flown = own.flows && pair.is_bond() && flown > 0.0;
      own.depth[n] = weight_of(pair.j, own.nreact) *
          (has_flown ? law.stored(pair.cut, own.deq[n], flown) : law.stored(pair.cut, own.deq[n]))
              .total();
    }
  }

  /// What a pair has stored where it passes its cut-off.
  template <int N, bool Many> EVP_INLINE static void depth(StoredEnergy &own, const PairList &list)
  {
    const int n = (int) own.deq.size(), nreact = own.nreact;
    const double *const inv_deq = list.pairs.inv_deq.data();
    const double *const cutsq = list.pairs.cutsq.data();
    const int *const kind = list.pairs.kind.data();
    const int *const j = list.pairs.j.data();
    const double *const deq = own.deq.data();
    double *const out = own.depth.data();
    const double of_new = list.pairs.margin_removed[0], of_bond = list.pairs.margin_removed[1];
    const bool flows = own.flows;
    const Form *const forms = own.forms.data();
    const Form only = forms[0];

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Form &c = Many ? forms[kind[k] >> 1] : only;
      const double cut = std::sqrt(cutsq[k]) * (kind[k] & 1 ? of_bond : of_new);
      const double xi = (cut - deq[k]) * inv_deq[k];
      const Law::Stored all = c.template stored<N>(xi);
      const double flown = std::max(xi - c.xi_s, 0.0);
      const double kept = c.template stored<N>(xi - flown, flown).total();
      out[k] = weight_of(j[k], nreact) *
          (flows && (kind[k] & 1) ? kept : all.first + all.second);
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
      own.evaluate =
          many ? evaluate_at_level<N, true, true> : evaluate_at_level<N, false, true>;
    else
      own.evaluate =
          many ? evaluate_at_level<N, true, false> : evaluate_at_level<N, false, false>;
    own.find_depth = many ? depth_at_level<N, true> : depth_at_level<N, false>;
  }
};

void StoredEnergy::assign(const PairList &list, const BlockLaw &law, std::vector<double> deq_in,
                          int nreact_in, bool flows_in)
{
  build = list.build;
  deq = std::move(deq_in);
  nreact = nreact_in;
  flows = flows_in;
  choose(law, list);
  depth.resize(deq.size());
  find_depth(*this, list);
  // nothing is within its cut-off yet: the next evaluation adds what is
  beyond.assign(deq.size(), 1);
  bonds_depth = contacts_depth = {};
}

// the loops for the laws that the pairs have
void StoredEnergy::choose(const BlockLaw &law, const PairList &list)
{
  laws = law.laws;
  partner = list.pairs.j.data();
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

void StoredEnergy::set_largest_depth(double sum, const PairList &list)
{
  int exponent;
  std::frexp(sum, &exponent);
  unit = sum > 0.0 ? std::ldexp(1.0, exponent + 1) : 0.0;
  bonds_depth = contacts_depth = {};
  for (size_t k = 0; k < beyond.size(); k++)
    if (!beyond[k]) add_depth(list.pairs.kind[k] & 1, depth[k]);
}

const StoredEnergy::Values &StoredEnergy::add(const PairRange &range, const Block &block,
                                              const FlowView &flow)
{
  const int n = block.n;
  FlowView here;
  if (flows) here = {flow.offset + range.first, flow.next + range.first};
  evaluate(*this, block, {deq.data() + range.first, partner + range.first, here}, values);
  first.add(n, [&](int k) { return values.first[k]; });
  contacts.add(n, [&](int k) { return values.contacts[k]; });
  if (flows) {
    hardening.add(n, [&](int k) { return values.hardening[k]; });
    plastic.add(n, [&](int k) { return values.plastic[k]; });
  } else
    second.add(n, [&](int k) { return values.second[k]; });

  unsigned char *const was = beyond.data() + range.first;
  if (std::memcmp(values.beyond, was, n) != 0)
    for (int k = 0; k < n; k++)
      if (values.beyond[k] != was[k]) {
        was[k] = values.beyond[k];
        const double held = depth[range.first + k];
        add_depth(block.kind[k] & 1, was[k] ? -held : held);
      }
  return values;
}

}    // namespace EVP
