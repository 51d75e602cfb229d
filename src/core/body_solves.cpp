// SPDX-License-Identifier: GPL-2.0-only

#include "core/body_solves.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace EVP {

namespace {

  constexpr double ROUND_OFF = 4.0 * std::numeric_limits<double>::epsilon();

  // Smaller sums of squares lose digits by underflow: such a body is at rest.
  constexpr double AT_REST = 1e-280;

  /// Values that pass through all loops of an iteration while they are in the nearest cache.
  constexpr std::size_t CHUNK = 256;

  /// a.b, or a.(b c): sums side by side, so that no addition waits for the last one.
  template <class F> EVP_INLINE double sum_of(std::size_t n, F &&term)
  {
    constexpr std::size_t WIDTH = 8;
    double part[WIDTH] = {};
    std::size_t k = 0;
    for (; k + WIDTH <= n; k += WIDTH)
      for (std::size_t c = 0; c < WIDTH; c++) part[c] += term(k + c);
    for (; k < n; k++) part[0] += term(k);
    return ((part[0] + part[1]) + (part[2] + part[3])) +
        ((part[4] + part[5]) + (part[6] + part[7]));
  }

  EVP_INLINE double changed(const CgArrays &a, std::size_t n)
  {
    const double *inertia = a.inertia, *change = a.change;
    double sum = 0.0;
    for (std::size_t first = 0; first < n; first += CHUNK)
      sum += sum_of(std::min(CHUNK, n - first), [=](std::size_t k) {
        return inertia[first + k] * change[first + k] * change[first + k];
      });
    return sum;
  }

  EVP_INLINE CgProducts products(const CgArrays &a, std::size_t n, double h)
  {
    CgProducts sums = {0.0, 0.0};
    for (std::size_t first = 0; first < n; first += CHUNK) {
      const std::size_t length = std::min(CHUNK, n - first);
      const double *residual = a.residual + first, *z = a.z + first;
      double *product = a.product + first;
      EVP_INDEPENDENT
      for (std::size_t k = 0; k < length; k++) product[k] = residual[k] + h * product[k];
      sums.norm += sum_of(length, [=](std::size_t k) {
        return residual[k] * z[k];
      });
      sums.curvature += sum_of(length, [=](std::size_t k) {
        return product[k] * z[k];
      });
    }
    return sums;
  }

  EVP_INLINE double update(const CgArrays &a, std::size_t n, double alpha, double beta)
  {
    double sum = 0.0;
    for (std::size_t first = 0; first < n; first += CHUNK) {
      const std::size_t length = std::min(CHUNK, n - first);
      const CgArrays b = a.from(first);
      EVP_INDEPENDENT
      for (std::size_t k = 0; k < length; k++) {
        b.direction[k] = b.z[k] + beta * b.direction[k];
        b.change[k] += alpha * b.direction[k];
        b.direction_product[k] = b.product[k] + beta * b.direction_product[k];
        b.residual[k] -= alpha * b.direction_product[k];
        b.z[k] = b.mobility[k] * b.residual[k];
      }
      sum += changed(b, length);
    }
    return sum;
  }

  /// 0 or 1, or NaN, which a sum keeps.
  double unmet(double norm, double target)
  {
    if (!std::isfinite(norm + target)) return std::numeric_limits<double>::quiet_NaN();
    return norm > target ? 1.0 : 0.0;
  }

}    // namespace

CgProducts cg_products(const CgArrays &a, std::size_t n, double h, Level level)
{
  return call_at(level, [&]() EVP_KERNEL {
    return products(a, n, h);
  });
}

double cg_update(const CgArrays &a, std::size_t n, double alpha, double beta, Level level)
{
  return call_at(level, [&]() EVP_KERNEL {
    return update(a, n, alpha, beta);
  });
}

double cg_changed(const CgArrays &a, std::size_t n)
{
  return changed(a, n);
}

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
