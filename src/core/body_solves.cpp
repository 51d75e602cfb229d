// SPDX-License-Identifier: GPL-2.0-only
//
// Conjugate gradients for each body by itself: coefficients and tolerances. The loops are in cg.cpp.

#include "core/body_solves.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace EVP {

namespace {

  constexpr double ROUND_OFF = 4.0 * std::numeric_limits<double>::epsilon();

  // Smaller sums of squares lose digits by underflow: such a body is at rest.
  constexpr double AT_REST = 1e-280;

  /// 0 or 1, or NaN, which a sum keeps.
  double unmet(double norm, double target)
  {
    if (!std::isfinite(norm + target)) return std::numeric_limits<double>::quiet_NaN();
    return norm > target ? 1.0 : 0.0;
  }

}    // namespace

double BodySolves::target(double changed, double whole) const
{
  return std::max({tolerance_squared * changed, ROUND_OFF * ROUND_OFF * whole, AT_REST});
}

void BodySolves::start(const Bodies &bodies_in, const CgArrays &arrays_in, const double *undamped,
                       double h_in, double tolerance)
{
  bodies = &bodies_in;
  arrays = arrays_in;
  h = h_in;
  tolerance_squared = tolerance * tolerance;

  restart();
  parts.assign(bodies->count(), Part{0.0, 0.0, 0.0, 0.0});
  for_each_active_run([](Part &part, const System &, const CgArrays &a, std::size_t n) {
    part.changed += cg_changed(a, n);
  });
  elsewhere = 0.0;
  for (int i = 0; i < bodies->atoms(); i++) {
    const int body = bodies->body_of(i);
    const double *v = undamped + (std::size_t) 3 * i;
    (body < 0 ? elsewhere : parts[body].whole) +=
        arrays.inertia[(std::size_t) 3 * i] * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
}

void BodySolves::restart()
{
  const int nslots = bodies->slot_count();
  systems.assign(nslots + bodies->count(), System{0.0, 0.0, 0.0, 0.0, true, false});
  for (int body = 0; body < bodies->count(); body++)
    if (bodies->slot_of(body) >= 0) systems[nslots + body].active = false;
}

void BodySolves::gather()
{
  for (Part &part : parts) part.norm = part.curvature = 0.0;
  for_each_active_run([this](Part &part, const System &, const CgArrays &a, std::size_t n) {
    const CgProducts products = cg_products(a, n, h, level);
    part.norm += products.norm;
    part.curvature += products.curvature;
  });

  all_sums.assign(1 + SUMS * systems.size(), 0.0);
  all_sums[0] = unmet(0.0, elsewhere);
  for (int body = 0; body < bodies->count(); body++) {
    const int system = system_of(body);
    if (!systems[system].active) continue;
    const Part &part = parts[body];
    double *sum = &all_sums[1 + (std::size_t) SUMS * system];
    sum[0] += part.norm;
    sum[1] += part.curvature;
    if (is_shared(system)) {
      sum[2] += unmet(part.norm, target(part.changed, part.whole));
    } else {
      sum[2] += part.changed;
      sum[3] += part.whole;
    }
    if (system >= bodies->slot_count())
      all_sums[0] += unmet(part.norm, target(part.changed, part.whole));
  }
}

BodySolves::State BodySolves::judge()
{
  bool finite = !std::isnan(all_sums[0]), running = all_sums[0] != 0.0;
  for (std::size_t k = 0; k < systems.size(); k++) {
    System &system = systems[k];
    if (!system.active) continue;
    const double *sum = &all_sums[1 + SUMS * k];
    const double norm = sum[0], curvature = sum[1];
    const double left = is_shared((int) k) ? sum[2] : unmet(norm, target(sum[2], sum[3]));
    if (std::isnan(left)) finite = false;
    if (left == 0.0) {
      system.active = false;
      continue;
    }
    running = true;
    system.beta = system.started ? norm / system.last_norm : 0.0;
    system.alpha =
        norm / (curvature - (system.started ? system.beta * norm / system.last_alpha : 0.0));
    system.started = true;
    system.last_norm = norm;
    system.last_alpha = system.alpha;
  }
  if (!finite) return State::NOT_FINITE;
  return running ? State::RUNNING : State::CONVERGED;
}

void BodySolves::update()
{
  for (Part &part : parts) part.changed = 0.0;
  for_each_active_run([this](Part &part, const System &system, const CgArrays &a, std::size_t n) {
    part.changed += cg_update(a, n, system.alpha, system.beta, level);
  });
}

double BodySolves::worst() const
{
  double ratio = 0.0;
  for (int body = 0; body < bodies->count(); body++) {
    const int system = system_of(body);
    if (!systems[system].active) continue;
    const Part &part = parts[body];
    const double *sum = &all_sums[1 + (std::size_t) SUMS * system];
    ratio = std::max(ratio,
                     is_shared(system) ? part.norm / target(part.changed, part.whole)
                                       : sum[0] / target(sum[2], sum[3]));
  }
  return std::sqrt(ratio);
}

}    // namespace EVP
