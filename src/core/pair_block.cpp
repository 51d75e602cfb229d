// SPDX-License-Identifier: GPL-2.0-only

#include "core/pair_block.h"

#include <cstring>

namespace EVP {

namespace {

  /// Those of the pairs of a list: one if all are alike, else by index.
  template <class Powers> struct Laws {
    std::vector<Law<Powers>> laws;
    bool saturates;    ///< has any a saturation?

    /// Those of the pairs of a block.
    EVP_INLINE void find(const PairBlock &block, const Law<Powers> **own) const
    {
      for (int k = 0; k < block.n; k++) own[k] = &laws[block.law[k]];
    }
  };

  /// Puts force/d in its place, from F deq, 1/deq and 1/d.
  template <bool Damping, bool Stored>
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
    if constexpr (Damping && Stored) block.damping[k] = acts ? -damping : 0.0;
  }

  /// Pairs that forget their flow (eq. 8).
  template <class Powers, bool Many, bool Damping, bool Stored>
  EVP_INLINE void evaluate_forgetting(const Laws<Powers> &all, PairBlock &block)
  {
    const double *const inv_deq = block.inv_deq, *const cutsq = block.cutsq;
    const double to_cutoff = 1.0 / (1.0 + block.margin);
    const int n = block.n;
    const Law<Powers> only = all.laws[0];
    const Law<Powers> *own[Many ? PairBlock::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many) all.find(block, own);

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Law<Powers> &c = Many ? *own[k] : only;
      const double dsq = block.distance_squared(k);
      double d = std::sqrt(Stored && dsq > cutsq[k] ? cutsq[k] : dsq);
      if constexpr (Stored) d *= dsq > cutsq[k] ? to_cutoff : 1.0;
      const auto at = c.place(d * inv_deq[k]);
      // 1/d and s = 1/(r - offset) from one division
      const double w = 1.0 / (at.shifted * d);
      const double s = w * d;
      put_force<Damping, Stored>(block, k, c.force(at, s), inv_deq[k], w * at.shifted, c.gamma,
                                 !(dsq > cutsq[k]));
      if constexpr (Stored) {
        const auto now = c.stored(at, s);
        block.elastic[k] = now.elastic;
        block.forgotten[k] = now.forgotten;
      }
    }
  }

  /// An elastic strain as the limit takes it: contacts flow in compression only.
  template <bool Contact> EVP_INLINE double size_of(double strain)
  {
    return Contact ? -strain : std::fabs(strain);
  }

  /// By how much each pair slips, with the sign of its strain.
  template <class Powers, bool Many, bool Contact>
  EVP_INLINE void find_slips(const Laws<Powers> &all, const PairBlock &block, double *distance,
                             double *slip)
  {
    const double *const inv_deq = block.inv_deq, *const cutsq = block.cutsq;
    const double to_cutoff = 1.0 / (1.0 + block.margin);
    const double *const q = block.flow.q, *const accumulated = block.flow.k;
    const int n = block.n;
    const Law<Powers> only = all.laws[0];
    const Law<Powers> *own[Many ? PairBlock::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many) all.find(block, own);

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const double dsq = block.distance_squared(k);
      const double d =
          std::sqrt(dsq > cutsq[k] ? cutsq[k] : dsq) * (dsq > cutsq[k] ? to_cutoff : 1.0);
      distance[k] = d;    // so far a pair flows
      const double strain = d * inv_deq[k] - 1.0 - q[k];
      const double size = size_of<Contact>(strain);
      const Law<Powers> &c = Many ? *own[k] : only;
      slip[k] = std::copysign(c.slip_linear(size, accumulated[k]), strain);
    }
    for (int k = 0; all.saturates && k < n; k++) {    // a saturating limit is below the linear one
      const double strain = distance[k] * inv_deq[k] - 1.0 - q[k];
      const double size = size_of<Contact>(strain);
      const Law<Powers> &c = Many ? *own[k] : only;
      if (size > c.xi_s) slip[k] = std::copysign(c.slip(size, accumulated[k]), strain);
    }
  }

  /// What the slips dissipate.
  template <class Powers, bool Many>
  EVP_INLINE void find_dissipated(const Laws<Powers> &all, const PairBlock &block,
                                  const double *slip)
  {
    const double *const accumulated = block.flow.k;
    double *const dissipated = block.flow.dissipated;
    const int n = block.n;
    const Law<Powers> only = all.laws[0];
    const Law<Powers> *own[Many ? PairBlock::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many) all.find(block, own);

    if constexpr (Powers::are_fixed)
      if (!all.saturates) {
        EVP_INDEPENDENT
        for (int k = 0; k < n; k++) {
          const Law<Powers> &c = Many ? *own[k] : only;
          dissipated[k] =
              c.dissipated_linear(std::copysign(1.0, slip[k]), accumulated[k], std::fabs(slip[k]));
        }
        return;
      }
    for (int k = 0; k < n; k++) {
      const Law<Powers> &c = Many ? *own[k] : only;
      const double by = std::fabs(slip[k]);
      dissipated[k] = by == 0.0 ? 0.0
                                : c.dissipated(std::copysign(1.0, slip[k]), accumulated[k], by);
    }
  }

  /// Pairs whose flow stays; contacts only repel, and flow in compression.
  template <class Powers, bool Many, bool Contact, bool Damping, bool Stored>
  EVP_INLINE void evaluate_flowing(const Laws<Powers> &all, PairBlock &block)
  {
    const double *const inv_deq = block.inv_deq, *const cutsq = block.cutsq;
    const FlowArrays flow = block.flow;
    const int n = block.n;
    const Law<Powers> only = all.laws[0];
    const Law<Powers> *own[Many ? PairBlock::SIZE : 1];    // apart: up to 8 % quicker
    if constexpr (Many) all.find(block, own);
    alignas(64) double distance[PairBlock::SIZE], slip[PairBlock::SIZE], q_new[PairBlock::SIZE];
    find_slips<Powers, Many, Contact>(all, block, distance, slip);

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Law<Powers> &c = Many ? *own[k] : only;
      const double dsq = block.distance_squared(k);
      const double d = distance[k], r = d * inv_deq[k];
      const double q = flow.q[k] + slip[k];
      double e = r - q;
      if constexpr (Contact) e = e > 1.0 ? 1.0 : e;    // apart, nothing acts
      const double w = 1.0 / (e * d);
      const double s = w * d;
      put_force<Damping, Stored>(block, k, c.first.force(s), inv_deq[k], w * e, c.gamma,
                                 !(dsq > cutsq[k]));
      q_new[k] = Contact && dsq > cutsq[k] ? 0.0 : q;
      if constexpr (Stored) {
        const double strain = r - 1.0 - q;
        block.elastic[k] = c.first.stored(Contact && strain > 0.0 ? 0.0 : strain, s);
        block.forgotten[k] = 0.0;
      }
    }
    *flow.any_flow = std::memcmp(flow.q, q_new, n * sizeof(double)) != 0;
    if (!*flow.any_flow) return;    // mostly, and then only forces are written
    std::memcpy(flow.q_new, q_new, n * sizeof(double));
    find_dissipated<Powers, Many>(all, block, slip);
  }

  /// Compiled for each instruction set; loops with pow() gain nothing from that.
  template <class Powers, bool Many, Flow Kind, bool Damping, bool Stored>
  void evaluate(const Laws<Powers> &all, PairBlock &block)
  {
    const auto run = [&]() EVP_KERNEL {
      if constexpr (Kind == Flow::FORGETS)
        evaluate_forgetting<Powers, Many, Damping, Stored>(all, block);
      else
        evaluate_flowing<Powers, Many, Kind == Flow::COMPRESSES, Damping, Stored>(all, block);
    };
    if constexpr (Powers::are_fixed)
      call_vectorized(run);
    else
      run();
  }

  /// Fills block.potential from what the pairs store. find_stored(block): fills elastic and forgotten.
  template <Flow Kind, class F>
  void find_potential(PairBlock &block, bool incremental, F &&find_stored)
  {
    if constexpr (Kind != Flow::FORGETS) {
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
          at_cutoff.xy[2 * k] = std::sqrt(cutsq[k]) / (1.0 + block.margin);
          at_cutoff.xy[2 * k + 1] = at_cutoff.z[k] = 0.0;
        }
      });
      find_stored(at_cutoff);
      call_vectorized([&, n, cutsq]() EVP_KERNEL {
        EVP_INDEPENDENT
        for (int k = 0; k < n; k++) {
          const double there = at_cutoff.elastic[k] + at_cutoff.forgotten[k];
          const double above = (block.elastic[k] + block.forgotten[k]) - there;
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
      const bool stored = asked.stored || asked.potential;
      if (asked.damping)
        (stored ? evaluate<Powers, Many, Kind, true, true>
                : evaluate<Powers, Many, Kind, true, false>) (all, block);
      else
        (stored ? evaluate<Powers, Many, Kind, false, true>
                : evaluate<Powers, Many, Kind, false, false>) (all, block);
      if (!asked.potential) return;
      find_potential<Kind>(block, asked.incremental, [this](PairBlock &other) {
        evaluate<Powers, Many, Kind, false, true>(all, other);
      });
    }
  };

}    // namespace

void BlockLaw::assign(const std::vector<PairLaw> &laws, const std::vector<int> &used, Flow flow)
{
  if (used.empty()) {    // no pair to go over
    evaluate = nullptr;
    return;
  }
  const Row &row = laws[used.front()].row;
  bool alike = true, common_powers = true, saturates = false;
  for (const int k : used) {
    const Row &own = laws[k].row;
    alike = alike && own == row;
    common_powers = common_powers && own.m1 == row.m1 && own.n1 == row.n1 && own.m2 == row.m1 &&
        own.n2 == row.n1;
    saturates = saturates || own.saturation > 0.0;
  }

  const auto choose = [&](const auto &powers) {
    using Powers = std::decay_t<decltype(powers)>;
    Laws<Powers> all = {{}, saturates};
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
    if (flow == Flow::FORGETS) with_flow(std::integral_constant<Flow, Flow::FORGETS>());
    if (flow == Flow::STAYS) with_flow(std::integral_constant<Flow, Flow::STAYS>());
    if (flow == Flow::COMPRESSES) with_flow(std::integral_constant<Flow, Flow::COMPRESSES>());
  };
  with_powers(common_powers ? row.m1 : 0.0, row.n1, AnyPowers{0.0, 0.0}, choose);
}

}    // namespace EVP
