// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/pairs/pair_block.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace EVP {

/// The pairs of one rank in the energy balance, as the force loop finds them: what they store, and the
/// forces from which works and dissipation follow. Forces are those of the evaluation itself, at the
/// velocities that it saw.
///
/// Each pair counts from its rest at deq. Of eq. 8 a bond past its cutoff has the energy that it had there: that is lost
/// until it comes back, wherever the neighbor list ends. Where bonds end it is lost for good, by end().
class PairWork final : public PairConsumer {
 public:
  /// Over the pairs of this MPI rank, those with a partner that takes no reaction by half; doubles
  /// only, to be added over MPI ranks [energy].
  struct Sums {
    /// Of bonds within their cutoffs, see Stored; where bonds end of all.
    double elastic, forgotten;
    double contacts;              ///< of contacts within theirs
    double contacts_at_cutoff;    ///< what these have there: maybe thousands of times more
    double past_cutoff;           ///< of bonds past theirs, where they come back
    double ended;                 ///< of those that ended, since the start
    double plastic;               ///< dissipated as deq moves on
    double grown;                 ///< gained as lengths of pairs grew
  };
  Sums sums() const
  {
    const Stored beyond = bonds_end ? beyond_list.held : Stored{};    // until they end
    return {found.elastic.total() - ended_now.elastic + beyond.elastic,
            found.forgotten.total() - ended_now.forgotten + beyond.forgotten,
            found.contacts.total(),
            found.contacts_at_cutoff.total(),
            bonds_end ? 0.0 : found.past_cutoff.total() + beyond_list.held.total(),
            ended,
            found.plastic.total() + dissipated_apart,
            grown};
  }

  /// Do bonds past their cutoffs end?
  bool bonds_end = false;

  /// Bonds past the end of the list: stored, and dissipated on the way there [energy].
  struct BeyondList {
    Stored held;
    double dissipated;
  } beyond_list{};
  void end_beyond_list()
  {
    ended += beyond_list.held.total();
    beyond_list = {};
  }

  /// A bond has ended that had stored this at the last forces.
  void end(const Stored &stored, double share)
  {
    ended += share * stored.total();
    ended_now.elastic += share * stored.elastic;
    ended_now.forgotten += share * stored.forgotten;
  }

  /// Dissipated at fixed distances, before the forces to come [energy].
  void add_dissipated(double energy) { dissipated_before += energy; }
  void add_grown(double energy) { grown_before += energy; }

  /// Of particles and ghosts [force], on ghosts reactions: of the pairs, damping included,
  /// which is empty without `separates`; and of the damping of their laws alone, empty where none acts.
  AtomValues force{3}, damping{3};

  /// Of particles and ghosts: by how many boxes they are away from their owners. Empty where the
  /// box does no work on images.
  AtomValues images{3};

  /// Sums over the pairs of components of the force on i [force] times the count of j: xx, yy, zz, yz, xz
  /// and xy, the force being named first. `whole` with the damping of laws, `damping` that alone.
  struct {
    std::array<double, 6> whole, damping;
  } through{};

  /// Is `force` wanted? Not where nothing else acts, and ParticleView::f is the same.
  bool separates = true;

  /// At the beginning of a run, whose pairs may be those of another pair style.
  void forget() { evaluated = false; }

  /// Whether there was an evaluation since the last call. Until then the first one counts: others at
  /// the same step are of commands that try out positions or coefficients.
  bool claim() { return std::exchange(evaluated, false); }
  bool is_evaluated() const { return evaluated; }

  /// Before the first and after the last list of an evaluation. Other styles may have added to f: what its loops add is
  /// the difference, and no bit of f is another.
  void begin(int nall, const ParticleView &view)
  {
    nreact = view.nreact;
    force.resize(separates ? nall : 0);
    if (separates && view.nreact > 0) force.set_first(view.nreact, view.f[0]);
    damping.assign(view.v ? nall : 0, 0.0);
    through = {};
    found = {};
    ended_now = {};
    dissipated_apart = std::exchange(dissipated_before, 0.0) + beyond_list.dissipated;
    grown = std::exchange(grown_before, 0.0);
  }
  void finish(const ParticleView &view)
  {
    evaluated = true;
    if (!separates || view.nreact == 0) return;
    const double *const f = view.f[0];
    double *const own = force.data();
    EVP_INDEPENDENT
    for (int k = 0; k < 3 * view.nreact; k++) own[k] = f[k] - own[k];
  }

  void ask(const PairList &list, BlockLaw::Asked &asked) const override
  {
    asked.stored = true;
    asked.potential |= !list.are_bonds;    // for contacts_at_cutoff
  }
  void operator()(const PairRange &range, PairBlock &block) override
  {
    add_energies(range, block);
    add_forces(range, block);
  }

  double memory_usage() const { return bytes_of(force, damping, images); }

 private:
  struct LaneSums {
    LaneSum elastic, forgotten, contacts, contacts_at_cutoff, past_cutoff, plastic;
  };
  bool evaluated = false;
  int nreact = 0;
  double ended = 0.0, dissipated_before = 0.0, dissipated_apart = 0.0;
  double grown_before = 0.0, grown = 0.0;
  Stored ended_now{};    // since the last forces, which found it
  LaneSums found;

  void add_energies(const PairRange &range, const PairBlock &block)
  {
    const int nreact = this->nreact;    // apart: vectorized
    const bool are_bonds = range.list.are_bonds;
    const int *const j = range.list.j.data() + range.first;
    const int n = block.n;
    const bool all_count = are_bonds && bonds_end;    // past their cutoffs too
    alignas(64) double weight[PairBlock::SIZE], inside[PairBlock::SIZE];
    int past = 0;
    call_vectorized([&]() EVP_KERNEL {
      int halves = 0;
      for (int k = 0; k < n; k++) halves += (int) (j[k] >= nreact);
      past = all_count ? 0 : count_past_cutoff(block);
      const bool weighted = halves + past > 0;    // mostly not
      if (weighted) {
        EVP_INDEPENDENT
        for (int k = 0; k < n; k++) {
          weight[k] = j[k] < nreact ? 1.0 : 0.5;
          const bool counts = all_count || !(block.distance_squared(k) > block.cutsq[k]);
          inside[k] = counts ? weight[k] : 0.0;
        }
      }
      const auto add = [n, weighted](LaneSum &sum, const double *weights, const double *terms)
                           EVP_KERNEL {
                             if (weighted)
                               sum.add(n, [=](int k) EVP_KERNEL {
                                 return weights[k] * terms[k];
                               });
                             else
                               sum.add(n, [=](int k) EVP_KERNEL {
                                 return terms[k];
                               });
                           };
      add(are_bonds ? found.elastic : found.contacts, inside, block.elastic);
      add(are_bonds ? found.forgotten : found.contacts, inside, block.forgotten);
      if (!are_bonds) add(found.contacts_at_cutoff, inside, block.at_cutoff);
      if (block.flow.any_flow && *block.flow.any_flow)
        add(found.plastic, weight, block.flow.dissipated);
    });
    if (!are_bonds || past == 0) return;
    for (int k = 0; k < n; k++) weight[k] -= inside[k];
    for (const double *terms : {block.elastic, block.forgotten})
      found.past_cutoff.add(n, [&](int k) {
        return weight[k] * terms[k];
      });
  }

  void add_forces(const PairRange &range, const PairBlock &block)
  {
    if (!images.empty()) add_through(range, block, block.force, through.whole);
    if (damping.empty()) return;
    if (!images.empty()) add_through(range, block, block.damping, through.damping);
    scatter(range, block, block.damping, nreact, damping.rows());
  }

  void add_through(const PairRange &range, const PairBlock &block, const double *force,
                   std::array<double, 6> &sums) const
  {
    for (int k = 0; k < block.n; k++) {
      const int j = range.list.j[range.first + k];
      const double *const n = images[j];
      if (n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0) continue;
      const double scale = rank_share(j, nreact) * force[k];
      const double x = scale * block.xy[2 * k], y = scale * block.xy[2 * k + 1];
      const double z = scale * block.z[k];
      const double terms[6] = {x * n[0], y * n[1], z * n[2], y * n[2], x * n[2], x * n[1]};
      for (int c = 0; c < 6; c++) sums[c] += terms[c];
    }
  }
};

}    // namespace EVP
