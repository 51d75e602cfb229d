// SPDX-License-Identifier: GPL-2.0-only
// Upper limits of the timestep against closed forms, a search over directions, and the limit of the network.

#include "core/linear_network.h"
#include "core/single_particles.h"
#include "one_rank.h"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using EVP::LinearNetwork;
using EVP::SingleParticles;

namespace {

constexpr double MASS = 2.0, AXIAL = 7.0, DAMPING = 3.0, HUGE_DT = 1e20;
constexpr double ALONG_X[] = {1.0, 0.0, 0.0}, SLANTED[] = {0.48, -0.6, 0.64};

double root_of(double k, double c)    // of dt^2 k + 2 dt c = 4
{
  return 4.0 / (c + std::sqrt(c * c + 4.0 * k));
}

std::array<double, 3> direction(std::mt19937 &random)
{
  std::normal_distribution<double> normal;
  std::array<double, 3> u = {normal(random), normal(random), normal(random)};
  const double length = std::hypot(u[0], u[1], u[2]);
  for (double &c : u) c /= length;
  return u;
}

/// The same links in both; damping as given, negative where it is implicit.
SingleParticles blocks_of(const LinearNetwork &network, double sign = 1.0)
{
  SingleParticles particles(network.inverse_mass.size(), true);
  for (const LinearNetwork::Link &link : network.links)
    for (const int i : {link.i, link.j})
      particles.add(i, link.u, link.axial, link.across, sign * link.damping);
  return particles;
}

LinearNetwork random_network(unsigned seed)
{
  static OneRank alone;
  constexpr int N = 8;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.2, 3.0);
  LinearNetwork network(alone);
  network.nreact = N;
  for (int i = 0; i < N; i++) network.inverse_mass.push_back(uniform(random));
  for (int k = 0; k < 3 * N; k++) network.start.push_back(uniform(random));
  for (int i = 0; i < N; i++)
    for (int j = i + 1; j < N; j++) {
      const auto u = direction(random);
      network.links.push_back(
          {i, j, {u[0], u[1], u[2]}, uniform(random), 0.1 * uniform(random), uniform(random)});
    }
  return network;
}

}    // namespace

TEST(SingleParticles, OneOscillator)
{
  for (const double *u : {ALONG_X, SLANTED}) {
    SingleParticles particles(1, false);
    particles.add(0, u, AXIAL, -0.5, DAMPING);    // under compression
    const double limit = 2.0 / std::sqrt(AXIAL / MASS);
    EXPECT_NEAR(particles.lowest_limit({1.0 / MASS}, HUGE_DT), limit, 1e-12);
    EXPECT_NEAR(particles.lowest_limit({1.0 / MASS}, 1.001 * limit), limit, 1e-12);
    EXPECT_EQ(particles.lowest_limit({1.0 / MASS}, 0.999 * limit), 0.999 * limit);
    EXPECT_EQ(particles.lowest_limit({0.0}, HUGE_DT), HUGE_DT) << "held";
  }
}

TEST(SingleParticles, DampingLowersTheLimitOrRaisesIt)
{
  const double k = AXIAL / MASS, c = DAMPING / MASS;
  for (const double *u : {ALONG_X, SLANTED})
    for (const double sign : {1.0, -1.0}) {
      SingleParticles particles(1, true);
      particles.add(0, u, AXIAL, 0.0, sign * DAMPING);
      EXPECT_NEAR(particles.lowest_limit({1.0 / MASS}, HUGE_DT), root_of(k, sign * c), 1e-12);
    }
  const double a = DAMPING / AXIAL, omega = std::sqrt(k);
  EXPECT_NEAR(root_of(k, -c), a + std::sqrt(a * a + 4.0 / (omega * omega)), 1e-12)
      << "of compute evp/dt, for fix nve/evp";
}

TEST(SingleParticles, DampersAloneAndNothing)
{
  SingleParticles particles(2, true);
  particles.add(0, SLANTED, 0.0, 0.0, DAMPING);
  EXPECT_NEAR(particles.lowest_limit({1.0, 1.0}, HUGE_DT), 2.0 / DAMPING, 1e-12);
  EXPECT_EQ(particles.lowest_limit({0.0, 1.0}, HUGE_DT), HUGE_DT);
  EXPECT_EQ(SingleParticles(0, true).lowest_limit({}, 1.0), 1.0);
}

TEST(SingleParticles, NoDirectionHasALowerLimit)
{
  std::mt19937 random(7);
  for (unsigned seed = 1; seed <= 5; seed++)
    for (const double sign : {1.0, -1.0}) {
      const LinearNetwork network = random_network(seed);
      const SingleParticles particles = blocks_of(network, sign);
      const double limit = particles.lowest_limit(network.inverse_mass, HUGE_DT);
      double lowest = HUGE_DT;
      for (int trial = 0; trial < 20000; trial++) {
        const auto e = direction(random);
        for (int i = 0; i < network.nreact; i++) {
          double k = 0.0, c = 0.0;
          for (const LinearNetwork::Link &link : network.links) {
            if (link.i != i && link.j != i) continue;
            const double along = link.u[0] * e[0] + link.u[1] * e[1] + link.u[2] * e[2];
            k += link.axial * along * along + link.across * (1.0 - along * along);
            c += sign * link.damping * along * along;
          }
          lowest =
              std::min(lowest, root_of(network.inverse_mass[i] * k, network.inverse_mass[i] * c));
        }
      }
      EXPECT_GE(lowest, limit * (1.0 - 1e-12));
      EXPECT_LE(lowest, limit * 1.001);
    }
}

TEST(SingleParticles, TheLimitOfTheNetworkIsLower)
{
  for (unsigned seed = 1; seed <= 10; seed++) {
    LinearNetwork network = random_network(seed);
    const double limit = blocks_of(network).lowest_limit(network.inverse_mass, HUGE_DT);
    const double at_limit =
        network.largest_eigenvalue({limit * limit, limit * limit, 2.0 * limit}, 1e-9, 200)
            .eigenvalue;
    EXPECT_GE(at_limit, 4.0 * (1.0 - 1e-6));
    EXPECT_LE(at_limit, 16.0) << "control";
  }
}
