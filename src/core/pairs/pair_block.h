// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"
#include "core/law/law.h"
#include "core/pairs/pairs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace EVP {

/// Up to SIZE pairs of a list between gathering and scattering. Relative positions are from j to i.
struct PairBlock {
  static constexpr int SIZE = BLOCK_SIZE;

  int n;                    ///< pairs in this block
  const double *inv_deq;    ///< of each pair, see PackedPair
  const double *cutsq;
  const int *law;
  FlowArrays flow;    ///< with flow that stays
  double margin;      ///< of the cutoffs, see PairList

  alignas(64) double xy[2 * SIZE];      ///< relative position: x and y side by side [length]
  alignas(64) double z[SIZE];           ///< [length]
  alignas(64) double approach[SIZE];    ///< (x_i - x_j).(v_i - v_j), with damping only
  alignas(64) double force[SIZE];       ///< result: force/d [force/length], 0 past the cutoff

  // results where energies are asked for; damping always
  alignas(64) double elastic[SIZE],
      second[SIZE];                      ///< see Stored, past the cutoff those at it [energy]
  alignas(64) double at_cutoff[SIZE];    ///< stored at the cutoff; 0 where flow stays [energy]
  alignas(64) double potential[SIZE];    ///< what the force is the slope of [energy]
  alignas(64) double damping[SIZE];      ///< of the force the damping, where there is any

  EVP_INLINE double distance_squared(int k) const
  {
    return xy[2 * k] * xy[2 * k] + xy[2 * k + 1] * xy[2 * k + 1] + z[k] * z[k];
  }
  double relative(int component, int k) const
  {
    return component < 2 ? xy[2 * k + component] : z[k];
  }
};

/// The laws of the pairs of a list, and the fastest way through a block of these on the machine that runs. The numbers are
/// the same on every instruction set: no step of a sum is fused or moved.
class BlockLaw {
 public:
  /// What else than forces is asked for.
  struct Asked {
    bool damping = false;      ///< the forces of the damping too
    bool stored = false;       ///< what pairs hold
    bool potential = false;    ///< stored as well; zero at the cutoff where flow is second
    bool incremental =
        false;    ///< the potential holds what the flow dissipates, past the cutoff too
  };

  /// laws: indexed by PackedPair::law. used: indices of those that the pairs have; where these are alike, one is for all
  /// pairs.
  void assign(const std::vector<PairLaw> &laws, const std::vector<int> &used, Flow);

  /// Fills the results of a block of a list of this flow.
  std::function<void(PairBlock &, const Asked &)> evaluate = without_force;

 private:
  static void without_force(PairBlock &, const Asked &);
};

/// Particle data of one MPI rank, as [n][3] arrays. f is added to.
struct ParticleView {
  const double (*x)[3];
  const double (*v)[3];    ///< nullptr: without damping
  double (*f)[3];
  int nreact;    ///< particles below this index take the reaction: all with newton on, else own
};

/// Damping force over distance [force/length]: F_D = -gamma (u.(v_i - v_j)) u (eq. 4).
inline double damping_over_distance(double gamma, const PairGeometry &g, const double *vi,
                                    const double *vj)
{
  return -gamma * dot(g, Vector(vi) - Vector(vj)) / g.dsq;
}

/// A run of pairs of a list, with the row where it begins.
struct PairRange {
  const PairList &list;
  const PackedRow *row;
  int first, last;

  /// Calls f(i, first, last) for the pairs of each particle in the range.
  template <class F> void for_each_row(F &&f) const
  {
    for (const PackedRow *r = row;; r++) {
      f(r->i, std::max(r->first, first), std::min(r->last, last));
      if (r->last >= last) break;
    }
  }
};

/// Lists of more pairs do not stay in the caches: there prefetching pays, else it costs 4 %.
constexpr int CACHED_PAIRS = 400000;

/// Calls f(range) for all pairs of the list, PairBlock::SIZE at once. further: arrays by pair that f reads beside the list.
template <class F, class... T> void for_each_block(const PairList &list, F &&f, const T *...further)
{
  const int npairs = (int) list.size();
  PairRange range = {list, list.rows.data(), 0, 0};
  for (; range.first < npairs; range.first = range.last) {
    range.last = std::min(range.first + PairBlock::SIZE, npairs);
    while (range.row->last <= range.first) range.row++;
    if (npairs > CACHED_PAIRS) list.prefetch(range.first + 4 * PairBlock::SIZE, further...);
    f(range);
  }
}

/// A link of the chain that each block with pairs within their cutoffs passes between the law and the scattering of its
/// forces. It may change the forces; those after it see that. Forces are evaluated at set-up too, and may be again at the
/// same step: what flows there is no more than found, until commit_flow().
class PairConsumer {
 public:
  /// Adds what it needs of the pairs of a list, beside forces and those of the damping, where there is any.
  virtual void ask(const PairList &, BlockLaw::Asked &) const {}
  virtual void operator()(const PairRange &, PairBlock &) = 0;

 protected:
  ~PairConsumer() = default;
};

/// Relative positions of the pairs of a range; with damping how fast they part, times distance.
template <bool Damping>
void gather(const ParticleView &view, const PairRange &range, PairBlock &block)
{
  const PairList &list = range.list;
  const int *const partner = list.j.data();
  block.n = range.last - range.first;
  block.inv_deq = list.inv_deq.data() + range.first;
  block.cutsq = list.cutsq.data() + range.first;
  block.law = list.law.data() + range.first;
  block.margin = list.cutoff_margin();
  const auto *const x = view.x;
  const auto *const v = Damping ? view.v : view.x;    // read only if needed
  range.for_each_row([&](int i, int first, int last) {
    const double xi = x[i][0], yi = x[i][1], zi = x[i][2];
    const double vx = v[i][0], vy = v[i][1], vz = v[i][2];
    EVP_UNROLL
    for (int k = first; k < last; k++) {
      const int j = partner[k], b = k - range.first;
      const double dx = xi - x[j][0], dy = yi - x[j][1], dz = zi - x[j][2];
      block.xy[2 * b] = dx;
      block.xy[2 * b + 1] = dy;
      block.z[b] = dz;
      if constexpr (Damping)
        block.approach[b] = dx * (vx - v[j][0]) + dy * (vy - v[j][1]) + dz * (vz - v[j][2]);
    }
  });
}

/// Adds the forces of a block, force/d of each pair, to f of its particles; those of i are summed apart, row by row.
EVP_INLINE void scatter(const PairRange &range, const PairBlock &block, const double *force,
                        int nreact, double (*f)[3])
{
  const int *const partner = range.list.j.data();
  range.for_each_row([&](int i, int first, int last) {
    double fx = 0.0, fy = 0.0, fz = 0.0;
    EVP_UNROLL
    for (int k = first; k < last; k++) {
      const int j = partner[k], b = k - range.first;
      const double px = block.xy[2 * b] * force[b], py = block.xy[2 * b + 1] * force[b];
      const double pz = block.z[b] * force[b];
      fx += px;
      fy += py;
      fz += pz;
      if (j >= nreact) continue;
      f[j][0] -= px;
      f[j][1] -= py;
      f[j][2] -= pz;
    }
    f[i][0] += fx;
    f[i][1] += fy;
    f[i][2] += fz;
  });
}

/// How many pairs of a block are past their cutoff, or by this share of its square below it.
EVP_INLINE int count_past_cutoff(const PairBlock &block, double slack = 0.0)
{
  int count = 0;
  for (int k = 0; k < block.n; k++)
    count += (int) (block.distance_squared(k) > block.cutsq[k] * (1.0 - slack));
  return count;
}

/// What pairs of a list change by the forces of a step, as it is found by these.
class ChangingPairs : public PairConsumer {
 public:
  std::vector<int> found;    ///< indices of pairs
  /// Of these, as the forces saw them [length^2]: atoms may move before the step ends.
  std::vector<double> squared_distances;
  const OwnerDistances *owners = nullptr;

  void clear()
  {
    found.clear();
    squared_distances.clear();
  }

 protected:
  ~ChangingPairs() = default;

  static constexpr double ROUND_OFF = 1.0e-12;    // of squared distances, as both owners see them
  bool any_owners() const { return owners && !owners->empty(); }
  double slack() const { return any_owners() ? ROUND_OFF : 0.0; }
  double distance_squared(const PairBlock &block, const PairRange &range, int i, int n) const
  {
    const int j = range.list.j[n];
    if (!owners || !owners->has(j)) return block.distance_squared(n - range.first);
    const Vector r = owners->between(i, j);
    return dot(r, r);
  }
  void take(int n, double dsq)
  {
    found.push_back(n);
    squared_distances.push_back(dsq);
  }
};

/// Says of which particles and ghosts a bond fails.
class FailureCriterion {
 public:
  virtual bool fails(int i, int j) const = 0;

  /// Does no bond begin between them?
  virtual bool bars_joining(int /*i*/, int /*j*/) const { return false; }

 protected:
  ~FailureCriterion() = default;
};

/// Says which contacts of two bodies become bonds.
class JoiningCriterion {
 public:
  /// r: from one to the other, either way [length]
  virtual bool may_join(int i, int j, const Vector &r) const = 0;

 protected:
  ~JoiningCriterion() = default;
};

/// Bonds of a list that end: past their cutoff, or where they fail.
struct EndingBonds final : ChangingPairs {
  std::vector<const FailureCriterion *> criteria;

  /// Takes those of a block; mostly none ends. Those that fail have neither force nor potential any more.
  void operator()(const PairRange &range, PairBlock &block) override
  {
    if (criteria.empty() && !any_past(block)) return;
    range.for_each_row([&](int i, int first, int last) {
      for (int n = first; n < last; n++) {
        const int k = n - range.first;
        const double dsq = distance_squared(block, range, i, n);
        const bool past = dsq > block.cutsq[k];
        if (!past && !fails(i, range.list.j[n])) continue;
        take(n, dsq);
        if (!past) block.force[k] = block.damping[k] = block.potential[k] = 0.0;
      }
    });
  }

 private:
  bool any_past(const PairBlock &block) const
  {
    if (!any_owners() && block.flow.any_flow && !*block.flow.any_flow) return false;
    return call_vectorized([&, margin = slack()]() EVP_KERNEL {
      return count_past_cutoff(block, margin) > 0;
    });
  }
  bool fails(int i, int j) const
  {
    return std::any_of(criteria.begin(), criteria.end(), [=](const FailureCriterion *one) {
      return one->fails(i, j);
    });
  }
};

/// Contacts of a list that become bonds, as they come within a distance, and those that may from now on, as they are
/// apart.
struct BeginningBonds final : ChangingPairs {
  std::vector<int> released;           ///< indices of pairs
  std::vector<int> entered;            ///< of two bodies, that came as near
  double within = 0.0, apart = 0.0;    ///< squares of both distances over R_i + R_j

  void clear()
  {
    ChangingPairs::clear();
    released.clear();
    entered.clear();
  }

  void operator()(const PairRange &range, PairBlock &block) override
  {
    const char *const join = range.list.join.data() + range.first;
    const int near = call_vectorized([&, most = within * (1.0 + slack())]() EVP_KERNEL {
      int count = 0;
      for (int k = 0; k < block.n; k++)
        count += (int) (block.distance_squared(k) <= most * block.cutsq[k]);
      return count;
    });
    if (near == 0 && std::none_of(join, join + block.n, keeps_inside)) return;
    range.for_each_row([&](int i, int first, int last) {
      for (int n = first; n < last; n++) {
        const int k = n - range.first;
        const double dsq = distance_squared(block, range, i, n);
        if (keeps_inside(join[k]) && dsq > apart * block.cutsq[k]) released.push_back(n);
        if (keeps_inside(join[k]) || dsq > within * block.cutsq[k]) continue;
        if (join[k] != 0)
          entered.push_back(n);
        else
          take(n, dsq);
      }
    });
  }

 private:
  static bool keeps_inside(char join) { return join & PairList::NOT_BEFORE_APART; }
};

/// Adds the forces of all interacting pairs of a list to view.f: what one time step does, and nothing else. Everything a
/// pair needs was looked up when the list was packed. Pairs are gathered in blocks, the law goes over a block at once,
/// consumers follow in their order, and the forces are scattered.
void accumulate_forces(PairList &list, const BlockLaw &law, const ParticleView &view,
                       const std::vector<PairConsumer *> &consumers = {});

/// What the last evaluation of a list would change comes into force, and is added to the sums of the particles. Contacts add
/// nothing to the plastic strain.
void commit_flow(PairList &list, int nreact, FlowSums &sums);

/// A fixed number of partial sums: vectors of any width then add in the same order.
class LaneSum {
 public:
  static constexpr int LANES = 8;
  template <class Term> EVP_INLINE void add(int n, Term &&term)
  {
    double sums[LANES];    // apart from what term reads, so that they stay in registers
    for (int lane = 0; lane < LANES; lane++) sums[lane] = lanes[lane];
    int k = 0;
    for (; k + LANES <= n; k += LANES)
      for (int lane = 0; lane < LANES; lane++) sums[lane] += term(k + lane);
    for (int lane = 0; k + lane < n; lane++) sums[lane] += term(k + lane);
    for (int lane = 0; lane < LANES; lane++) lanes[lane] = sums[lane];
  }
  double total() const
  {
    double sum = 0.0;
    for (const double lane : lanes) sum += lane;
    return sum;
  }

 private:
  double lanes[LANES] = {};
};

/// Energy [energy] and virial (sum of r F as xx yy zz xy xz yz) [energy] of the pairs that it is called with.
class PairSums final : public PairConsumer {
 public:
  LaneSum energies, virials[6];

  /// nreact: pairs with a partner beyond it count half: the MPI rank that owns it has them too. potential, virial: are they
  /// wanted?
  PairSums(int nreact_in, bool potential_in, bool virial_in, bool incremental_in = false) :
      nreact(nreact_in), potential(potential_in), virial(virial_in), incremental(incremental_in)
  {
  }

  void ask(const PairList &, BlockLaw::Asked &asked) const override
  {
    asked.potential |= potential;
    asked.incremental |= incremental;
  }

  void operator()(const PairRange &range, PairBlock &block) override
  {
    const int *const j = range.list.j.data() + range.first;
    double weight[PairBlock::SIZE];    // of each pair of the block, for the virial times force/d
    for (int k = 0; k < block.n; k++) weight[k] = rank_share(j[k], nreact);
    if (potential)
      energies.add(block.n, [&](int k) {
        return weight[k] * block.potential[k];
      });
    if (!virial) return;
    for (int k = 0; k < block.n; k++) weight[k] *= block.force[k];
    constexpr int A[] = {0, 1, 2, 0, 0, 1}, B[] = {0, 1, 2, 1, 2, 2};
    for (int c = 0; c < 6; c++)
      virials[c].add(block.n, [&](int k) {
        return weight[k] * (block.relative(A[c], k) * block.relative(B[c], k));
      });
  }

 private:
  const int nreact;
  const bool potential, virial, incremental;
};

}    // namespace EVP
