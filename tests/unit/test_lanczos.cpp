// SPDX-License-Identifier: GPL-2.0-only
// The largest eigenvalue against matrices whose spectrum is known in closed form.

#include "core/timestep/stiffness_matrix.h"

#include <gtest/gtest.h>

using namespace EVP;

namespace {

constexpr double TOLERANCE = 1e-4;    // what the call asks for
constexpr double PI = 3.14159265358979323846;

double dot(const std::vector<double> &a, const std::vector<double> &b)
{
  double sum = 0.0;
  for (size_t k = 0; k < a.size(); k++) sum += a[k] * b[k];
  return sum;
}

std::vector<double> start_vector(size_t n)
{
  std::vector<double> v(n);
  for (size_t k = 0; k < n; k++) v[k] = std::fmod(0.618 * (k + 1), 1.0) - 0.3;
  return v;
}

/// Chain of n masses between walls, k = m = 1: eigenvalues 4 sin^2(pi q / (2 (n + 1))).
void chain(const std::vector<double> &in, std::vector<double> &out)
{
  const size_t n = in.size();
  for (size_t k = 0; k < n; k++)
    out[k] = 2 * in[k] - (k ? in[k - 1] : 0.0) - (k + 1 < n ? in[k + 1] : 0.0);
}

}    // namespace

TEST(Lanczos, FindsTheTopOfAChain)
{
  for (const size_t n : {1, 2, 10, 1000}) {
    std::vector<double> v = start_vector(n);
    const LanczosResult found = largest_eigenvalue(v, chain, dot, TOLERANCE, 500);
    const double exact = 4 * std::pow(std::sin(PI * n / (2.0 * (n + 1))), 2);
    EXPECT_TRUE(found.converged);
    EXPECT_LE(found.eigenvalue, exact * (1 + 1e-10));    // Ritz values never exceed the spectrum
    EXPECT_GE(found.eigenvalue, exact * (1 - 1e-2));
  }
  // a bound on the iterations that is too small must be told, not passed off as an answer
  std::vector<double> v = start_vector(1000);
  EXPECT_FALSE(largest_eigenvalue(v, chain, dot, TOLERANCE, 3).converged);
}

TEST(Lanczos, StopsInAnInvariantSpace)
{
  std::vector<double> v = {1, 1, 1};
  const auto triple = [](const auto &in, auto &out) {
    for (size_t k = 0; k < in.size(); k++) out[k] = 3 * in[k];
  };
  const LanczosResult found = largest_eigenvalue(v, triple, dot, TOLERANCE, 500);
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.eigenvalue, 3, 1e-12);

  // nothing to do gives zero
  std::vector<double> none;
  EXPECT_EQ(largest_eigenvalue(none, chain, dot, TOLERANCE, 500).eigenvalue, 0.0);
  v = start_vector(5);
  const auto zero = [](const auto &, auto &out) {
    std::fill(out.begin(), out.end(), 0.0);
  };
  EXPECT_EQ(largest_eigenvalue(v, zero, dot, TOLERANCE, 500).eigenvalue, 0.0);
}

// A dense band shows its top first, and the value rests there for a while: stopping after four quiet iterations ends 2.4 % low.
TEST(Lanczos, FindsATopThatTheStartHardlyHolds)
{
  constexpr size_t N = 200;
  constexpr double TOP = 1.02, SHARE = 1e-3;
  std::vector<double> v = start_vector(N);
  v[N - 1] *= SHARE;
  const auto band = [](const auto &in, auto &out) {
    for (size_t k = 0; k < N; k++) out[k] = (k + 1 < N ? k / (N - 1.0) : TOP) * in[k];
  };
  EXPECT_NEAR(largest_eigenvalue(v, band, dot, TOLERANCE, 500).eigenvalue, TOP, 1e-4 * TOP);
}
