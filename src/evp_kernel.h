// SPDX-License-Identifier: GPL-2.0-only
//
// The loop over packed pairs: what one time step does, and nothing else.
// Pure C++17. Everything a pair needs was looked up when the list was packed.

#ifndef EVP_KERNEL_H
#define EVP_KERNEL_H

#include "evp_law.h"

#include <cmath>
#include <type_traits>
#include <vector>

namespace EVP {

/// One pair of the neighbor list, ready for the time-step loop. Its i is that of its PackedRow.
struct PackedPair {
  double inv_deq;    ///< 1/deq [1/length]
  double cutsq;      ///< square of the distance beyond which nothing acts [length^2]
  int j;             ///< partner, local or ghost
  int law;           ///< index of the pair type's Law
  bool is_bond;      ///< deq was recorded at the start
};

/// The pairs of one particle: [first, last) of PackedList::pairs.
struct PackedRow {
  int i;
  int first, last;
};

/// All pairs of one process, rebuilt with the neighbor list; capacity is kept between builds.
struct PackedList {
  std::vector<PackedRow> rows;
  std::vector<PackedPair> pairs;
  long build = 0;    ///< counts the packings: indices of pairs hold as long as it does
  int nlocal = 0;    ///< particles that the list was built for: own,
  int nall = 0;      ///< and with ghosts

  void clear()
  {
    build++;
    rows.clear();
    pairs.clear();
  }
  double memory_usage() const
  {
    return (double) (rows.capacity() * sizeof(PackedRow) + pairs.capacity() * sizeof(PackedPair));
  }
};

/// Particle data of one process, as [n][3] arrays. v is read with damping only, f is added to.
struct ParticleView {
  const double (*x)[3];
  const double (*v)[3];
  double (*f)[3];
  int nreact;    ///< particles below this index take the reaction: all with newton on, else own
};

/// A tally that is never called and costs nothing.
struct NoTally {
  static constexpr bool active = false;
};

/// Powers that are the same for all pair types and both regimes.
template <class P> struct UniformPowers {
  P p;
  double reduced_force(const Law &law, double r) const { return law.reduced_force(r, p, p); }
};

/// Pair types or regimes with exponents of their own.
struct OwnPowers {
  double reduced_force(const Law &law, double r) const { return law.force(r, 1.0); }
};

/// Relative position of a pair, from j to i.
struct PairGeometry {
  double dx, dy, dz, dsq;
  PairGeometry(const double (*x)[3], int i, int j) :
      dx(x[i][0] - x[j][0]), dy(x[i][1] - x[j][1]), dz(x[i][2] - x[j][2]),
      dsq(dx * dx + dy * dy + dz * dz)
  {
  }
};

/// Damping force over distance [force/length]: F_D = -gamma (u.(v_i - v_j)) u (eq. 4).
inline double damping_over_distance(double gamma, const PairGeometry &g, const double *vi,
                                    const double *vj)
{
  const double approach = g.dx * (vi[0] - vj[0]) + g.dy * (vi[1] - vj[1]) + g.dz * (vi[2] - vj[2]);
  return -gamma * approach / g.dsq;
}

/// Adds the forces of all interacting pairs (d <= cut) to view.f.
///
/// tally(i, pair, geometry, force/d) is called per interacting pair where Tally::active.
template <bool Damping, class Powers, class Tally>
void accumulate_forces(const PackedList &list, const Law *laws, const ParticleView &view,
                       const Powers &powers, Tally &&tally)
{
  for (const PackedRow &row : list.rows) {
    const int i = row.i;
    double fx = 0.0, fy = 0.0, fz = 0.0;
    for (int k = row.first; k < row.last; k++) {
      const PackedPair &pair = list.pairs[k];
      const int j = pair.j;
      const PairGeometry g(view.x, i, j);
      if (g.dsq > pair.cutsq) continue;

      const double d = std::sqrt(g.dsq);
      const Law &law = laws[pair.law];
      double fpair = powers.reduced_force(law, d * pair.inv_deq) * pair.inv_deq / d;
      if constexpr (Damping)
        fpair += damping_over_distance(law.parameters().gamma, g, view.v[i], view.v[j]);

      fx += g.dx * fpair;
      fy += g.dy * fpair;
      fz += g.dz * fpair;
      if (j < view.nreact) {
        view.f[j][0] -= g.dx * fpair;
        view.f[j][1] -= g.dy * fpair;
        view.f[j][2] -= g.dz * fpair;
      }
      if constexpr (std::decay_t<Tally>::active) tally(i, pair, g, fpair);
    }
    view.f[i][0] += fx;
    view.f[i][1] += fy;
    view.f[i][2] += fz;
  }
}

/// Calls f with the powers that suit all laws: one place decides, the loop is written once.
template <class F> void with_common_powers(const std::vector<Law> &laws, F &&f)
{
  bool common = !laws.empty();
  for (const Law &law : laws) {
    const Row &a = laws.front().parameters(), &b = law.parameters();
    common = common && b.m1 == a.m1 && b.n1 == a.n1 && b.m2 == a.m1 && b.n2 == a.n1;
  }
  if (!common) return f(OwnPowers{});
  const Row &row = laws.front().parameters();
  with_powers(row.m1, row.n1, [&](auto p) {
    f(UniformPowers<decltype(p)>{p});
  });
}

}    // namespace EVP

#endif
