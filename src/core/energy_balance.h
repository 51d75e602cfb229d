// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/pair_block.h"

#include <algorithm>
#include <array>
#include <vector>

namespace EVP {

/// The pairs of one rank in the energy balance, as the force loop finds them: what they store, and the
/// forces from which works and dissipation follow. Forces are those of the evaluation itself, at the
/// velocities that it saw.
///
/// Each pair counts from its rest at deq. A bond past its cutoff holds what it had there: that is lost until it comes
/// back, wherever the neighbor list ends.
class PairWork {
 public:
  /// Over the pairs of this MPI rank, those with a partner that takes no reaction by half; doubles
  /// only, to be added over MPI ranks [energy].
  struct Sums {
    double elastic, forgotten;    ///< of bonds within their cutoffs, see Stored
    double contacts;              ///< of contacts within theirs, zero there
    double past_cutoff;           ///< of bonds past theirs
    double broken;                ///< of those that broke, since the start
    double plastic;               ///< dissipated as offsets move on to the next ones
  };
  Sums sums() const
  {
    return {found.elastic.total(), found.forgotten.total(), found.contacts.total(),
            found.past_cutoff.total() + missing, broken, found.plastic.total()};
  }

  /// Bonds that the list does not have, as they are past its end, hold this [energy].
  double missing = 0.0;

  /// A bond that held this at its cutoff has broken.
  void add_broken(double energy) { broken += energy; }

  /// Did any pair pass its cutoff since the evaluation before?
  bool has_changed() const { return changed; }

  /// Three values per particle and ghost [force], on ghosts reactions: of the pairs, damping included,
  /// which is empty without `separates`; and of the damping of their laws alone, empty where none acts.
  std::vector<double> force, damping;

  /// Three counts per particle and ghost: by how many boxes it is away from its owner. Empty where the
  /// box does no work on images.
  std::vector<double> images;

  /// Sums over the pairs of components of the force on i [force] times the count of j: xx, yy, zz, yz, xz
  /// and xy, the force being named first. `whole` with the damping of laws, `damping` that alone.
  struct {
    std::array<double, 6> whole, damping;
  } through{};

  /// Is `force` wanted? Not where nothing else acts, and ParticleView::f will hold the same.
  bool separates = true;

  /// At the beginning of a run, whose pairs may be those of another pair style.
  void forget() { fresh = false; }

  /// Whether there was an evaluation since the last call. Until then the first one counts: others at
  /// the same step are of commands that try out positions or coefficients.
  bool take()
  {
    const bool was_fresh = fresh;
    fresh = false;
    return was_fresh;
  }
  bool is_fresh() const { return fresh; }

  /// Before the first and after the last list of an evaluation. Other styles may have added to f: what its loops add is
  /// the difference, and no bit of f is another.
  void begin(int nall, const ParticleView &view, bool damps)
  {
    force.resize(separates ? (size_t) 3 * nall : 0);
    if (separates && view.nreact > 0) std::copy_n(view.f[0], (size_t) 3 * view.nreact, force.begin());
    damping.assign(damps ? (size_t) 3 * nall : 0, 0.0);
    through = {};
    found = {};
    count_past = 0;
  }
  void end(const ParticleView &view)
  {
    fresh = true;
    changed = count_past != last_past || missing != last_missing;
    last_past = count_past;
    last_missing = missing;
    if (!separates || view.nreact == 0) return;
    const double *const f = view.f[0];
    double *const own = force.data();
    EVP_INDEPENDENT
    for (int k = 0; k < 3 * view.nreact; k++) own[k] = f[k] - own[k];
  }

  /// For a loop over pairs: what this takes, beside the tally of the pair style. Energies: the pairs have some.
  template <class Tally, bool Energies> struct Beside {
    static constexpr bool stored = Energies;
    PairWork &work;
    Tally &other;
    int nreact;
    const bool potential = Energies && (other.potential || !work.is_quick);

    void operator()(const PairRange &range, const PairBlock &block)
    {
      other(range, block);
      if constexpr (Energies) work.add(range, block, nreact);
      work.add_forces(range, block, nreact);
    }
  };

  double memory_usage() const { return bytes_of(force, damping, images); }

 private:
  struct LaneSums {
    LaneSum elastic, forgotten, contacts, past_cutoff, plastic;
  };
  bool fresh = false, changed = false;
  double broken = 0.0, last_missing = 0.0;
  long count_past = 0, last_past = -1;
  LaneSums found;
};

}    // namespace EVP
