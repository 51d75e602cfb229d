// SPDX-License-Identifier: GPL-2.0-only

#include "core/damping/cg.h"

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
    return sum_of(n, [&](std::size_t k) EVP_KERNEL {
      return a.inertia[k] * a.change[k] * a.change[k];
    });
  }

}    // namespace

/// Calls f(system, its sums, arrays, number of values), an EVP_KERNEL lambda, for the values of unfinished bodies in turn.
template <class F> void ConjugateGradients::for_each_chunk(F &&f)
{
  for (const auto &run : bodies->runs())
    if (systems[run.body].active)
      call_vectorized([&]() EVP_KERNEL {
        const std::size_t last = (std::size_t) 3 * run.last;
        for (std::size_t first = (std::size_t) 3 * run.first; first < last; first += CHUNK)
          f(systems[run.body], parts[run.body], arrays.from(first), std::min(CHUNK, last - first));
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
  for_each_chunk([](const System &, CgSums &part, const CgArrays &a, std::size_t n) EVP_KERNEL {
    part.changed += changed(a, n);
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
  for_each_chunk([h = h](const System &, CgSums &part, const CgArrays &a, std::size_t n)
                     EVP_KERNEL {
                       EVP_INDEPENDENT
                       for (std::size_t k = 0; k < n; k++)
                         a.product[k] = a.residual[k] + h * a.product[k];
                       part.norm += sum_of(n, [&](std::size_t k) EVP_KERNEL {
                         return a.residual[k] * a.z[k];
                       });
                       part.curvature += sum_of(n, [&](std::size_t k) EVP_KERNEL {
                         return a.product[k] * a.z[k];
                       });
                     });
  all_sums = parts;
  for (int body = bodies->shared_count() + 1; body < bodies->count(); body++)
    if (systems[body].active) all_sums[0].norm += unmet(parts[body]);
}

ConjugateGradients::State ConjugateGradients::judge()
{
  double unfinished = all_sums[0].norm;
  for (int body = 1; body < bodies->count(); body++) {
    System &system = systems[body];
    if (!system.active) continue;
    const CgSums &sum = all_sums[body];
    const double left = unmet(sum);
    system.active = left != 0.0;
    if (!system.active) continue;
    if (body <= bodies->shared_count()) unfinished += left;
    system.beta = sum.norm / system.last_norm;
    system.alpha = sum.norm / (sum.curvature - system.beta * sum.norm / system.alpha);
    system.last_norm = sum.norm;
  }
  if (!std::isfinite(unfinished) || !std::isfinite(all_sums[0].undamped)) return State::NOT_FINITE;
  return unfinished > 0.0 ? State::RUNNING : State::CONVERGED;
}

void ConjugateGradients::update()
{
  for (CgSums &part : parts) part.changed = 0.0;
  for_each_chunk([](const System &system, CgSums &part, const CgArrays &a, std::size_t n)
                     EVP_KERNEL {
                       const double alpha = system.alpha, beta = system.beta;
                       EVP_INDEPENDENT
                       for (std::size_t k = 0; k < n; k++) {
                         a.direction[k] = a.z[k] + beta * a.direction[k];
                         a.change[k] += alpha * a.direction[k];
                         a.direction_product[k] = a.product[k] + beta * a.direction_product[k];
                         a.residual[k] -= alpha * a.direction_product[k];
                         a.z[k] = a.mobility[k] * a.residual[k];
                       }
                       part.changed += changed(a, n);
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
