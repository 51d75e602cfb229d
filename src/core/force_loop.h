// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/block_law.h"
#include "core/pair_list.h"

#include <algorithm>
#include <type_traits>

// Rows are short: the overhead of the loop counts.
#if defined(__clang__)
#define EVP_UNROLL _Pragma("clang loop unroll_count(4)")
#elif defined(__GNUC__)
#define EVP_UNROLL _Pragma("GCC unroll 4")
#else
#define EVP_UNROLL
#endif

namespace EVP {

/// Where the force loop puts what it finds of flow and breaking.
struct HistoryView {
  FlowArrays flow = {};                  ///< of the list; unused without flow
  std::vector<int> *beyond = nullptr;    ///< if given: bonds beyond their cut are appended
  bool incremental = false;              ///< see Block
};

/// Particle data of one MPI rank, as [n][3] arrays. v is read with damping only, f is added to.
struct ParticleView {
  const double (*x)[3];
  const double (*v)[3];
  double (*f)[3];
  int nreact;    ///< particles below this index take the reaction: all with newton on, else own
  HistoryView histories = {};
};

/// Damping force over distance [force/length]: F_D = -gamma (u.(v_i - v_j)) u (eq. 4).
inline double damping_over_distance(double gamma, const PairGeometry &g, const double *vi,
                                    const double *vj)
{
  const double approach = g.dx * (vi[0] - vj[0]) + g.dy * (vi[1] - vj[1]) + g.dz * (vi[2] - vj[2]);
  return -gamma * approach / g.dsq;
}

/// A run of pairs of the list, with the row where it begins.
struct PairRange {
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

/// Calls f(range) for all pairs of the list, Block::SIZE at once. further: arrays by pair that f reads beside the list.
template <class F, class... T> void for_each_block(const PairList &list, F &&f, const T *...further)
{
  const int npairs = (int) list.pairs.size();
  PairRange range = {list.rows.data(), 0, 0};
  for (; range.first < npairs; range.first = range.last) {
    range.last = std::min(range.first + Block::SIZE, npairs);
    while (range.row->last <= range.first) range.row++;
    if (npairs > CACHED_PAIRS) list.pairs.prefetch(range.first + 4 * Block::SIZE, further...);
    f(range);
  }
}

/// A tally that costs nothing.
struct NoTally {
  static constexpr bool energy = false;
  void operator()(const PairRange &, const Block &) const {}
};

/// No forces but those of the law.
struct NoMoreForces {
  static constexpr bool axial = false;
  void operator()(const PairRange &, Block &) const {}
};

/// Relative positions of the pairs of a range; with damping how fast they part, times distance.
template <bool Damping>
void gather(const PairList &list, const ParticleView &view, const PairRange &range, Block &block)
{
  const int *const partner = list.pairs.j.data();
  block.n = range.last - range.first;
  block.inv_deq = list.pairs.inv_deq.data() + range.first;
  block.cutsq = list.pairs.cutsq.data() + range.first;
  block.margin_removed = list.pairs.margin_removed;
  block.kind = list.pairs.kind.data() + range.first;
  block.flow = view.histories.flow.from(range.first);
  block.incremental = view.histories.incremental;
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

/// Adds the forces of a block to view.f of its particles; those of i are summed apart, row by row. Both: in the same order
/// also those of another force/d to g, at once.
template <bool Both>
void scatter(const PairList &list, const ParticleView &view, const PairRange &range,
             const Block &block, const double *other = nullptr, double (*g)[3] = nullptr)
{
  const int *const partner = list.pairs.j.data();
  auto *const f = view.f;
  const int nreact = view.nreact;
  range.for_each_row([&](int i, int first, int last) {
    double fx = 0.0, fy = 0.0, fz = 0.0, gx = 0.0, gy = 0.0, gz = 0.0;
    EVP_UNROLL
    for (int k = first; k < last; k++) {
      const int j = partner[k], b = k - range.first;
      const double x = block.xy[2 * b], y = block.xy[2 * b + 1], z = block.z[b];
      const double px = x * block.force[b], py = y * block.force[b], pz = z * block.force[b];
      double qx = 0.0, qy = 0.0, qz = 0.0;
      if constexpr (Both) {
        qx = x * other[b];
        qy = y * other[b];
        qz = z * other[b];
        gx += qx;
        gy += qy;
        gz += qz;
      }
      fx += px;
      fy += py;
      fz += pz;
      if (j >= nreact) continue;
      f[j][0] -= px;
      f[j][1] -= py;
      f[j][2] -= pz;
      if constexpr (!Both) continue;
      g[j][0] -= qx;
      g[j][1] -= qy;
      g[j][2] -= qz;
    }
    f[i][0] += fx;
    f[i][1] += fy;
    f[i][2] += fz;
    if constexpr (!Both) return;
    g[i][0] += gx;
    g[i][1] += gy;
    g[i][2] += gz;
  });
}

/// Appends the indices of the bonds of a block that are beyond their cut: mostly none is.
inline void note_beyond(const PairRange &range, const Block &block, std::vector<int> &beyond)
{
  int count = 0;
  for (int k = 0; k < block.n; k++)
    count += (int) (block.distance_squared(k) > block.cutsq[k]) & block.kind[k];
  for (int k = 0; count && k < block.n; k++)
    if (block.kind[k] & 1 && block.distance_squared(k) > block.cutsq[k])
      beyond.push_back(range.first + k);
}

/// True for a tally that adds the forces of its block to ParticleView::f itself, beside what it keeps.
template <class Tally, class = void> constexpr bool scatters = false;
template <class Tally>
constexpr bool scatters<Tally, std::void_t<decltype(Tally::scatters)>> = Tally::scatters;

/// Adds the forces of all interacting pairs (d <= cut) to view.f: what one time step does, and nothing
/// else. Everything a pair needs was looked up when the list was packed. Pairs are gathered in blocks,
/// the law goes over a block at once, the forces are scattered.
///
/// more(range, block) fills Block::axial where More::axial says so; tally(range, block) is called with
/// the forces, before they are scattered.
template <bool Damping, class Tally, class More = NoMoreForces>
void accumulate_forces(const PairList &list, const BlockLaw &law, const ParticleView &view,
                       Tally &&tally, const More &more = More())
{
  Block block;
  for_each_block(list, [&](const PairRange &range) {
    gather<Damping>(list, view, range, block);
    more(range, block);
    law(block, {Damping, tally.energy, More::axial});
    if (view.histories.beyond) note_beyond(range, block, *view.histories.beyond);
    tally(range, block);
    if constexpr (!scatters<std::decay_t<Tally>>) scatter<false>(list, view, range, block);
  });
}

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

/// Energy [energy] and virial (sum of r F as xx yy zz xy xz yz) [energy] of the pairs of a list.
class SumTally {
 public:
  const bool energy;    ///< energies are wanted

  /// nreact: pairs with a partner beyond it count half, as the MPI rank that owns it has them too.
  SumTally(const PairList &list_in, int nreact_in, bool energy_in, bool virial_in) :
      energy(energy_in), list(list_in), nreact(nreact_in), virial(virial_in)
  {
  }

  void operator()(const PairRange &range, const Block &block)
  {
    const int *const j = list.pairs.j.data() + range.first;
    for (int k = 0; k < block.n; k++) weight[k] = rank_share(j[k], nreact);
    if (energy)
      energies.add(block.n, [&](int k) {
        return weight[k] * block.energy[k];
      });
    if (!virial) return;
    for (int k = 0; k < block.n; k++) weight[k] *= block.force[k];
    add_virial<0, 0>(0, block);
    add_virial<1, 1>(1, block);
    add_virial<2, 2>(2, block);
    add_virial<0, 1>(3, block);
    add_virial<0, 2>(4, block);
    add_virial<1, 2>(5, block);
  }

  double total_energy() const { return energies.total(); }
  double total_virial(int component) const { return virials[component].total(); }

 private:
  const PairList &list;
  const int nreact;
  const bool virial;
  LaneSum energies, virials[6];
  double weight[Block::SIZE];    // of each pair of the block, for the virial times force/d

  template <int A, int B> void add_virial(int component, const Block &block)
  {
    virials[component].add(block.n, [&](int k) {
      return weight[k] * (block.relative<A>(k) * block.relative<B>(k));
    });
  }
};

}    // namespace EVP
