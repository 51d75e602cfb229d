// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/pairs/pairs.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace EVP {

/// Largest eigenvalue of the symmetric tridiagonal matrix with the given diagonal and off-diagonal,
/// by bisection on the number of negative pivots (Sturm). off[k] couples k and k + 1.
inline double largest_tridiagonal_eigenvalue(const std::vector<double> &diagonal,
                                             const std::vector<double> &off)
{
  const size_t n = diagonal.size();
  double low = diagonal[0], high = diagonal[0];
  for (size_t k = 0; k < n; k++) {
    const double radius =
        (k > 0 ? std::fabs(off[k - 1]) : 0.0) + (k + 1 < n ? std::fabs(off[k]) : 0.0);
    low = std::max(low, diagonal[k]);    // a Rayleigh quotient, hence no larger than the answer
    high = std::max(high, diagonal[k] + radius);
  }
  const auto all_below = [&](double bound) {
    double pivot = 1.0;
    for (size_t k = 0; k < n; k++) {
      pivot = diagonal[k] - bound - (k > 0 ? off[k - 1] * off[k - 1] / pivot : 0.0);
      if (pivot >= 0.0) return false;
    }
    return true;
  };
  while (high - low > 1e-12 * std::max(std::fabs(high), std::fabs(low))) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (all_below(middle) ? high : low) = middle;
  }
  return high;
}

struct LanczosResult {
  double eigenvalue;    ///< largest Ritz value, approached from below
  bool converged;
};

/// Largest eigenvalue of the symmetric positive semi-definite operator `apply(in, out)`.
///
/// start is the first vector (any length, may be empty on this rank; overwritten), dot(a, b) the
/// inner product over all ranks. Stops when eight iterations in a row together raised the value by less than a tenth of
/// tolerance of itself (a mode of which the start has little shows late), when the Krylov space is exhausted, or after
/// max_iterations.
template <class Apply, class Dot>
LanczosResult largest_eigenvalue(std::vector<double> &start, Apply &&apply, Dot &&dot,
                                 double tolerance, int max_iterations)
{
  const size_t n = start.size();
  std::vector<double> &q = start;
  std::vector<double> previous(n, 0.0), w(n, 0.0), diagonal, off;
  const double norm = std::sqrt(dot(q, q));
  if (!(norm > 0.0)) return {0.0, true};
  for (double &value : q) value /= norm;

  double beta = 0.0;
  std::vector<double> history;
  for (int it = 1; it <= max_iterations; it++) {
    apply(q, w);
    const double alpha = dot(q, w);
    for (size_t k = 0; k < n; k++) w[k] -= alpha * q[k] + beta * previous[k];
    diagonal.push_back(alpha);
    history.push_back(largest_tridiagonal_eigenvalue(diagonal, off));
    const double value = history.back();

    if (it > 8 && value - history[it - 9] <= 0.1 * tolerance * value) return {value, true};
    beta = std::sqrt(dot(w, w));
    if (beta <= 1e-14 * std::fabs(value) || value == 0.0) return {value, true};
    off.push_back(beta);
    for (size_t k = 0; k < n; k++) {
      previous[k] = q[k];
      q[k] = w[k] / beta;
    }
  }
  return {history.empty() ? 0.0 : history.back(), false};
}

/// No less than d2U/drho2 of a particle is [energy]: by the density of its bonds alone, and by that of all its pairs.
struct DensityStiffness {
  double bonded, total;
};

/// The matrices K and C of the pairs that interact, linearised at the present positions.
class StiffnessMatrix {
 public:
  /// Weights of axial stiffness, transverse stiffness, damping, stiffness of densities and that of undamped links in a matrix.
  struct Mix {
    double axial, across, damping, density = 0.0, undamped = 0.0;
  };

  /// A pair with at least one free particle. Forces on i are
  /// -(axial u u^T + across (1 - u u^T)) (x_i - x_j) and -damping u u^T (v_i - v_j).
  struct Link {
    int i, j;
    Vector u;
    double axial, across;    ///< [force/length]
    double damping;          ///< [force/velocity]
  };

  /// The part of a link in energies of densities.
  struct DensityLink {
    double slope = 0.0;            ///< of minus the density of i and j by the length [1/length]
    double above_density = 0.0;    ///< all together no softer than these energies [force/length]
    bool is_bond = true;           ///< does that density count as bonded?
  };

  /// An energy of densities, as the volume energy: sum_i K_i b_i b_i^T, with b_i the derivative of the density of i, by all
  /// links or by bonds alone.
  struct Densities {
    std::vector<DensityLink> links;    ///< of the links of the matrix, but for the last ones
    std::vector<DensityStiffness> stiffness;    ///< of own particles
  };

  std::vector<Link> links;
  std::vector<Densities> densities;    ///< as many on all ranks

  /// Where the link of a pair is. One that there is not is added, without a force of its own.
  class Places {
   public:
    explicit Places(StiffnessMatrix &matrix_in) : matrix(matrix_in)
    {
      for (size_t k = 0; k < matrix.links.size(); k++)
        known.push_back({{matrix.links[k].i, matrix.links[k].j}, k});
      std::sort(known.begin(), known.end());
    }
    size_t find_or_add(int i, int j, const Vector &direction)
    {
      const std::pair<int, int> pair = {i, j};
      const auto found = std::lower_bound(known.begin(), known.end(), std::pair(pair, (size_t) 0));
      if (found != known.end() && found->first == pair) return found->second;
      matrix.links.push_back({i, j, direction, 0.0, 0.0, 0.0});
      return matrix.links.size() - 1;
    }

   private:
    StiffnessMatrix &matrix;
    std::vector<std::pair<std::pair<int, int>, size_t>> known;
  };

  std::vector<double> inverse_mass;    ///< of own particles and ghosts, 0 where held
  AtomValues start{3};                 ///< of Lanczos, of own particles, 0 where held
  int nreact = 0;                      ///< particles below this index take the reaction

  /// exchange_in: of up to three values per particle.
  explicit StiffnessMatrix(PerAtomComm &exchange_in) : exchange(exchange_in) {}

  bool is_free(int i) const { return inverse_mass[i] > 0.0; }

  // of links, with the springs above these energies
  double above_density(size_t k) const
  {
    double sum = 0.0;
    for (const Densities &one : densities)
      if (k < one.links.size()) sum += one.links[k].above_density;
    return sum;
  }
  double most_axial(size_t k) const { return links[k].axial + above_density(k); }
  double undamped(size_t k) const { return links[k].damping > 0.0 ? 0.0 : most_axial(k); }

  /// Collective. Of M^-1/2 (mixed matrix) M^-1/2 over the free particles; errors: see
  /// EVP::largest_eigenvalue().
  LanczosResult largest_eigenvalue(const Mix &mix, double tolerance, int max_iterations)
  {
    std::vector<double> vector(start.begin(), start.end());
    return EVP::largest_eigenvalue(
        vector,
        [&](const auto &in, auto &out) {
          apply(mix, in, out);
        },
        [&](const auto &a, const auto &b) {
          return exchange.sum(std::inner_product(a.begin(), a.end(), b.begin(), 0.0));
        },
        tolerance, max_iterations);
  }

  /// Collective. Gershgorin: sum of absolute values of each row of M^-1 (mixed matrix) over the free
  /// particles, of own particles, 0 where held. No eigenvalue is above the largest. Energies of densities enter
  /// by the springs above them.
  AtomValues row_sums(const Mix &mix) const
  {
    // per particle: own block xx yy zz, xy xz yz, and absolute row sums towards free partners
    AtomValues diagonal(3, inverse_mass.size()), off = diagonal, partners = diagonal;
    for (size_t k = 0; k < links.size(); k++) {
      const Link &link = links[k];
      const double across = mix.across * link.across,
                   axial = axial_in(mix, k) + mix.density * above_density(k);
      const auto &[x, y, z] = link.u;
      const double own[] = {axial * x * x + across, axial * y * y + across, axial * z * z + across};
      const double beside[] = {axial * x * y, axial * x * z, axial * y * z};
      const double xy = std::fabs(beside[0]), xz = std::fabs(beside[1]), yz = std::fabs(beside[2]);
      const double rows[] = {std::fabs(own[0]) + xy + xz, std::fabs(own[1]) + xy + yz,
                             std::fabs(own[2]) + xz + yz};
      for_each_end(link.i, link.j, nreact, [&](int i, int j) {
        for (int c = 0; c < 3; c++) {
          diagonal[i][c] += own[c];
          off[i][c] += beside[c];
          if (is_free(j)) partners[i][c] += rows[c];
        }
      });
    }
    for (AtomValues *values : {&diagonal, &off, &partners}) exchange.reverse_comm(*values);

    AtomValues sums(3, start.size());
    for (size_t i = 0; i < sums.size(); i++) {
      const double *b = off[i];
      const double xy = std::fabs(b[0]), xz = std::fabs(b[1]), yz = std::fabs(b[2]);
      const double beside[] = {xy + xz, xy + yz, xz + yz};
      for (int c = 0; c < 3; c++) {
        const double sum = std::fabs(diagonal[i][c]) + beside[c] + partners[i][c];
        sums[i][c] = inverse_mass[i] * sum;
      }
    }
    return sums;
  }

  /// Collective. Finds DensityLink::above_density. By Cauchy and Schwarz (sum_j b e_j)^2 <= (sum_j b) (sum_j b e_j^2).
  void find_springs_above_density()
  {
    for (Densities &one : densities) {
      find_pulls(one, 1.0, [&](size_t k) {
        return one.links[k].slope;
      });
      for (size_t k = 0; k < one.links.size(); k++)
        one.links[k].above_density = one.links[k].slope * pull(one, k);
    }
  }

  double memory_usage() const
  {
    double bytes = bytes_of(links, inverse_mass, start, motion, reaction, change);
    for (const Densities &one : densities) bytes += bytes_of(one.links, one.stiffness);
    return bytes;
  }

 private:
  PerAtomComm &exchange;
  AtomValues motion{3}, reaction{3};    // with ghosts
  AtomValues change{2};                 // likewise, see find_pulls()

  double axial_in(const Mix &mix, size_t k) const
  {
    return mix.axial * links[k].axial + mix.damping * links[k].damping +
        mix.undamped * undamped(k) - mix.across * links[k].across;
  }

  void apply(const Mix &mix, const std::vector<double> &in, std::vector<double> &out)
  {
    const auto scale = [this](const double *from, double *to) {
      for (size_t i = 0; i < start.size(); i++, from += 3, to += 3) {
        const double root = std::sqrt(inverse_mass[i]);
        for (int c = 0; c < 3; c++) to[c] = root * from[c];
      }
    };
    motion.assign(inverse_mass.size(), 0.0);
    scale(in.data(), motion.data());
    exchange.forward_comm(motion);

    reaction.assign(motion.size(), 0.0);
    for (size_t k = 0; k < links.size(); k++) {
      const Link &link = links[k];
      const Vector dv = Vector(motion[link.i]) - Vector(motion[link.j]);
      const double along = axial_in(mix, k) * dot(link.u, dv);
      react(link, link.u * along + dv * (mix.across * link.across));
    }
    for (const Densities &one : densities)
      if (mix.density > 0.0) apply_densities(one, mix.density);
    exchange.reverse_comm(reaction);
    scale(reaction.data(), out.data());
  }

  // change: weight K_i of each particle times the sum of share(link) over its links, then the same of bonds
  template <class Share> void find_pulls(const Densities &of, double weight, Share &&share)
  {
    change.assign(inverse_mass.size(), 0.0);
    for (size_t k = 0; k < of.links.size(); k++) {
      const double value = share(k);
      for_each_end(links[k].i, links[k].j, nreact, [&](int i, int) {
        change[i][0] += value;
        if (of.links[k].is_bond) change[i][1] += value;
      });
    }
    exchange.reverse_comm(change);
    for (size_t i = 0; i < of.stiffness.size(); i++) {
      change[i][0] *= weight * of.stiffness[i].total;
      change[i][1] *= weight * of.stiffness[i].bonded;
    }
    exchange.forward_comm(change);
  }

  // on a link, after find_pulls()
  double pull(const Densities &of, size_t k) const
  {
    const double *const of_i = change[links[k].i], *const of_j = change[links[k].j];
    return of_i[0] + of_j[0] + (of.links[k].is_bond ? of_i[1] + of_j[1] : 0.0);
  }

  // adds sum_i K_i b_i b_i^T motion to reaction
  void apply_densities(const Densities &of, double weight)
  {
    find_pulls(of, weight, [&](size_t k) {
      const Link &link = links[k];
      return of.links[k].slope * dot(link.u, Vector(motion[link.i]) - Vector(motion[link.j]));
    });
    for (size_t k = 0; k < of.links.size(); k++)
      react(links[k], links[k].u * (of.links[k].slope * pull(of, k)));
  }

  void react(const Link &link, const Vector &force)
  {
    force.add_to(reaction[link.i]);
    if (link.j < nreact) force.subtract_from(reaction[link.j]);
  }
};

}    // namespace EVP
