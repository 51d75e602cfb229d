// SPDX-License-Identifier: GPL-2.0-only

#include "core/stored_energy.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace EVP {

void StoredEnergy::assign(const PairList &list, const BlockLaw &law, std::vector<double> deq_in,
                          int nreact, bool flows, bool breaks_in)
{
  breaks = breaks_in;
  build = list.build;
  is_new = true;
  deq = std::move(deq_in);
  // none is within its cut-off yet: the next evaluation adds the depths of those that are
  weight.resize(deq.size());
  for (size_t k = 0; k < deq.size(); k++)
    weight[k] = std::copysign(rank_share(list.pairs.j[k], nreact) + PairWeight::BEYOND,
                              list.pairs.kind[k] & 1 ? 1.0 : -1.0);
  bonds_depth = contacts_depth = {};
  energies.assign(list, law, flows);
  depth.resize(deq.size());
  energies.find_depths(list, {deq.data(), weight.data()}, depth.data());
}

void StoredEnergy::set_largest_depth(double sum)
{
  int exponent;
  std::frexp(sum, &exponent);
  unit = sum > 0.0 ? std::ldexp(1.0, exponent + 1) : 0.0;
  bonds_depth = contacts_depth = {};
  for (size_t k = 0; k < weight.size(); k++) {
    const PairWeight own(weight[k]);
    if (!own.was_beyond) add_depth(own.is_bond, depth[k], false);
  }
}

void StoredEnergy::note_passed(const PairList &list, const double (*x)[3])
{
  if (!energies.flows || breaks || is_due(list, energies.flows)) return;
  for_each_pair(list, x, [&](const PlacedPair &p) {
    const PairWeight own(weight[p.index]);
    if (own.is_bond && p.is_beyond() != own.was_beyond)
      passed += (own.was_beyond ? -own.size : own.size) * energies.beside_depth(p, p.offset);
  });
}

void StoredEnergy::note_flow(const PairList &list, size_t k, double spent)
{
  if (!is_due(list, energies.flows)) flowed += PairWeight(weight[k]).size * std::max(0.0, spent);
}

void StoredEnergy::add_up(int n)
{
  const auto add = [n](LaneSum &sum, const double *terms) EVP_KERNEL {
    sum.add(n, [terms](int k) EVP_KERNEL {
      return terms[k];
    });
  };
  call_at(energies.level, [&]() EVP_KERNEL {
    add(found.first, values.first);
    add(found.contacts, values.contacts);
    found.passes = {};
    add(found.passes, values.passes);
    if (energies.flows) {
      add(found.hardening, values.hardening);
      add(found.plastic, values.plastic);
    } else
      add(found.second, values.second);
  });
}

const BlockEnergy::Values &StoredEnergy::add(const PairList &list, const PairRange &range,
                                             const Block &block, bool damps)
{
  double *const kept = weight.data() + range.first;
  energies(block, {deq.data() + range.first, kept}, damps, values, ended);
  add_up(block.n);
  if (found.passes.total() == 0.0) return values;

  changed = true;
  const bool counts = energies.flows && !breaks && !finds_anew;
  for (int k = 0; k < block.n; k++) {
    if (values.passes[k] == 0.0) continue;
    const PairWeight own(kept[k]);
    const size_t at = range.first + k;
    if (counts && own.is_bond)    // an offset stays as it is beyond the cut-off
      ended += own.was_beyond
          ? -own.size * energies.beside_depth(list.pairs[at], block.flow.offset[k])
          : own.size * energies.beside_depth(list.pairs[at], block.flow.next_offset[k]);
    add_depth(own.is_bond, depth[at], !own.was_beyond);
    kept[k] += std::copysign(PairWeight::BEYOND, own.was_beyond ? -kept[k] : kept[k]);
  }
  return values;
}

void StoredEnergy::note_broken(const PairList &list, size_t k, double p, double rest)
{
  if (is_due(list, energies.flows))
    return;    // the next evaluation begins with the list as it is then
  const PairWeight own(weight[k]);
  if (!own.was_beyond) add_depth(true, depth[k], true);
  add_depth(broken, depth[k], false);
  born -= own.size * energies.beside_depth(list.pairs[k], p);
  weight[k] = -(own.size + PairWeight::BEYOND);
  depth[k] = 0.0;
  if (rest > 0.0) deq[k] = rest;
}

}    // namespace EVP
