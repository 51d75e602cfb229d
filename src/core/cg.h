// SPDX-License-Identifier: GPL-2.0-only
//
// The vector loops of one iteration of conjugate gradients, for the instruction set of the machine
// that runs. Pure C++17. The numbers are the same on every instruction set.

#ifndef EVP_CORE_CG_H
#define EVP_CORE_CG_H

#include "core/levels.h"

#include <cstddef>

namespace EVP {

/// The arrays, of n values each and apart from each other, of a solve of (M + h C) v = b by conjugate gradients, preconditioned by M.
struct CgArrays {
  const double *mobility, *inertia;    ///< M^-1 and M, both zero where v is prescribed
  double *change;                      ///< v minus a first guess of it
  double *residual;
  double *direction, *direction_product;    ///< and its product with M + h C
  double *z;                                ///< M^-1 residual
  double *product;                          ///< in: C z; out of products(): (M + h C) z

  /// The same from value k on.
  EVP_INLINE CgArrays from(std::size_t k) const
  {
    return {mobility + k,  inertia + k,           change + k, residual + k,
            direction + k, direction_product + k, z + k,      product + k};
  }
};

/// Sums over the values of this MPI rank.
struct CgProducts {
  double norm, curvature;    ///< r.z and z.(M + h C) z
};

// The loops, which every MPI rank runs over its own n values.

/// Completes the product and returns the sums that the iteration asks for.
CgProducts cg_products(const CgArrays &, std::size_t n, double h, Level);

/// The next iterate, its residual and z. Returns change.M change of the iterate.
double cg_update(const CgArrays &, std::size_t n, double alpha, double beta, Level);

/// change.M change
double cg_changed(const CgArrays &, std::size_t n);

}    // namespace EVP

#endif
