// SPDX-License-Identifier: GPL-2.0-only
//
// Connected sets, and the bodies of one MPI rank; those of several: tests/lammps/test_bodies_apart.py.

#include "core/cg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

using namespace EVP;

namespace {

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
