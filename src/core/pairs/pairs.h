// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/base/simd.h"
#include "core/law/law.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace EVP {

// In a lattice whole shells of neighbors lie at a cutoff, and the round-off of a position must not
// decide. A pair counts as within a distance up to these shares of it. They grow in this
// order: what just misses the recording is no new pair, what is recorded acts at rest, and the
// neighbor list holds all of them.
constexpr double NEW_PAIR_MARGIN = 0.5e-9;
constexpr double RECORD_MARGIN = 1.0e-9;
constexpr double BOND_MARGIN = 2.0e-9;
constexpr double LIST_MARGIN = 3.0e-9;

// Two centres closer than this share of R_i + R_j coincide but for round-off: no direction is theirs.
constexpr double COINCIDENT = 1.0e-9;

inline double cutoff_squared(double cutoff, double margin)
{
  const double edge = cutoff * (1.0 + margin);
  return edge * edge;
}
inline double cutoff_of(double cutsq, double margin)
{
  return std::sqrt(cutsq) / (1.0 + margin);
}

/// The distance of a pair, or, past its cutoff, that: so far a bond flows, and so much it stores.
EVP_INLINE double up_to_cutoff(double dsq, double cutsq, double cutoff)
{
  return dsq > cutsq ? cutoff : std::sqrt(dsq);
}

struct Vector {
  double x = 0.0, y = 0.0, z = 0.0;

  Vector() = default;
  Vector(double x_in, double y_in, double z_in) : x(x_in), y(y_in), z(z_in) {}
  explicit Vector(const double *from) : Vector(from[0], from[1], from[2]) {}

  Vector operator+(const Vector &b) const { return {x + b.x, y + b.y, z + b.z}; }
  Vector operator-(const Vector &b) const { return {x - b.x, y - b.y, z - b.z}; }
  Vector operator*(double s) const { return {x * s, y * s, z * s}; }
  friend double dot(const Vector &a, const Vector &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

  void add_to(double *to) const { (Vector(to) + *this).store(to); }
  void subtract_from(double *to) const { (Vector(to) - *this).store(to); }
  void store(double *to) const
  {
    to[0] = x;
    to[1] = y;
    to[2] = z;
  }
};

/// Relative position of a pair, from j to i.
struct PairGeometry : Vector {
  double dsq;
  PairGeometry(const double (*at)[3], int i, int j) :
      Vector(Vector(at[i]) - Vector(at[j])), dsq(dot(*this, *this))
  {
  }
};

/// Distances of pairs that the owners of both particles hold, the same to the last bit for both, so that they decide alike
/// what begins or ends: the position of a periodic image has round-off, and that of i another one than that of j. Empty where
/// no pair is held twice, or no ghost is an image.
struct OwnerDistances {
  bool acts = false;    ///< the same on all ranks
  int nlocal = 0;
  AtomValues x{3};         ///< of particles and ghosts: where the owner has it [length]
  AtomValues shifts{3};    ///< likewise: whole periods from there to the image [length]

  bool empty() const { return !acts; }
  bool has(int j) const { return !empty() && j >= nlocal; }
  Vector between(int i, int j) const { return (Vector(x[j]) - Vector(x[i])) + Vector(shifts[j]); }
};

/// The force loop takes so many pairs at once.
constexpr int BLOCK_SIZE = 256;

/// One pair of a list. Its i is that of its PackedRow.
struct PackedPair : PairVariables {
  double cutsq;    ///< square of the distance beyond which nothing acts, its margin included
  int j;           ///< partner, local or ghost
  int law;         ///< index of the pair type's law
  bool is_bond;
  bool has_joined;    ///< a bond that counts in the volume energy as a pair without one

  double up_to_cutoff(double dsq) const { return EVP::up_to_cutoff(dsq, cutsq, cut); }
};

/// The pairs of one particle: [first, last) of a PairList. A particle may have several rows.
struct PackedRow {
  int i;
  int first, last;
};

/// What a force evaluation finds of a block of pairs whose flow stays, one entry per pair; nullptr without.
struct FlowArrays {
  const double *limit = nullptr;     ///< see PairVariables
  double *inv_deq_next = nullptr;    ///< where the pair would move 1/deq: see commit_flow()
  double *dissipated = nullptr;      ///< dissipated on the way there [energy]
  char *any_flow =
      nullptr;    ///< of the block: does any flow, or is a bond past its cutoff? Else neither is written
};

/// What flow has added to particles and ghosts since the owners were told.
struct FlowSums {
  enum Value {
    SLIP,     ///< sum of |ln(deq_new/deq_old)| of bonds
    WORK,     ///< half of what each pair has dissipated [energy]
    ENDED,    ///< bonds that have ended, less those that have begun
    WIDTH
  };
  AtomValues values{WIDTH};

  void reset(int n) { values.assign(n, 0.0); }
  double &of(int i, Value value) { return values[i][value]; }

  /// To both particles of a pair, those below nreact.
  void add(int i, int j, int nreact, Value value, double each)
  {
    of(i, value) += each;
    if (j < nreact) of(j, value) += each;
  }
};

/// Bonds or contacts of an MPI rank, row by row, ready for the time-step loop: one array per quantity, so that a step
/// reads no more than it uses. Room is kept between builds: arrays may be longer than size().
class PairList {
 public:
  /// Pairs are counted by int, and loops look a few blocks ahead.
  static constexpr size_t MOST = INT_MAX - 4096;

  std::vector<PackedRow> rows;
  std::vector<double> inv_deq, cutsq;    ///< see PackedPair
  std::vector<int> j, law;

  // with flow that stays, else empty
  std::vector<double> limit;                       ///< see PairVariables
  std::vector<double> inv_deq_next, dissipated;    ///< see FlowArrays
  std::vector<char> any_flow;

  /// Bits, where bonds can begin; else empty. Of a contact: what keeps it from joining. Of a bond: HAS_JOINED, with the volume
  /// energy only.
  enum Join : char { NOT_BEFORE_APART = 1, OF_TWO_BODIES = 2, HAS_JOINED = 4 };
  std::vector<char> join;
  bool joins = false;

  /// A value of each pair that an effect keeps beside those of the list until the next packing.
  struct Column {
    double of_new;             ///< of pairs that are added
    bool is_inverse_length;    ///< of the pair: see grow()
    std::vector<double> values;
    int line = -1;    ///< of BOND_VALUES, to which it returns; -1: to none
  };
  std::vector<Column> columns;

  /// Returns the place of a new one.
  size_t add_column(double of_new, bool is_inverse_length, int line = -1)
  {
    columns.push_back({of_new, is_inverse_length, std::vector<double>(count, of_new), line});
    return columns.size() - 1;
  }

  explicit PairList(bool are_bonds_in) : are_bonds(are_bonds_in) {}
  const bool are_bonds;

  size_t size() const { return count; }
  Flow flow() const { return flow_; }
  double cutoff_margin() const { return margin; }
  bool is_plastic() const { return flow_ != Flow::REVERSIBLE; }

  /// margin: of the cutoffs of its pairs.
  void clear(double margin_in, Flow flow_in)
  {
    columns.clear();
    std::vector<char>().swap(join);
    joins = false;
    count = 0;
    rows.clear();
    margin = margin_in;
    flow_ = flow_in;
    std::fill(any_flow.begin(), any_flow.end(), 0);
    if (is_plastic()) return;
    std::vector<char>().swap(any_flow);
    for (auto *values : {&limit, &inv_deq_next, &dissipated}) std::vector<double>().swap(*values);
  }

  /// Room for n more pairs, [size(), size() + n); those that are there stay. False where there are too many.
  bool make_room(size_t n)
  {
    if (n > MOST || count > MOST - n) return false;
    if (count + n > j.size()) {
      const size_t larger = std::max(count + n, j.size() + j.size() / 2);
      for (auto *values : {&inv_deq, &cutsq}) values->resize(larger);
      for (auto *values : {&j, &law}) values->resize(larger);
    }
    if (is_plastic() && count + n > dissipated.size()) {
      for (auto *values : {&limit, &inv_deq_next, &dissipated}) values->resize(j.size());
      any_flow.resize(j.size() / BLOCK_SIZE + 1);
    }
    return true;
  }

  /// Writes pair n to the room.
  void set(size_t n, int partner, double deq, double cutoff, int law_in = 0)
  {
    inv_deq[n] = 1.0 / deq;
    cutsq[n] = cutoff_squared(cutoff);
    j[n] = partner;
    law[n] = law_in;
  }

  /// Takes n pairs of particle i that were written to the room.
  void add_row(int i, int n)
  {
    if (n == 0) return;
    const int first = (int) count;
    rows.emplace_back();
    PackedRow &row = rows.back();    // copying a whole row would wait for its members
    row.i = i;
    row.first = first;
    row.last = first + n;
    count += n;
    if (joins) join.resize(count, 0);
    for (Column &column : columns) column.values.resize(count, column.of_new);
  }

  double cutoff_squared(double cutoff) const { return EVP::cutoff_squared(cutoff, margin); }

  /// The pair with that index.
  PackedPair pair(size_t n) const
  {
    return {{inv_deq[n], flow_, is_plastic() ? limit[n] : 0.0, cutoff_of(cutsq[n], margin)},
            cutsq[n],
            j[n],
            law[n],
            are_bonds,
            joins && (join[n] & HAS_JOINED) != 0};
  }

  /// Of the block that begins at pair n.
  FlowArrays flow_arrays(size_t n)
  {
    if (!is_plastic()) return {};
    return {&limit[n], &inv_deq_next[n], &dissipated[n], &any_flow[n / BLOCK_SIZE]};
  }

  /// Takes out the pairs with these indices, which ascend.
  void remove(const std::vector<int> &out)
  {
    const auto keep = [&](auto &values) {
      if (values.empty()) return;
      size_t to = out.front(), next = 0;
      for (size_t from = to; from < count; from++) {
        if (next < out.size() && (size_t) out[next] == from)
          next++;
        else
          values[to++] = values[from];
      }
    };
    if (out.empty()) return;
    for (auto *values : {&inv_deq, &cutsq, &limit, &inv_deq_next, &dissipated}) keep(*values);
    for (auto *values : {&j, &law}) keep(*values);
    // adding rows resizes these
    const std::vector<char> kept = keep_apart(join, keep);
    std::vector<Column> kept_columns = keep_apart(columns, [&](std::vector<Column> &all) {
      for (Column &column : all) keep(column.values);
    });
    const std::vector<PackedRow> before = rows;
    rows.clear();
    count = 0;
    auto next = out.begin();
    for (const PackedRow &row : before) {
      const auto first = std::exchange(next, std::lower_bound(next, out.end(), row.last));
      add_row(row.i, row.last - row.first - (int) (next - first));
    }
    if (joins) std::copy_n(kept.begin(), count, join.begin());
    for (Column &column : kept_columns) column.values.resize(count);
    columns.swap(kept_columns);
  }

  /// The lengths of each pair become ratio(i, j) times as large.
  template <class F> void grow(F &&ratio)
  {
    for (const PackedRow &row : rows)
      for (int n = row.first; n < row.last; n++) {
        const double by = ratio(row.i, j[n]);
        inv_deq[n] /= by;
        cutsq[n] *= by * by;
        for (Column &column : columns)
          if (column.is_inverse_length) column.values[n] /= by;
      }
  }

  int owner_of(int n) const
  {
    return std::upper_bound(rows.begin(), rows.end(), n,
                            [](int index, const PackedRow &row) {
                              return index < row.last;
                            })
        ->i;
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
    double bytes =
        bytes_of(rows, inv_deq, cutsq, j, law, limit, inv_deq_next, dissipated, any_flow, join);
    for (const Column &column : columns) bytes += bytes_of(column.values);
    return bytes;
  }

 private:
  size_t count = 0;
  double margin = 0.0;
  Flow flow_ = Flow::REVERSIBLE;

  // what keep() leaves of the values, which are empty from then on
  template <class T, class F> static T keep_apart(T &values, F &&keep)
  {
    T apart;
    apart.swap(values);
    keep(apart);
    return apart;
  }
};

/// Weight of a pair with partner j in sums over all MPI ranks: where a ghost takes no reaction, its
/// owner holds the pair too.
inline double rank_share(int j, int nreact)
{
  return j < nreact ? 1.0 : 0.5;
}

/// Calls f(particle, its partner) for i and, where it takes reactions, for j: sums over the pairs of each particle, with
/// PerAtomComm::reverse_comm() after the loop.
template <class F> EVP_INLINE void for_each_end(int i, int j, int nreact, F &&f)
{
  f(i, j);
  if (j < nreact) f(j, i);
}

/// All pairs of one MPI rank, rebuilt with the neighbor list.
struct PairLists {
  PairList bonds{true}, contacts{false};
  std::vector<double> limits;            ///< with plasticity, of particles and ghosts: see Limit
  std::vector<double> contact_limits;    ///< of contacts, where they have others than bonds
  std::vector<double>
      growth;    ///< of particles and ghosts: by how much larger they are than in the records; empty: as there
  long build = 0;           ///< counts the packings: indices of pairs hold as long as it does
  long common_build = 0;    ///< counts those that were collective
  int nlocal = 0;           ///< particles that the lists were built for: own,
  int nall = 0;             ///< and with ghosts
  int nreact = 0;           ///< below it they take reactions: ghosts do where newton is on

  size_t size() const { return bonds.size() + contacts.size(); }

  /// By how much larger the lengths of a pair are than in the records.
  double growth_of(int i, int j) const
  {
    return growth.empty() ? 1.0 : 0.5 * (growth[i] + growth[j]);
  }

  const std::vector<double> &limits_of(bool bonds) const
  {
    return bonds || contact_limits.empty() ? limits : contact_limits;
  }

  /// How far a pair holds: by the limits of its particles, or its own, which goes before, or is 0.
  static double limit_of(double own, double one, double other)
  {
    return own > 0.0 ? own : std::min(one, other);
  }
  double limit_of(const PairList &list, double own, int i, int j) const
  {
    const std::vector<double> &all = limits_of(list.are_bonds);
    return limit_of(own, all[i], all[j]);
  }

  double memory_usage() const
  {
    return bonds.memory_usage() + contacts.memory_usage() + bytes_of(limits, contact_limits);
  }
};

/// A packed pair at given positions.
struct PlacedPair : PackedPair {
  int i;             ///< of its row
  int index;         ///< in its list
  int number;        ///< among all pairs of both lists
  PairGeometry g;    ///< at the positions

  bool is_past_cutoff() const { return g.dsq > cutsq; }

  /// Has it a force? A contact that flowed has none from its deq on, where what is left of a bond that ended begins.
  bool acts() const
  {
    const bool apart = flow == Flow::PLASTIC_CONTACT && distance() * inv_deq > 1.0 - CONTACT_MARGIN;
    return !is_past_cutoff() && !apart;
  }
  double distance() const { return std::sqrt(g.dsq); }
  Vector direction() const { return {g.x / distance(), g.y / distance(), g.z / distance()}; }

  /// d/deq, past the cutoff that there.
  double ratio() const { return up_to_cutoff(g.dsq) * inv_deq; }
};

/// Calls f(PlacedPair) for all pairs of a list in its order, those past their cutoff too. first: number of the first.
/// All loops over pairs but that of the timestep (pair_block.h) are this one.
template <class F>
void for_each_pair(const PairList &list, const double (*x)[3], F &&f, int first = 0)
{
  for (const PackedRow &row : list.rows)
    for (int k = row.first; k < row.last; k++) {
      const PackedPair pair = list.pair(k);
      f(PlacedPair{pair, row.i, k, first + k, PairGeometry(x, row.i, pair.j)});
    }
}

/// The same for bonds, then contacts.
template <class F> void for_each_pair(const PairLists &lists, const double (*x)[3], F &&f)
{
  for_each_pair(lists.bonds, x, f);
  for_each_pair(lists.contacts, x, f, (int) lists.bonds.size());
}

/// Exchanges values of particles and their ghosts between MPI ranks. Collective.
class PerAtomComm {
 public:
  /// Ghosts take the values of their owners.
  virtual void forward_comm(AtomValues &) = 0;

  /// The same for velocities: periodic images may move against their owners.
  virtual void forward_comm_velocities(AtomValues &velocities) { forward_comm(velocities); }

  /// Owners add what their ghosts hold; nothing where ghosts take no reactions.
  virtual void reverse_comm(AtomValues &) = 0;

  /// Of a value of each MPI rank.
  virtual double sum(double here) = 0;

 protected:
  ~PerAtomComm() = default;
};

}    // namespace EVP
