// SPDX-License-Identifier: GPL-2.0-only
//
// A free body that rings: what energy and momentum it gains from the rounding of its forces alone.

#ifndef EVP_TEST_PRECISION_RINGING_H
#define EVP_TEST_PRECISION_RINGING_H

#include "core/tallies.h"
#include "lattice.h"

namespace precision {

/// Step of velocity Verlet in units of sqrt(mass/stiffness at rest), far below the stable limit.
constexpr double RINGING_STEP = 0.05;

/// What should be zero.
struct Ringing {
  double energy = 0.0;      ///< largest change of the total energy, of the energy at the start
  double momentum = 0.0;    ///< at the end, of the sum of all |m v|
};

/// Potential energy, in double, above that at rest.
inline double energy_above_rest(const Lattice &lattice, const EVP::BlockLaw &law, const Vectors &x)
{
  const auto potential = [&](const Vectors &at) {
    Vectors f(at.size(), {0, 0, 0});
    EVP::SumTally tally(lattice.list, (int) at.size(), true, false);
    accumulate_own(lattice, law, at, f, tally);
    return tally.total_energy();
  };
  return potential(x) - potential(lattice.rest);
}

/// Stretched by xi and let go; positions and velocities in double as LAMMPS has them, forces in T.
template <class T> Ringing ring(const Lattice &lattice, double xi, int steps)
{
  constexpr int LOOKS = 200;
  const size_t n = lattice.rest.size();
  const double dt = RINGING_STEP / std::sqrt(lattice.law.stiffness_at_rest(1.0));    // mass 1
  EVP::BlockLaw law;
  law.assign({lattice.law}, {0});
  Loop<T> loop(lattice.list, lattice.law, n);
  Vectors x = lattice.stretched(xi), v(n, {0, 0, 0}), f;
  const auto force = [&] {
    loop.take_positions(x);
    loop.clear_forces();
    loop.accumulate();
    f.assign(n, {0, 0, 0});
    loop.add_forces_to(f);
  };
  const double start = energy_above_rest(lattice, law, x);
  Ringing found;
  force();
  for (int step = 1; step <= steps; step++) {
    for (size_t i = 0; i < n; i++)
      for (int c = 0; c < 3; c++) {
        v[i][c] += 0.5 * dt * f[i][c];
        x[i][c] += dt * v[i][c];
      }
    force();
    for (size_t i = 0; i < n; i++)
      for (int c = 0; c < 3; c++) v[i][c] += 0.5 * dt * f[i][c];
    if (step % LOOKS && step != steps) continue;
    double energy = energy_above_rest(lattice, law, x);
    for (const auto &own : v)
      for (const double component : own) energy += 0.5 * component * component;
    found.energy = std::max(found.energy, std::fabs(energy / start - 1.0));
  }
  double sum[3] = {0, 0, 0}, scale = 0.0;
  for (const auto &own : v)
    for (int c = 0; c < 3; c++) {
      sum[c] += own[c];
      scale += std::fabs(own[c]);
    }
  found.momentum = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / scale;
  return found;
}

}    // namespace precision

#endif
