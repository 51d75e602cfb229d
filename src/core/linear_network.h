// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_CORE_LINEAR_NETWORK_H
#define EVP_CORE_LINEAR_NETWORK_H

#include "core/lanczos.h"

#include <functional>
#include <vector>

namespace EVP {

/// What one rank needs of the others, collective. Vectors hold three values per particle and ghost.
struct RankExchange {
  std::function<void(std::vector<double> &)> to_ghosts;    ///< ghosts take their owners' values
  std::function<void(std::vector<double> &)> to_owners;    ///< owners add what their ghosts hold
  std::function<double(double)> sum;
};

/// The matrices K and C of the pairs that interact, linearised at the present positions.
class LinearNetwork {
 public:
  /// A pair with at least one free particle. Forces on i are
  /// -(axial u u^T + across (1 - u u^T)) (x_i - x_j) and -damping u u^T (v_i - v_j).
  struct Link {
    int i, j;
    double u[3];
    double axial, across;    ///< [force/length]
    double damping;          ///< [force/velocity]
  };

  /// Weights of axial stiffness, transverse stiffness and damping in a matrix.
  struct Mix {
    double axial, across, damping;
  };

  std::vector<Link> links;
  std::vector<double> inverse_mass;    ///< of own particles and ghosts, 0 where held
  std::vector<double> start;           ///< of Lanczos, three values per own particle, 0 where held
  int nreact = 0;                      ///< particles below this index take the reaction

  explicit LinearNetwork(RankExchange exchange_in) : exchange(std::move(exchange_in)) {}

  bool is_free(int i) const { return inverse_mass[i] > 0.0; }

  /// Collective. Of M^-1/2 (mixed matrix) M^-1/2 over the free particles; errors: see lanczos.h.
  LanczosResult largest_eigenvalue(const Mix &, double tolerance, int max_iterations);

  /// Collective. Gershgorin: sum of absolute values of each row of M^-1 (mixed matrix) over the free
  /// particles, three values per own particle, 0 where held. No eigenvalue is above the largest.
  std::vector<double> row_sums(const Mix &) const;

  double memory_usage() const;

 private:
  RankExchange exchange;
  std::vector<double> motion, reaction;    // with ghosts

  void apply(const Mix &, const std::vector<double> &in, std::vector<double> &out);
};

}    // namespace EVP

#endif
