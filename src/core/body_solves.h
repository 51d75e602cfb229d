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

/// (M + h C) v = b, preconditioned by M, in the form that needs one sum over MPI ranks per iteration
/// (Chronopoulos and Gear). Per iteration: arrays.product = C z; gather(); sum the first
/// shared_sums() of sums() over ranks; judge(); update().
///
/// A body that meets its tolerance does not change any more. Bodies with the same slot have the same
/// coefficients, not the same tolerance: they iterate until the part of each on each rank meets it.
class BodySolves {
 public:
  enum class State { RUNNING, CONVERGED, NOT_FINITE };

  /// Starts from arrays.change and its residual. Tolerance: |r| over |M change| in the norm of M^-1,
  /// or at round-off of M undamped.
  void start(const Bodies &bodies, const CgArrays &arrays, const double *undamped, double h,
             double tolerance);

  /// From the same arrays with another residual, and z = M^-1 residual; change is as it was left.
  void restart();

  /// Adds to v*.M v*, which the round-off of a body is measured by [mass velocity^2].
  void add_to_floor(int body, double whole) { parts[body].whole += whole; }

  void gather();
  double *sums() { return all_sums.data(); }
  int shared_sums() const { return 1 + SUMS * bodies->slot_count(); }
  State judge();
  void update();

  /// Of judge(): largest residual over its tolerance, of the bodies with atoms here.
  double worst() const;

  double memory_usage() const { return bytes_of(all_sums, parts, systems); }

 private:
  static constexpr int SUMS = 4;

  /// Sums over the atoms of a body on this rank: r.z, z.(M + h C) z, change.M change, v*.M v*
  struct Part {
    double norm, curvature, changed, whole;
  };

  /// The coefficients of a slot or, after all slots, of a body without one.
  struct System {
    double alpha, beta, last_norm, last_alpha;
    bool active, started;
  };

  const Bodies *bodies = nullptr;
  CgArrays arrays;
  Level level = best_level();
  double h, tolerance_squared;
  double elsewhere;    // v*.M v* of the atoms in no body, which must be finite too
  std::vector<Part> parts;
  std::vector<System> systems;
  std::vector<double> all_sums;    // number of unfinished bodies without a slot; SUMS per system

  int system_of(int body) const
  {
    const int slot = bodies->slot_of(body);
    return slot < 0 ? bodies->slot_count() + body : slot;
  }
  bool is_shared(int system) const
  {
    return bodies->slots_are_shared() && system < bodies->slot_count();
  }
  double target(double changed, double whole) const;

  /// Calls f(part, system, arrays, number of values) for each run of atoms of an unfinished body.
  template <class F> void for_each_active_run(F &&f)
  {
    for (const auto &run : bodies->runs()) {
      const System &system = systems[system_of(run.body)];
      if (system.active)
        f(parts[run.body], system, arrays.from((std::size_t) 3 * run.first),
          (std::size_t) 3 * (run.last - run.first));
    }
  }
};

}    // namespace EVP
