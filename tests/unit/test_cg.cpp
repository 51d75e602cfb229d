// SPDX-License-Identifier: GPL-2.0-only
//
// The loops of the conjugate gradients against plain sums, and the same bits on every instruction
// set; connected sets, and the bodies of one MPI rank. The solve itself, body by body and on any
// number of ranks: tests/lammps/test_bodies_apart.py.

#include "core/cg.h"
#include "pair_cases.h"

#include <algorithm>
#include <utility>

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

struct Numbers {
  std::mt19937 random;
  int below(int n) { return (int) (random() % (unsigned) n); }
};

/// The lowest label that each node can reach, by repetition until nothing changes.
std::vector<double> reachable(const std::vector<std::pair<int, int>> &pairs,
                              std::vector<double> labels)
{
  for (bool fell = true; fell;) {
    fell = false;
    for (const auto &[a, b] : pairs) {
      const double low = std::min(labels[a], labels[b]);
      fell = fell || labels[a] != low || labels[b] != low;
      labels[a] = labels[b] = low;
    }
  }
  return labels;
}

}    // namespace

TEST(Cg, products_are_the_plain_sums_and_update_is_one_step_of_the_iteration)
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

    const double alpha = 0.7, beta = 0.2;
    values = before;
    CgSums again = {};
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

TEST(Bodies, sets_are_what_pairs_connect)
{
  Numbers numbers;
  ConnectedSets sets;
  for (const int npairs : {0, 1, 40, 100, 150, 400}) {
    const int n = 200;
    std::vector<std::pair<int, int>> pairs;
    std::vector<double> own;
    for (int k = 0; k < n; k++) own.push_back(k);
    sets.assign(n);
    for (int k = 0; k < npairs; k++) {
      pairs.push_back({numbers.below(n), numbers.below(n)});
      sets.join(pairs.back().first, pairs.back().second);
    }
    const std::vector<double> expected = reachable(pairs, own);
    for (int k = 0; k < n; k++) EXPECT_EQ(sets.root(k), expected[k]) << npairs;
  }
}

TEST(Bodies, one_body_is_one_run_over_all_atoms)
{
  const std::vector<double> labels = {1.0, 2.0, 3.0, 2.0, 5.0};
  Bodies bodies;
  bodies.clear(5);
  bodies.add(1, true, 3, true);
  bodies.number(labels.data(), 1, 5, {});
  EXPECT_EQ(bodies.count(), 2);
  EXPECT_EQ(bodies.shared_count(), 0);
  EXPECT_EQ(bodies.of_atoms(), (std::vector<int>{0, 1, 0, 1, 0}));
  ASSERT_EQ(bodies.runs().size(), 1u);
  const auto run = bodies.runs()[0];
  EXPECT_TRUE(run.first == 0 && run.last == 5 && run.body == 1);

  // prescribed atoms belong to none and connect none
  bodies.clear(3);
  bodies.add(0, true, 1, false);
  bodies.add(1, false, 2, true);
  bodies.number(labels.data(), 1, 3, {});
  EXPECT_EQ(bodies.of_atoms(), (std::vector<int>{1, 0, 2}));
}

TEST(Bodies, without_a_body_there_are_no_runs_but_the_numbers_of_shared_bodies)
{
  const std::vector<double> labels = {11.0, 12.0};
  Bodies bodies;
  for (const int n : {2, 0}) {
    bodies.clear(n);
    bodies.number(labels.data(), 1, n, {{3.0, 8.0}, {4.0, 4.0}});
    EXPECT_EQ(bodies.count(), 3);
    EXPECT_EQ(bodies.shared_count(), 2);
    EXPECT_TRUE(bodies.runs().empty());
    EXPECT_EQ((int) bodies.of_atoms().size(), n);
  }
}

TEST(Bodies, runs_hold_all_atoms_and_those_of_their_body_only)
{
  Numbers numbers;
  Bodies bodies;
  for (const int npairs : {1, 20, 60, 100, 300}) {
    const int n = 100, stride = 3;
    std::vector<double> labels(stride * n);
    bodies.clear(n);
    for (int k = 0; k < npairs; k++) bodies.add(numbers.below(n), true, numbers.below(n), true);
    for (int i = 0; i < n; i++) labels[stride * i] = 1.0 + bodies.root(i);
    bodies.number(labels.data(), stride, n, {});
    int next = 0;
    for (const auto &run : bodies.runs()) {
      EXPECT_EQ(run.first, next);
      next = run.last;
      for (int i = run.first; i < run.last; i++)
        EXPECT_TRUE(bodies.of_atoms()[i] == run.body || bodies.of_atoms()[i] == 0);
    }
    EXPECT_EQ(next, n);
  }
}
