// SPDX-License-Identifier: GPL-2.0-only

#include "core/cg.h"

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

  /// Calls f(arrays from there on, number of values), an EVP_KERNEL lambda, for each chunk.
  template <class F>
  void for_each_chunk(const CgArrays &a, std::size_t n, InstructionSet level, const F &f)
  {
    call_at(level, [&]() EVP_KERNEL {
      for (std::size_t first = 0; first < n; first += CHUNK)
        f(a.from(first), std::min(CHUNK, n - first));
    });
  }

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
    return sum_of(n, [&](std::size_t k) EVP_KERNEL {
      return a.inertia[k] * a.change[k] * a.change[k];
    });
  }

}    // namespace

void cg_changed(const CgArrays &arrays, std::size_t n, CgSums &sums, InstructionSet level)
{
  for_each_chunk(arrays, n, level, [&](const CgArrays &a, std::size_t length) EVP_KERNEL {
    sums.changed += changed(a, length);
  });
}

void cg_products(const CgArrays &arrays, std::size_t n, double h, CgSums &sums,
                 InstructionSet level)
{
  for_each_chunk(arrays, n, level, [&](const CgArrays &a, std::size_t length) EVP_KERNEL {
    EVP_INDEPENDENT
    for (std::size_t k = 0; k < length; k++) a.product[k] = a.residual[k] + h * a.product[k];
    sums.norm += sum_of(length, [&](std::size_t k) EVP_KERNEL {
      return a.residual[k] * a.z[k];
    });
    sums.curvature += sum_of(length, [&](std::size_t k) EVP_KERNEL {
      return a.product[k] * a.z[k];
    });
  });
}

void cg_update(const CgArrays &arrays, std::size_t n, double alpha, double beta, CgSums &sums,
               InstructionSet level)
{
  for_each_chunk(arrays, n, level, [&](const CgArrays &a, std::size_t length) EVP_KERNEL {
    EVP_INDEPENDENT
    for (std::size_t k = 0; k < length; k++) {
      a.direction[k] = a.z[k] + beta * a.direction[k];
      a.change[k] += alpha * a.direction[k];
      a.direction_product[k] = a.product[k] + beta * a.direction_product[k];
      a.residual[k] -= alpha * a.direction_product[k];
      a.z[k] = a.mobility[k] * a.residual[k];
    }
    sums.changed += changed(a, length);
  });
}

void ConjugateGradients::start(const Bodies &bodies_in, const CgArrays &arrays_in,
                               const double *undamped, double h_in, double tolerance)
{
  bodies = &bodies_in;
  arrays = arrays_in;
  h = h_in;
  tolerance_squared = tolerance * tolerance;
  restart();
  parts.assign(bodies->count(), CgSums{});
  for_each_active_run([this](const System &, CgSums &part, const CgArrays &a, std::size_t n) {
    cg_changed(a, n, part, level);
  });
  const double *v = undamped, *inertia = arrays.inertia;
  for (const int body : bodies->of_atoms()) {
    parts[body].undamped += *inertia * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    v += 3;
    inertia += 3;
  }
}

void ConjugateGradients::gather()
{
  for (CgSums &part : parts) part.norm = part.curvature = 0.0;
  for_each_active_run([this](const System &, CgSums &part, const CgArrays &a, std::size_t n) {
    cg_products(a, n, h, part, level);
  });
  all_sums = parts;
  for (int body = bodies->shared_count() + 1; body < bodies->count(); body++)
    if (systems[body].active) all_sums[0].norm += unmet(parts[body]);
}

ConjugateGradients::State ConjugateGradients::judge()
{
  double unfinished = all_sums[0].norm + 0.0 * all_sums[0].undamped;
  for (int body = 1; body < bodies->count(); body++) {
    System &system = systems[body];
    if (!system.active) continue;
    const CgSums &sum = all_sums[body];
    const double left = unmet(sum);
    system.active = left != 0.0;
    if (!system.active) continue;
    if (body <= bodies->shared_count()) unfinished += left;
    system.beta = system.started ? sum.norm / system.last_norm : 0.0;
    system.alpha = sum.norm /
        (sum.curvature - (system.started ? system.beta * sum.norm / system.last_alpha : 0.0));
    system.started = true;
    system.last_norm = sum.norm;
    system.last_alpha = system.alpha;
  }
  if (!std::isfinite(unfinished)) return State::NOT_FINITE;
  return unfinished > 0.0 ? State::RUNNING : State::CONVERGED;
}

void ConjugateGradients::update()
{
  for (CgSums &part : parts) part.changed = 0.0;
  for_each_active_run([this](const System &system, CgSums &part, const CgArrays &a, std::size_t n) {
    cg_update(a, n, system.alpha, system.beta, part, level);
  });
}

double ConjugateGradients::worst() const
{
  double ratio = 0.0;
  for (int body = 1; body < bodies->count(); body++)
    if (systems[body].active) ratio = std::max(ratio, all_sums[body].norm / target(all_sums[body]));
  return std::sqrt(ratio);
}

double ConjugateGradients::target(const CgSums &sums) const
{
  return std::max(
      {tolerance_squared * sums.changed, ROUND_OFF * ROUND_OFF * sums.undamped, AT_REST});
}

/// 0 or 1, or NaN, which a sum keeps.
double ConjugateGradients::unmet(const CgSums &sums) const
{
  const double most = target(sums);
  if (!std::isfinite(sums.norm + most)) return std::numeric_limits<double>::quiet_NaN();
  return sums.norm > most ? 1.0 : 0.0;
}

}    // namespace EVP
