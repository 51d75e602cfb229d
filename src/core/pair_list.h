// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/simd.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstddef>
#include <vector>

namespace EVP {

// In a lattice whole shells of neighbors lie at the edge of a reach, and the round-off of a position
// must not decide. A pair counts as within a reach up to these shares of it. They grow in this
// order: what just misses the recording is no new pair, what is recorded acts at rest, and the
// neighbor list holds all of them.
constexpr double NEW_PAIR_MARGIN = 0.5e-9;
constexpr double RECORD_MARGIN = 1.0e-9;
constexpr double BOND_MARGIN = 2.0e-9;
constexpr double LIST_MARGIN = 3.0e-9;

// Two centres closer than this share of R_i + R_j coincide but for round-off: no direction is theirs.
constexpr double COINCIDENT = 1.0e-9;

/// Square of a reach with its margin.
inline double reach_squared(double reach, double margin)
{
  const double edge = reach * (1.0 + margin);
  return edge * edge;
}

/// Relative position of a pair, from j to i.
struct PairGeometry {
  double dx, dy, dz, dsq;
  PairGeometry(const double (*x)[3], int i, int j) :
      dx(x[i][0] - x[j][0]), dy(x[i][1] - x[j][1]), dz(x[i][2] - x[j][2]),
      dsq(dx * dx + dy * dy + dz * dz)
  {
  }
};

/// What changes with a pair.
struct PairHistory {
  double q;         ///< offset/deq of flow that stays
  double k;         ///< accumulated plastic strain
  double work;      ///< dissipated by flow so far [energy]
  double broken;    ///< 1 once a bond has broken for good, else 0

  /// As so many doubles it migrates, and is in restart files.
  static constexpr int WORDS = 4;

  friend bool operator==(const PairHistory &a, const PairHistory &b)
  {
    return a.q == b.q && a.k == b.k && a.work == b.work && a.broken == b.broken;
  }
};
static_assert(sizeof(PairHistory) == PairHistory::WORDS * sizeof(double), "doubles only");

/// Next offset of a contact that has ended: 0 as of one that has flowed back, but for the sign.
constexpr double CONTACT_ENDED = -0.0;
inline bool has_ended(double next_offset)
{
  return next_offset == 0.0 && std::signbit(next_offset);
}

/// The force loop takes so many pairs at once.
constexpr int BLOCK_SIZE = 256;

/// What a force evaluation reads and writes of pairs whose flow stays, one entry per pair.
struct FlowArrays {
  const double *offset = nullptr;    ///< q/deq in force
  const double *work = nullptr;      ///< dissipated by flow so far [energy]
  const double *cap = nullptr;       ///< see Law::cap()
  double *next_offset = nullptr;     ///< where the pair would move them: taken over by commit()
  double *spent = nullptr;           ///< dissipated on the way there [energy]
  char *moves = nullptr;    ///< of each block: is any pair on its way? If not, spent is not written

  /// Those of pair k, where a block begins, and the ones that follow it; all nullptr without.
  FlowArrays from(size_t k) const
  {
    if (!offset) return {};
    return {offset + k, work + k, cap + k, next_offset + k, spent + k, moves + k / BLOCK_SIZE};
  }
};

/// One pair of the neighbor list, ready for the time-step loop. Its i is that of its PackedRow.
struct PackedPair {
  double inv_deq;    ///< 1/deq [1/length]
  double cutsq;      ///< square of the distance beyond which nothing acts, its margin included
  double cut;        ///< that distance without the margin: there the energy is zero [length]
  int j;             ///< partner, local or ghost
  int law;           ///< index of the pair type's Law
  int slot;          ///< of its record at i, see BondStore; below 0 where it is no bond
  double offset;     ///< q/deq of a pair whose flow stays, else 0

  bool is_bond() const { return slot >= 0; }

  /// A bond that broke is no bond any more, but has a record.
  static constexpr int slot_of_broken(int record) { return -2 - record; }
  bool has_record() const { return slot != NO_SLOT; }
  int record() const { return slot >= 0 ? slot : slot_of_broken(slot); }
  static constexpr int NO_SLOT = -1;
};

/// Packed pairs as one array per quantity, so that a step reads no more than it uses. Room is kept
/// between builds: arrays may be longer than size().
class PackedPairs {
 public:
  /// Pairs are counted by int, and loops look a few blocks ahead.
  static constexpr size_t MOST = INT_MAX - 4096;

  /// May n more pairs be added to count?
  static constexpr bool fits(size_t count, size_t n) { return n <= MOST && count <= MOST - n; }

  std::vector<double> inv_deq, cutsq;    ///< see PackedPair
  std::vector<int> j, kind, slot;        ///< kind: 2 law + is_bond
  double margin_removed[2];              ///< take the margin out of a cut: of new pairs, of bonds

  // with flow that stays, empty without: see FlowArrays
  std::vector<double> offset, next_offset, work, spent, cap;
  std::vector<char> moves;

  PackedPairs() { clear(); }
  size_t size() const { return count; }

  /// new_pair_margin: of the cuts of pairs that were not recorded. flows: pairs have an offset.
  void clear(double new_pair_margin = NEW_PAIR_MARGIN, bool flows_in = false)
  {
    count = 0;
    flows = flows_in;
    if (flows) std::fill(moves.begin(), moves.end(), 0);
    if (!flows) {
      std::vector<char>().swap(moves);
      for (auto *values : {&offset, &next_offset, &work, &spent, &cap})
        std::vector<double>().swap(*values);
    }
    margins[0] = new_pair_margin;
    for (int k = 0; k < 2; k++) margin_removed[k] = 1.0 / (1.0 + margins[k]);
  }

  /// Where pairs to come go, one array per quantity.
  struct Room {
    double *inv_deq, *cutsq;
    int *j, *kind, *slot;
    double *offset, *work, *cap;    // nullptr without

    void take_history(size_t k, const PairHistory &history) const
    {
      offset[k] = history.q;
      work[k] = history.work;
    }
  };

  /// Room for n more pairs; those that are there stay.
  Room room(size_t n)
  {
    if (count + n > j.size()) {
      const size_t larger = std::max(count + n, j.size() + j.size() / 2);
      for (auto *values : {&inv_deq, &cutsq}) values->resize(larger);
      for (auto *values : {&j, &kind, &slot}) values->resize(larger);
    }
    if (flows && count + n > offset.size()) {
      for (auto *values : {&offset, &next_offset, &work, &spent, &cap}) values->resize(j.size());
      moves.resize(j.size() / BLOCK_SIZE + 1);
    }
    return {inv_deq.data() + count,
            cutsq.data() + count,
            j.data() + count,
            kind.data() + count,
            slot.data() + count,
            flows ? offset.data() + count : nullptr,
            flows ? work.data() + count : nullptr,
            flows ? cap.data() + count : nullptr};
  }

  /// Takes n pairs that were written to the room.
  void add(size_t n) { count += n; }

  PackedPair operator[](size_t k) const
  {
    const double cut = std::sqrt(cutsq[k]) * margin_removed[kind[k] & 1];
    return {inv_deq[k], cutsq[k], cut, j[k], kind[k] / 2, slot[k], flows ? offset[k] : 0.0};
  }

  /// With flow only.
  void take_history(size_t k, const PairHistory &history)
  {
    offset[k] = history.q;
    work[k] = history.work;
  }

  PairHistory history_of(size_t k) const
  {
    return {flows ? offset[k] : 0.0, 0.0, flows ? work[k] : 0.0,
            slot[k] < PackedPair::NO_SLOT ? 1.0 : 0.0};
  }

  /// What the last force evaluation would change comes into force.
  void commit()
  {
    offset.swap(next_offset);
    for (size_t block = 0; block * BLOCK_SIZE < count; block++) {
      if (!moves[block]) continue;
      moves[block] = 0;
      const size_t first = block * BLOCK_SIZE, last = std::min(first + BLOCK_SIZE, count);
      for (size_t k = first; k < last; k++) work[k] += spent[k];
    }
  }

  /// All nullptr without.
  FlowArrays flow()
  {
    if (!flows) return {};
    return {offset.data(), work.data(), cap.data(), next_offset.data(), spent.data(), moves.data()};
  }
  bool has_flow() const { return flows; }

  /// Pair k is no bond any more: from now on it repels below rest [length], or does nothing at 0.
  /// cap_of_contact: see Law::cap().
  void turn_into_contact(size_t k, double rest, double cap_of_contact)
  {
    slot[k] = PackedPair::slot_of_broken(slot[k]);
    kind[k] &= ~1;
    cutsq[k] = rest > 0.0 ? reach_squared(rest, false) : 0.0;
    if (rest > 0.0) inv_deq[k] = 1.0 / rest;
    if (!flows) return;
    offset[k] = next_offset[k] = work[k] = spent[k] = 0.0;
    cap[k] = cap_of_contact;
  }

  /// Square of a cut with the margin of new pairs or of bonds.
  double reach_squared(double cut, bool is_bond) const
  {
    return EVP::reach_squared(cut, margins[is_bond]);
  }

  /// Prefetches what a step with one law reads of the block from pair `first` on, if there is one, and what further
  /// arrays have for its pairs.
  template <class... T> void prefetch(size_t first, const T *...further) const
  {
    if (first >= count) return;
    const size_t n = std::min<size_t>(BLOCK_SIZE, count - first);
    const auto one = [&](const auto *array) {
      EVP::prefetch(array + first, n * sizeof(*array));
    };
    one(inv_deq.data());
    one(cutsq.data());
    one(j.data());
    (one(further), ...);
  }

  double memory_usage() const
  {
    return bytes_of(inv_deq, cutsq, j, kind, slot, offset, next_offset, work, spent, cap, moves);
  }

 private:
  size_t count = 0;
  bool flows = false;
  double margins[2] = {NEW_PAIR_MARGIN, BOND_MARGIN};    // of new pairs, of bonds
};

/// The pairs of one particle: [first, last) of PairList::pairs.
struct PackedRow {
  int i;
  int first, last;
};

/// Weight of a pair with partner j in sums over all MPI ranks: where a ghost takes no reaction, its
/// owner holds the pair too.
inline double rank_share(int j, int nreact)
{
  return j < nreact ? 1.0 : 0.5;
}

/// All pairs of one MPI rank, row by row, rebuilt with the neighbor list.
struct PairList {
  std::vector<PackedRow> rows;
  PackedPairs pairs;
  long build = 0;           ///< counts the packings: indices of pairs hold as long as it does
  long common_build = 0;    ///< counts those that were collective
  int nlocal = 0;           ///< particles that the list was built for: own,
  int nall = 0;             ///< and with ghosts

  /// Particles below this index take reactions: ghosts do where newton is on.
  int nreact(bool newton) const { return newton ? nall : nlocal; }

  void clear(double new_pair_margin = NEW_PAIR_MARGIN, bool flows = false)
  {
    build++;
    rows.clear();
    pairs.clear(new_pair_margin, flows);
  }
  double memory_usage() const { return bytes_of(rows) + pairs.memory_usage(); }
};

/// Index of the pair of an atom with a row and a partner, -1 if the list does not have it.
template <class IsPartner>
int find_pair(const PairList &list, const PackedRow &row, IsPartner &&is_partner)
{
  for (int k = row.first; k < row.last; k++)
    if (is_partner(list.pairs.j[k])) return k;
  return -1;
}

/// A packed pair at given positions.
struct PlacedPair : PackedPair {
  int i, index;      ///< of its row; index in the list
  PairGeometry g;    ///< at the positions

  bool is_beyond() const { return g.dsq > cutsq; }
  double distance() const { return std::sqrt(g.dsq); }
};

/// Calls f(PlacedPair) for all pairs of the list in its order, those beyond their cut-off too.
/// All loops over pairs but that of the timestep (force_loop.h) are this one.
template <class F> void for_each_pair(const PairList &list, const double (*x)[3], F &&f)
{
  for (const PackedRow &row : list.rows)
    for (int k = row.first; k < row.last; k++) {
      const PackedPair pair = list.pairs[k];
      f(PlacedPair{pair, row.i, k, PairGeometry(x, row.i, pair.j)});
    }
}

}    // namespace EVP
