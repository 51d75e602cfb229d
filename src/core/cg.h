// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bodies.h"
#include "core/simd.h"

#include <cstddef>
#include <vector>

namespace EVP {

/// The arrays, of n values each and apart from each other, of a solve of (M + h C) v = b by conjugate
/// gradients, preconditioned by M.
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

/// Over the atoms of a body: r.z, z.(M + h C) z, change.M change and v*.M v*, by which its round-off is
/// measured.
struct CgSums {
  double norm, curvature, changed, undamped;
};

/// Completes the product, adds to norm and curvature.
void cg_products(const CgArrays &, std::size_t n, double h, CgSums &, InstructionSet);

/// The next iterate, its residual and z. Adds to changed.
void cg_update(const CgArrays &, std::size_t n, double alpha, double beta, CgSums &,
               InstructionSet);

/// Adds to changed.
void cg_changed(const CgArrays &, std::size_t n, CgSums &, InstructionSet);

/// (M + h C) v = b, preconditioned by M, in the form that needs one sum over MPI ranks per iteration
/// (Chronopoulos and Gear). Per iteration: arrays.product = C z; gather(); sum the first shared_sums() of
/// sums() over ranks; judge(); update().
///
/// Each body has its own coefficients, and does not change any more once it meets its tolerance. (With
/// common ones a slow body costs five times the iterations beside a fast one, until the residual of this
/// is below its own.)
class ConjugateGradients {
 public:
  enum class State { RUNNING, CONVERGED, NOT_FINITE };

  /// Starts from arrays.change, its residual and z. Tolerance: |r| over |M change| in the norm of M^-1,
  /// or at round-off of M undamped.
  void start(const Bodies &bodies, const CgArrays &arrays, const double *undamped, double h,
             double tolerance);

  /// From the same arrays with another residual and z; change is as it was left.
  void restart() { systems.assign(bodies->count(), System{}); }

  /// noise: of each atom [mass velocity^2], added to v*.M v*.
  void add_round_off(const std::vector<double> &noise)
  {
    for (std::size_t i = 0; i < noise.size(); i++)
      parts[bodies->of_atoms()[i]].undamped += noise[i];
  }

  void gather();
  double *sums() { return &all_sums[0].norm; }
  int shared_sums() const { return 4 * (1 + bodies->shared_count()); }
  State judge();
  void update();

  /// Of judge(): largest residual over its tolerance, of the bodies with atoms here.
  double worst() const;

  double memory_usage() const { return bytes_of(all_sums, parts, systems); }

 private:
  struct System {
    double alpha = 0.0, beta = 0.0, last_norm = 0.0, last_alpha = 0.0;
    bool active = true, started = false;
  };

  const Bodies *bodies = nullptr;
  CgArrays arrays;
  const InstructionSet level = best_instruction_set();
  double h, tolerance_squared;
  std::vector<System> systems;
  std::vector<CgSums> parts;       // on this rank
  std::vector<CgSums> all_sums;    // of bodies; first, norm: number of unfinished ones of one rank

  double target(const CgSums &) const;
  double unmet(const CgSums &) const;

  /// Calls f(system, its sums, arrays, number of values) for each run of atoms of an unfinished body.
  template <class F> void for_each_active_run(F &&f)
  {
    for (const auto &run : bodies->runs())
      if (systems[run.body].active)
        f(systems[run.body], parts[run.body], arrays.from((std::size_t) 3 * run.first),
          (std::size_t) 3 * (run.last - run.first));
  }
};

}    // namespace EVP
