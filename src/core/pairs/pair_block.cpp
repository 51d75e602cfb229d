// SPDX-License-Identifier: GPL-2.0-only

#include "core/pairs/pair_block.h"

#include <type_traits>

namespace EVP {

namespace {

  /// Those of the pairs of a list: one if all are alike, else by index.
  template <class Powers> struct Laws {
    std::vector<Law<Powers>> laws;

    /// Those of the pairs of a block.
    EVP_INLINE void find(const PairBlock &block, const Law<Powers> **own) const
    {
      for (int k = 0; k < block.n; k++) own[k] = &laws[block.law[k]];
    }
  };

  /// Puts force/d in its place, from F deq, 1/deq and 1/d.
  template <bool Damping>
  EVP_INLINE void put_force(PairBlock &block, int k, double f, double inv_deq, double inv_d,
                            double gamma, bool acts)
  {
    f *= inv_deq * inv_d;
    double damping = 0.0;
    if constexpr (Damping) {
      damping = gamma * block.approach[k] * (inv_d * inv_d);
      f -= damping;
    }
    block.force[k] = acts ? f : 0.0;
    if constexpr (Damping) block.damping[k] = acts ? -damping : 0.0;
  }

  /// Pairs whose flow is reversible (eq. 8).
  template <class Powers, bool Many, bool Damping, bool Stored>
  EVP_INLINE void evaluate_reversible(const Laws<Powers> &all, PairBlock &block)
  {
    const double *const inv_deq = block.inv_deq, *const cutsq = block.cutsq;
    const double to_cutoff = 1.0 / (1.0 + block.margin);    // cutoff_of() would divide again
    const int n = block.n;
    const Law<Powers> only = all.laws[0];
    const Law<Powers> *own[Many ? PairBlock::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many) all.find(block, own);

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Law<Powers> &c = Many ? *own[k] : only;
      const double dsq = block.distance_squared(k);
      const double d = Stored ? up_to_cutoff(dsq, cutsq[k], std::sqrt(cutsq[k]) * to_cutoff)
                              : std::sqrt(dsq);
      const auto at = c.place(d * inv_deq[k]);
      // 1/d and s = 1/(r - offset) from one division
      const double w = 1.0 / (at.shifted * d);
      const double s = w * d;
      put_force<Damping>(block, k, c.force(at, s), inv_deq[k], w * at.shifted, c.gamma,
                         !(dsq > cutsq[k]));
      if constexpr (Stored) {
        const auto now = c.stored(at, s);
        block.elastic[k] = now.elastic;
        block.second[k] = now.second;
      }
    }
  }

  /// Pairs whose flow is plastic; contacts only repel, and flow in compression.
  template <class Powers, bool Many, bool Contact, bool Damping, bool Stored>
  EVP_INLINE void evaluate_flowing(const Laws<Powers> &all, PairBlock &block)
  {
    const double *const inv_deq = block.inv_deq, *const cutsq = block.cutsq;
    const double to_cutoff = 1.0 / (1.0 + block.margin);    // cutoff_of() would divide again
    const FlowArrays flow = block.flow;
    const int n = block.n;
    const Law<Powers> only = all.laws[0];
    const Law<Powers> *own[Many ? PairBlock::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many) all.find(block, own);
    alignas(64) double ratio[PairBlock::SIZE], elastic[PairBlock::SIZE], force_d[PairBlock::SIZE],
        next[PairBlock::SIZE];

    int moves = 0;
    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Law<Powers> &c = Many ? *own[k] : only;
      const double dsq = block.distance_squared(k);
      const bool past = dsq > cutsq[k];
      const double d = up_to_cutoff(dsq, cutsq[k], std::sqrt(cutsq[k]) * to_cutoff);
      const double r = d * inv_deq[k];
      double inv_d;
      const auto now = c.template flow<Contact, Stored>(
          r, flow.limit[k], past, inv_deq[k], [&](double at) EVP_KERNEL {
            const double w = 1.0 / (at * d);    // one division for both
            inv_d = w * at;
            return std::pair(w * d, at * inv_d);
          });
      put_force<Damping>(block, k, now.force, now.inv_deq, inv_d, c.gamma,
                         !(past || (Contact && r > 1.0)));
      moves += (int) ((now.inv_deq != inv_deq[k]) | (!Contact & past));    // no ||: vectorized
      next[k] = now.inv_deq;
      ratio[k] = r;
      elastic[k] = now.elastic;
      force_d[k] = now.force_d;
      if constexpr (Stored) {
        block.elastic[k] = now.stored;
        block.second[k] = 0.0;
      }
    }
    *flow.any_flow = moves > 0;
    if (moves == 0) return;    // mostly, and then only forces are written
    int not_close = 0;
    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      flow.inv_deq_next[k] = next[k];
      flow.dissipated[k] = only.dissipated(force_d[k], log_of_close_ratio(ratio[k], elastic[k]));
      not_close += (int) !are_close(ratio[k], elastic[k]);
    }
    for (int k = 0; not_close > 0 && k < n; k++)
      flow.dissipated[k] = only.dissipated(force_d[k], log_of_ratio(ratio[k], elastic[k]));
  }

  /// Fills block.potential from what the pairs store. find_stored(block): fills elastic and second.
  template <Flow Kind, class F>
  void find_potential(PairBlock &block, bool incremental, F &&find_stored)
  {
    if constexpr (Kind != Flow::REVERSIBLE) {
      for (int k = 0; k < block.n; k++) {
        block.at_cutoff[k] = 0.0;
        block.potential[k] =
            !incremental && block.distance_squared(k) > block.cutsq[k] ? 0.0 : block.elastic[k];
      }
      for (int k = 0; incremental && *block.flow.any_flow && k < block.n; k++)
        block.potential[k] += block.flow.dissipated[k];
    } else {
      PairBlock at_cutoff;
      at_cutoff.n = block.n;
      at_cutoff.inv_deq = block.inv_deq;
      at_cutoff.cutsq = block.cutsq;
      at_cutoff.margin = block.margin;
      at_cutoff.law = block.law;
      const int n = block.n;
      const double *const cutsq = block.cutsq;
      call_vectorized([&, n, cutsq]() EVP_KERNEL {
        EVP_INDEPENDENT
        for (int k = 0; k < n; k++) {
          at_cutoff.xy[2 * k] = cutoff_of(cutsq[k], block.margin);
          at_cutoff.xy[2 * k + 1] = at_cutoff.z[k] = 0.0;
        }
      });
      find_stored(at_cutoff);
      call_vectorized([&, n, cutsq]() EVP_KERNEL {
        EVP_INDEPENDENT
        for (int k = 0; k < n; k++) {
          const double there = at_cutoff.elastic[k] + at_cutoff.second[k];
          const double above = (block.elastic[k] + block.second[k]) - there;
          block.at_cutoff[k] = there;
          block.potential[k] = block.distance_squared(k) > cutsq[k] ? 0.0 : above;
        }
      });
    }
  }

  template <class Powers, bool Many, Flow Kind> struct Evaluation {
    Laws<Powers> all;

    void operator()(PairBlock &block, const BlockLaw::Asked &asked) const
    {
      // compiled for each instruction set; loops with pow() gain nothing from that
      const auto find = [this](PairBlock &of, auto damping, auto stored) {
        constexpr bool Damping = decltype(damping)::value, Stored = decltype(stored)::value;
        const auto run = [&]() EVP_KERNEL {
          if constexpr (Kind == Flow::REVERSIBLE)
            evaluate_reversible<Powers, Many, Damping, Stored>(all, of);
          else
            evaluate_flowing<Powers, Many, Kind == Flow::PLASTIC_CONTACT, Damping, Stored>(all, of);
        };
        if constexpr (Powers::are_fixed)
          call_vectorized(run);
        else
          run();
      };
      constexpr std::true_type yes;
      constexpr std::false_type no;
      const bool stored = asked.stored || asked.potential;
      if (asked.damping)
        stored ? find(block, yes, yes) : find(block, yes, no);
      else
        stored ? find(block, no, yes) : find(block, no, no);
      if (!asked.potential) return;
      find_potential<Kind>(block, asked.incremental, [&](PairBlock &other) {
        find(other, no, yes);
      });
    }
  };

}    // namespace

// pairs that have no force of their own
void BlockLaw::without_force(PairBlock &block, const Asked &)
{
  for (auto *values :
       {block.force, block.elastic, block.second, block.at_cutoff, block.potential, block.damping})
    std::fill_n(values, block.n, 0.0);
}

void BlockLaw::assign(const std::vector<PairLaw> &laws, const std::vector<int> &used, Flow flow)
{
  if (used.empty()) {    // no pair to go over
    evaluate = without_force;
    return;
  }
  const Row &row = laws[used.front()].row;
  bool alike = true, common_powers = true;
  for (const int k : used) {
    const Row &own = laws[k].row;
    alike = alike && own == row;
    common_powers = common_powers && own.m1 == row.m1 && own.n1 == row.n1 && own.m2 == row.m1 &&
        own.n2 == row.n1;
  }

  const auto choose = [&](const auto &powers) {
    using Powers = std::decay_t<decltype(powers)>;
    Laws<Powers> all;
    if (alike)
      all.laws.emplace_back(row);
    else
      for (const PairLaw &law : laws) all.laws.emplace_back(law.row);
    const auto with_flow = [&](auto kind) {
      if (alike)
        evaluate = Evaluation<Powers, false, kind>{std::move(all)};
      else
        evaluate = Evaluation<Powers, true, kind>{std::move(all)};
    };
    if (flow == Flow::REVERSIBLE) with_flow(std::integral_constant<Flow, Flow::REVERSIBLE>());
    if (flow == Flow::PLASTIC) with_flow(std::integral_constant<Flow, Flow::PLASTIC>());
    if (flow == Flow::PLASTIC_CONTACT)
      with_flow(std::integral_constant<Flow, Flow::PLASTIC_CONTACT>());
  };
  if (common_powers && Powers84::are(row.m1, row.n1))
    choose(Powers84());
  else
    choose(AnyPowers{0.0, 0.0});
}

void accumulate_forces(PairList &list, const BlockLaw &law, const ParticleView &view,
                       const std::vector<PairConsumer *> &consumers)
{
  BlockLaw::Asked asked;
  for (const PairConsumer *consumer : consumers) consumer->ask(list, asked);
  asked.damping = view.v != nullptr;

  PairBlock block;
  for_each_block(list, [&](const PairRange &range) {
    asked.damping ? gather<true>(view, range, block) : gather<false>(view, range, block);
    block.flow = list.flow_arrays(range.first);
    if (!list.are_bonds && !list.is_plastic() && count_past_cutoff(block) == block.n) return;
    law.evaluate(block, asked);
    for (PairConsumer *consumer : consumers) (*consumer)(range, block);
    scatter(range, block, block.force, view.nreact, view.f);
  });
}

void commit_flow(PairList &list, int nreact, FlowSums &sums)
{
  auto &any_flow = list.any_flow;
  if (std::find(any_flow.begin(), any_flow.end(), 1) == any_flow.end()) return;
  int owner[PairBlock::SIZE], moved[PairBlock::SIZE];
  alignas(64) double before[PairBlock::SIZE], after[PairBlock::SIZE], slip[PairBlock::SIZE];
  for_each_block(list, [&](const PairRange &range) {
    if (!any_flow[range.first / PairBlock::SIZE]) return;
    int count = 0;    // without a branch: any of them may flow
    range.for_each_row([&](int i, int first, int last) {
      for (int n = first; n < last; n++) {
        owner[count] = i;
        moved[count] = n;
        before[count] = list.inv_deq[n];
        after[count] = list.inv_deq_next[n];
        count += (int) (after[count] != before[count]);
      }
    });
    call_vectorized([&, n = count]() EVP_KERNEL {
      EVP_INDEPENDENT
      for (int k = 0; k < n; k++) slip[k] = std::fabs(log_of_close_ratio(after[k], before[k]));
    });
    for (int k = 0; k < count; k++) {
      const int n = moved[k], i = owner[k], j = list.j[n];
      if (!are_close(after[k], before[k])) slip[k] = std::fabs(log_of_ratio(after[k], before[k]));
      if (list.are_bonds) sums.add(i, j, nreact, FlowSums::SLIP, slip[k]);
      sums.add(i, j, nreact, FlowSums::WORK, 0.5 * list.dissipated[n]);
      list.inv_deq[n] = after[k];
    }
  });
  std::fill(any_flow.begin(), any_flow.end(), 0);
}

}    // namespace EVP
