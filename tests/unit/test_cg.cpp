// SPDX-License-Identifier: GPL-2.0-only
//
// Conjugate gradients: the loops against plain sums, and the same bits on every instruction set; chains of dashpots body by body, on one rank and on two that are
// summed here.

#include "core/cg.h"
#include "pair_cases.h"

#include <cmath>
#include <numeric>

using namespace EVP;
using pair_cases::levels;

namespace {

/// Eight arrays of n values between 0.5 and 1.5, the same for the same n.
struct Values {
  std::vector<double> array[8];
  explicit Values(std::size_t n)
  {
    std::mt19937 random(2017);
    std::uniform_real_distribution<double> near_one(0.5, 1.5);
    for (auto &values : array)
      for (std::size_t k = 0; k < n; k++) values.push_back(near_one(random));
  }
  CgArrays view()
  {
    return {array[0].data(), array[1].data(), array[2].data(), array[3].data(),
            array[4].data(), array[5].data(), array[6].data(), array[7].data()};
  }
};

// around the widths of registers, sums and chunks
const std::size_t SIZES[] = {0, 1, 3, 7, 8, 9, 255, 256, 257, 1500};

constexpr double H = 1.0;
constexpr int MOST_ITERATIONS = 200;

/// Bodies that are chains of n atoms with velocities of their own size, dashpots along x.
struct Chains {
  int bodies, each;
  std::vector<double> mobility, inertia, undamped, stiffness;

  Chains(int bodies_in, int each_in) : bodies(bodies_in), each(each_in)
  {
    for (int b = 0; b < bodies; b++)
      for (int i = 0; i < each; i++) {
        const double mass = 1.0 + 0.3 * std::sin(1.3 * i + b), size = std::pow(10.0, -3.0 * b);
        for (int c = 0; c < 3; c++) {
          mobility.push_back(1.0 / mass);
          inertia.push_back(mass);
          undamped.push_back(c == 0 ? size * std::cos(2.1 * i + b) : size);
        }
        stiffness.push_back((1.0 + b) * (2.0 + std::sin(0.7 * i)));    // of the dashpot to i + 1
      }
  }
  int atoms() const { return bodies * each; }

  /// C z
  std::vector<double> product(const std::vector<double> &z) const
  {
    std::vector<double> y(z.size(), 0.0);
    for (int i = 0; i + 1 < atoms(); i++) {
      if ((i + 1) % each == 0) continue;
      const double force = stiffness[i] * (z[3 * i] - z[3 * i + 3]);
      y[3 * i] += force;
      y[3 * i + 3] -= force;
    }
    return y;
  }
};

/// Residual over what the damping did, for each body, both anew from the velocities.
std::vector<double> ratios(const Chains &chains, const std::vector<double> &change)
{
  std::vector<double> v(change.size()), found;
  for (size_t k = 0; k < v.size(); k++) v[k] = chains.undamped[k] + change[k];
  const std::vector<double> y = chains.product(v);
  for (int b = 0; b < chains.bodies; b++) {
    double norm = 0.0, changed = 0.0;
    for (int k = 3 * b * chains.each; k < 3 * (b + 1) * chains.each; k++) {
      const double r = -chains.inertia[k] * change[k] - H * y[k];
      norm += chains.mobility[k] * r * r;
      changed += chains.inertia[k] * change[k] * change[k];
    }
    found.push_back(std::sqrt(norm / changed));
  }
  return found;
}

struct Solved {
  std::vector<double> change;
  int iterations;
  ConjugateGradients::State state;
};

/// The chains on as many ranks as there are lists of atoms. Velocities of bodies other than `alone` are zero.
Solved solve(const Chains &chains, const std::vector<std::vector<int>> &ranks, double tolerance)
{
  struct Rank {
    std::vector<double> mobility, inertia, undamped, change, residual, direction, direction_product,
        z, product;
    Bodies bodies;
    ConjugateGradients cg;
  };
  const size_t n = chains.undamped.size();
  std::vector<Bodies::Link> links;
  if (ranks.size() > 1)
    for (int b = 0; b < chains.bodies; b++)
      links.push_back({1.0 + b * chains.each, 1.0 + b * chains.each});

  std::vector<Rank> all(ranks.size());
  const std::vector<double> start = chains.product(chains.undamped);
  for (size_t p = 0; p < ranks.size(); p++) {
    Rank &rank = all[p];
    std::vector<double> labels;
    rank.bodies.clear((int) ranks[p].size());
    for (const int i : ranks[p]) {
      labels.push_back(1.0 + i / chains.each * chains.each);
      const int last = (int) labels.size() - 1;
      if (last && labels[last] == labels[last - 1]) rank.bodies.add(last - 1, true, last, true);
      for (int k = 3 * i; k < 3 * i + 3; k++) {
        rank.mobility.push_back(chains.mobility[k]);
        rank.inertia.push_back(chains.inertia[k]);
        rank.undamped.push_back(chains.undamped[k]);
        rank.residual.push_back(-H * start[k]);
        rank.z.push_back(-H * start[k] * chains.mobility[k]);
      }
    }
    const size_t own = 3 * ranks[p].size();
    for (auto *values : {&rank.change, &rank.direction, &rank.direction_product, &rank.product})
      values->assign(own, 0.0);
    rank.bodies.number(labels.data(), 1, (int) ranks[p].size(), links);
    const CgArrays arrays = {rank.mobility.data(),  rank.inertia.data(),
                             rank.change.data(),    rank.residual.data(),
                             rank.direction.data(), rank.direction_product.data(),
                             rank.z.data(),         rank.product.data()};
    rank.cg.start(rank.bodies, arrays, rank.undamped.data(), H, tolerance);
  }

  Solved solved = {std::vector<double>(n), 0, ConjugateGradients::State::RUNNING};
  for (; solved.iterations < MOST_ITERATIONS; solved.iterations++) {
    std::vector<double> z(n), sums;
    for (size_t p = 0; p < ranks.size(); p++)
      for (size_t a = 0; a < 3 * ranks[p].size(); a++) z[3 * ranks[p][a / 3] + a % 3] = all[p].z[a];
    const std::vector<double> y = chains.product(z);
    for (size_t p = 0; p < ranks.size(); p++) {
      Rank &rank = all[p];
      for (size_t a = 0; a < 3 * ranks[p].size(); a++)
        rank.product[a] = y[3 * ranks[p][a / 3] + a % 3];
      rank.cg.gather();
      sums.resize(rank.cg.shared_sums(), 0.0);
      for (size_t k = 0; k < sums.size(); k++) sums[k] += rank.cg.sums()[k];
    }
    for (auto &rank : all) {
      std::copy(sums.begin(), sums.end(), rank.cg.sums());
      solved.state = rank.cg.judge();
    }
    if (solved.state != ConjugateGradients::State::RUNNING) break;
    for (auto &rank : all) rank.cg.update();
  }
  for (size_t p = 0; p < ranks.size(); p++)
    for (size_t a = 0; a < 3 * ranks[p].size(); a++)
      solved.change[3 * ranks[p][a / 3] + a % 3] = all[p].change[a];
  return solved;
}

std::vector<int> all_atoms(const Chains &chains)
{
  std::vector<int> atoms(chains.atoms());
  std::iota(atoms.begin(), atoms.end(), 0);
  return atoms;
}

std::vector<std::vector<int>> odd_and_even(const Chains &chains)
{
  std::vector<std::vector<int>> ranks(2);
  for (int i = 0; i < chains.atoms(); i++) ranks[i % 2].push_back(i);
  return ranks;
}

}    // namespace

TEST(Cg, products_are_the_plain_sums)
{
  for (const std::size_t n : SIZES) {
    Values values(n);
    const Values before = values;
    const double h = 0.3;
    CgSums sums = {};
    cg_products(values.view(), n, h, sums, InstructionSet::BASE);
    double norm = 0.0, curvature = 0.0;
    for (std::size_t k = 0; k < n; k++) {
      const double r = before.array[3][k], z = before.array[6][k];
      const double product = r + h * before.array[7][k];
      EXPECT_EQ(values.array[7][k], product);
      norm += r * z;
      curvature += product * z;
    }
    EXPECT_NEAR(sums.norm, norm, 1e-14 * norm);
    EXPECT_NEAR(sums.curvature, curvature, 1e-14 * curvature);
  }
}

TEST(Cg, update_is_one_step_of_the_iteration)
{
  for (const std::size_t n : SIZES) {
    Values values(n);
    const Values before = values;
    const double alpha = 0.7, beta = 0.2;
    CgSums sums = {}, again = {};
    cg_update(values.view(), n, alpha, beta, sums, InstructionSet::BASE);
    double sum = 0.0;
    for (std::size_t k = 0; k < n; k++) {
      const auto old = [&](int a) {
        return before.array[a][k];
      };
      const double direction = old(6) + beta * old(4), product = old(7) + beta * old(5);
      const double change = old(2) + alpha * direction, residual = old(3) - alpha * product;
      EXPECT_EQ(values.array[2][k], change);
      EXPECT_EQ(values.array[3][k], residual);
      EXPECT_EQ(values.array[4][k], direction);
      EXPECT_EQ(values.array[5][k], product);
      EXPECT_EQ(values.array[6][k], old(0) * residual);
      sum += old(1) * change * change;
    }
    EXPECT_NEAR(sums.changed, sum, 1e-14 * sum);
    cg_changed(values.view(), n, again, InstructionSet::BASE);
    EXPECT_EQ(again.changed, sums.changed);
  }
}

TEST(Cg, every_instruction_set_gives_the_same_bits)
{
  for (const std::size_t n : SIZES) {
    Values base(n);
    CgSums sums = {};
    cg_products(base.view(), n, 0.3, sums, InstructionSet::BASE);
    cg_update(base.view(), n, 0.7, 0.2, sums, InstructionSet::BASE);
    for (const InstructionSet level : levels()) {
      Values other(n);
      CgSums same = {};
      cg_products(other.view(), n, 0.3, same, level);
      cg_update(other.view(), n, 0.7, 0.2, same, level);
      EXPECT_EQ(same.norm, sums.norm);
      EXPECT_EQ(same.curvature, sums.curvature);
      EXPECT_EQ(same.changed, sums.changed);
      for (int a = 0; a < 8; a++) EXPECT_EQ(other.array[a], base.array[a]);
    }
  }
}

// Speeds of 1 to 1e-12. With one tolerance over all of them, the slowest would be off by far more than itself.
TEST(ConjugateGradients, each_body_meets_the_tolerance)
{
  const Chains chains(5, 40);
  for (const double tolerance : {1e-1, 1e-3, 1e-6}) {
    const Solved solved = solve(chains, {all_atoms(chains)}, tolerance);
    EXPECT_EQ(solved.state, ConjugateGradients::State::CONVERGED);
    for (const double ratio : ratios(chains, solved.change)) {
      EXPECT_LE(ratio, 1.001 * tolerance);
      EXPECT_GT(ratio, 1e-3 * tolerance) << "it goes on past its tolerance";
    }
  }
}

TEST(ConjugateGradients, a_body_is_solved_as_if_it_were_alone)
{
  const Chains both(2, 60);
  for (int body = 0; body < 2; body++) {
    Chains alone = both;
    for (int k = 0; k < 3 * 60; k++) alone.undamped[3 * 60 * (1 - body) + k] = 0.0;
    const Solved solved = solve(both, {all_atoms(both)}, 1e-3),
                 same = solve(alone, {all_atoms(both)}, 1e-3);
    EXPECT_GE(solved.iterations, same.iterations);
    for (int k = 3 * 60 * body; k < 3 * 60 * (body + 1); k++)
      EXPECT_EQ(solved.change[k], same.change[k]);
  }
}

TEST(ConjugateGradients, two_ranks_give_what_one_gives)
{
  const Chains chains(4, 30);
  const Solved one = solve(chains, {all_atoms(chains)}, 1e-3),
               two = solve(chains, odd_and_even(chains), 1e-3);
  EXPECT_EQ(two.state, ConjugateGradients::State::CONVERGED);
  EXPECT_EQ(one.iterations, two.iterations);
  for (int b = 0; b < 4; b++)
    for (int k = 3 * 30 * b; k < 3 * 30 * (b + 1); k++)
      EXPECT_NEAR(one.change[k], two.change[k], 1e-12 * std::pow(10.0, -3.0 * b));
}

TEST(ConjugateGradients, a_number_that_is_not_finite_is_told_on_every_rank)
{
  Chains chains(3, 10);
  chains.undamped[3 * 25] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solve(chains, {all_atoms(chains)}, 1e-3).state, ConjugateGradients::State::NOT_FINITE);
  EXPECT_EQ(solve(chains, odd_and_even(chains), 1e-3).state, ConjugateGradients::State::NOT_FINITE);
}

TEST(ConjugateGradients, speeds_whose_squares_underflow_are_rest)
{
  Chains chains(2, 30);
  for (auto &v : chains.undamped) v *= 1e-158;
  const Solved solved = solve(chains, {all_atoms(chains)}, 1e-3);
  EXPECT_EQ(solved.state, ConjugateGradients::State::CONVERGED);
  EXPECT_EQ(solved.iterations, 0);
}
