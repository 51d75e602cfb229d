// SPDX-License-Identifier: GPL-2.0-only
//
// A bonded FCC lattice, its forces from a plain sum in long double, and how far others are from them.

#ifndef EVP_TEST_PRECISION_LATTICE_H
#define EVP_TEST_PRECISION_LATTICE_H

#include "precision.h"

#include <cmath>
#include <random>

namespace precision {

/// Table 1 of the paper.
inline EVP::Row table1()
{
  return {80, 8, 4, 3, 8, 4, 0.005, 0, 1.5};
}

/// A free cube of spheres of diameter 1 with every pair within 1.5 diameters bonded at its distance.
struct Lattice {
  Vectors rest;
  EVP::PairList list;
  std::vector<double> deq;    ///< of each pair of the list
  EVP::Law law = EVP::Law(table1());

  /// The body stretched alike in all directions, away from the origin: every pair has the strain xi.
  Vectors stretched(double xi) const
  {
    Vectors x = rest;
    for (auto &point : x)
      for (double &component : point) component *= 1.0 + xi;
    return x;
  }

  /// Largest coordinate [diameters].
  double reach() const
  {
    double largest = 0.0;
    for (const auto &point : rest)
      for (const double component : point) largest = std::max(largest, std::fabs(component));
    return largest;
  }
};

inline void append(EVP::PackedPairs &pairs, const EVP::PackedPair &pair)
{
  pairs.make_room(1);
  pairs.push_back(pair);
}

/// 4 cells^3 spheres, stirred by up to 0.01 in each direction, so that no coordinate is a round one.
/// The corner nearest to the origin lies at (corner, corner, corner).
inline Lattice make_lattice(int cells, double corner = 0.0)
{
  constexpr double STIR = 0.01;
  const int side = 2 * cells;    // in steps of half a cell; there is a site where their sum is even
  const double step = std::sqrt(0.5), cut = table1().alpha;
  const auto place = [side](int a, int b, int c) {
    return ((size_t) a * side + b) * side + c;
  };
  Lattice lattice;
  std::vector<int> number((size_t) side * side * side, -1);
  std::vector<std::array<int, 3>> site;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> stir(-STIR, STIR);
  for (int a = 0; a < side; a++)
    for (int b = 0; b < side; b++)
      for (int c = (a + b) % 2; c < side; c += 2) {
        number[place(a, b, c)] = (int) site.size();
        site.push_back({a, b, c});
        const double x = stir(random), y = stir(random), z = stir(random);
        lattice.rest.push_back(
            {corner + a * step + x, corner + b * step + y, corner + c * step + z});
      }

  // twelve neighbors at 1 and six at 1.414: half of them, those that come later
  const int later[9][3] = {{0, 0, 2},  {0, 1, -1}, {0, 1, 1}, {0, 2, 0}, {1, -1, 0},
                           {1, 0, -1}, {1, 0, 1},  {1, 1, 0}, {2, 0, 0}};
  for (int i = 0; i < (int) site.size(); i++) {
    const int first = (int) lattice.list.pairs.size();
    for (const auto &offset : later) {
      int to[3];
      bool inside = true;
      for (int c = 0; c < 3; c++) {
        to[c] = site[i][c] + offset[c];
        inside = inside && to[c] >= 0 && to[c] < side;
      }
      if (!inside) continue;
      const int j = number[place(to[0], to[1], to[2])];
      double dsq = 0.0;
      for (int c = 0; c < 3; c++) dsq += std::pow(lattice.rest[i][c] - lattice.rest[j][c], 2);
      lattice.deq.push_back(std::sqrt(dsq));
      append(lattice.list.pairs, {1.0 / lattice.deq.back(), cut * cut, cut, j, 0, true});
    }
    const int last = (int) lattice.list.pairs.size();
    if (last > first) lattice.list.rows.push_back({i, first, last});
  }
  lattice.list.nlocal = lattice.list.nall = (int) site.size();
  return lattice;
}

/// The same pairs, each between two spheres of its own: the force on a sphere is that of a pair.
inline Lattice pairs_apart(const Lattice &lattice)
{
  Lattice apart;
  apart.deq = lattice.deq;
  for (const EVP::PackedRow &row : lattice.list.rows)
    for (int k = row.first; k < row.last; k++) {
      EVP::PackedPair pair = lattice.list.pairs[k];
      const int i = (int) apart.rest.size();
      apart.rest.push_back(lattice.rest[row.i]);
      apart.rest.push_back(lattice.rest[pair.j]);
      pair.j = i + 1;
      append(apart.list.pairs, pair);
      apart.list.rows.push_back({i, k, k + 1});
    }
  return apart;
}

/// Forces by a plain sum in long double, from eqs. 1 and 8 as the paper prints them.
struct Truth {
  Vectors f;
  double largest = 0.0;    ///< pair force
};

inline Truth plain_sum(const Lattice &lattice, const Vectors &x)
{
  using Fine = long double;
  const EVP::Row row = lattice.law.parameters();
  const auto power = [](Fine s, double exponent) {
    return std::pow(s, (Fine) exponent);
  };
  const auto force_deq = [&](Fine e, Fine r) {    // eq. 1 times deq; both regimes have 8 and 4
    const Fine m = row.m1, n = row.n1;
    return m * n * e / (m - n) * (power(1 / r, row.m1 + 1) - power(1 / r, row.n1 + 1));
  };
  const Fine xi_s = row.xi_s;
  const Fine stretched = force_deq(row.e1, 1 + xi_s), compressed = force_deq(row.e1, 1 - xi_s);
  std::vector<std::array<Fine, 3>> sum(x.size(), {0, 0, 0});
  Truth truth;
  for (const EVP::PackedRow &own : lattice.list.rows)
    for (int k = own.first; k < own.last; k++) {
      const int i = own.i, j = lattice.list.pairs[k].j;
      Fine u[3], dsq = 0;
      for (int c = 0; c < 3; c++) {
        u[c] = (Fine) x[i][c] - (Fine) x[j][c];
        dsq += u[c] * u[c];
      }
      if (dsq > lattice.list.pairs[k].cutsq) continue;
      const Fine d = std::sqrt(dsq), deq = lattice.deq[k], xi = d / deq - 1;
      Fine force = 0;
      if (std::fabs(xi) <= xi_s)
        force = force_deq(row.e1, d / deq) / deq;
      else if (xi > 0)
        force = (force_deq(row.e2, d / deq - xi_s) + stretched) / deq;
      else
        force = (force_deq(row.e2, d / deq + xi_s) + compressed) / deq;
      truth.largest = std::max(truth.largest, (double) std::fabs(force));
      for (int c = 0; c < 3; c++) {
        sum[i][c] += force * u[c] / d;
        sum[j][c] -= force * u[c] / d;
      }
    }
  for (const auto &f : sum) truth.f.push_back({(double) f[0], (double) f[1], (double) f[2]});
  return truth;
}

/// Errors of the force on a particle, in units of the largest pair force.
struct Error {
  double largest = 0.0, rms = 0.0;
};

inline Error error_of(const Vectors &f, const Truth &truth)
{
  Error error;
  for (size_t i = 0; i < f.size(); i++) {
    double square = 0.0;
    for (int c = 0; c < 3; c++) square += std::pow((f[i][c] - truth.f[i][c]) / truth.largest, 2);
    error.largest = std::max(error.largest, std::sqrt(square));
    error.rms += square;
  }
  error.rms = std::sqrt(error.rms / (double) f.size());
  return error;
}

/// The forces by the project's own loop are added to f.
template <class Tally = EVP::NoTally>
void accumulate_own(const Lattice &lattice, const EVP::BlockLaw &law, const Vectors &x, Vectors &f,
                    Tally &&tally = Tally())
{
  const auto *const at = reinterpret_cast<const double(*)[3]>(x.data());
  auto *const sum = reinterpret_cast<double(*)[3]>(f.data());
  EVP::accumulate_forces<false>(lattice.list, law, {at, at, sum, (int) x.size()}, tally);
}

inline Vectors forces_of_kernel(const Lattice &lattice, const Vectors &x,
                                EVP::Level level = EVP::best_level())
{
  EVP::BlockLaw law;
  law.assign({lattice.law}, {0}, level);
  Vectors f(x.size(), {0, 0, 0});
  accumulate_own(lattice, law, x, f);
  return f;
}

/// The forces by the loop in the types T.
template <class T>
Vectors forces_in(const Lattice &lattice, const Vectors &x, EVP::Level level = EVP::best_level())
{
  Loop<T> loop(lattice.list, lattice.law, x.size());
  loop.use(level);
  loop.take_positions(x);
  loop.accumulate();
  Vectors f(x.size(), {0, 0, 0});
  loop.add_forces_to(f);
  return f;
}

}    // namespace precision

#endif
