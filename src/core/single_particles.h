// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/diagonalize.h"

#include <cmath>
#include <cstddef>
#include <vector>

namespace EVP {

/// Upper limits of the stable timestep in one loop over the pairs, from motions of one particle at a time.
///
/// A step dt is stable only if dt^2 y^T K y + 2 dt y^T C y <= 4 y^T M y for each motion y: see
/// doc/compute_evp_dt.rst, where C counts as negative if it is solved implicitly. Motions of a single particle
/// need its own 3 x 3 blocks only. What the neighbors do in the worst motion is missing, so that the true limit
/// is lower: by a factor of sqrt(2) for two equal particles.
class SingleParticles {
 public:
  /// Entries of the block of one particle: xx, yy, zz, xy, xz, yz.
  static constexpr int WIDTH = 6;
  using Blocks = std::vector<double>;    ///< WIDTH values per particle

  Blocks stiffness;    ///< of own particles and ghosts [force/length]
  Blocks damping;      ///< [force/velocity], empty without damping

  /// count: particles and ghosts.
  SingleParticles(std::size_t count, bool damped) :
      stiffness(WIDTH * count, 0.0), damping(damped ? WIDTH * count : 0, 0.0)
  {
  }

  /// What a pair along u, of length 1, does to particle i when i moves alone:
  /// -(axial u u^T + across (1 - u u^T)) x - viscous u u^T v.
  void add(int i, const double u[3], double axial, double across, double viscous)
  {
    const double uu[WIDTH] = {u[0] * u[0], u[1] * u[1], u[2] * u[2],
                              u[0] * u[1], u[0] * u[2], u[1] * u[2]};
    double *const k = &stiffness[(std::size_t) WIDTH * i];
    for (int c = 0; c < WIDTH; c++) k[c] += (axial - across) * uu[c] + (c < 3 ? across : 0.0);
    if (damping.empty()) return;
    double *const b = &damping[(std::size_t) WIDTH * i];
    for (int c = 0; c < WIDTH; c++) b[c] += viscous * uu[c];
  }

  /// dt, or where a motion of a particle is unstable with dt the lowest timestep above which one is. Blocks must
  /// hold the sums of all MPI ranks; they are scaled by the particles' inverse masses, 0 for those that
  /// do not move freely.
  double lowest_limit(const std::vector<double> &inverse_mass, double dt) const
  {
    for (std::size_t i = 0; i < inverse_mass.size(); i++)
      if (inverse_mass[i] > 0.0) dt = limit_of(i, inverse_mass[i], dt);
    return dt;
  }

 private:
  static constexpr double LIMIT = 4.0;
  static constexpr int MOST_DIRECTIONS = 50;

  static double along(const double *block, const double e[3])
  {
    return block[0] * e[0] * e[0] + block[1] * e[1] * e[1] + block[2] * e[2] * e[2] +
        2.0 * (block[3] * e[0] * e[1] + block[4] * e[0] * e[2] + block[5] * e[1] * e[2]);
  }

  // dt falls to the limit of the worst direction at dt, until none is unstable
  double limit_of(std::size_t i, double w, double dt) const
  {
    const double *const k = &stiffness[WIDTH * i];
    const double *const b = damping.empty() ? nullptr : &damping[WIDTH * i];
    for (int turn = 0; turn < MOST_DIRECTIONS; turn++) {
      double sum[WIDTH], norm_sq = 0.0;
      for (int c = 0; c < WIDTH; c++) {
        sum[c] = w * dt * (dt * k[c] + (b ? 2.0 * b[c] : 0.0));
        norm_sq += (c < 3 ? 1.0 : 2.0) * sum[c] * sum[c];
      }
      if (!(norm_sq > LIMIT * LIMIT)) break;    // no eigenvalue is above the norm

      SquareMatrix<3> m = {
          {{{sum[0], sum[3], sum[4]}}, {{sum[3], sum[1], sum[5]}}, {{sum[4], sum[5], sum[2]}}}};
      const SquareMatrix<3> axes = diagonalize(m);
      const int worst = m[0][0] >= m[1][1] ? (m[0][0] >= m[2][2] ? 0 : 2)
                                           : (m[1][1] >= m[2][2] ? 1 : 2);
      if (!(m[worst][worst] > LIMIT)) break;
      const double e[] = {axes[0][worst], axes[1][worst], axes[2][worst]};
      const double stiff = w * along(k, e), viscous = b ? w * along(b, e) : 0.0;
      const double limit = LIMIT / (viscous + std::sqrt(viscous * viscous + LIMIT * stiff));
      if (!(limit < dt)) break;
      dt = limit;
    }
    return dt;
  }
};

}    // namespace EVP
