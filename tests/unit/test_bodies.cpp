// SPDX-License-Identifier: GPL-2.0-only
//
// Connected sets of nodes, and the bodies of one MPI rank with their slots.

#include "core/bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

using namespace EVP;

namespace {

/// Whole numbers below n, the same in every run.
class Numbers {
 public:
  int below(int n)
  {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (int) ((state >> 33) % (uint64_t) n);
  }

 private:
  uint64_t state = 4711;
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
  NodeSets sets;
  for (const int npairs : {0, 1, 40, 100, 150, 400}) {
    const int n = 200;
    std::vector<std::pair<int, int>> pairs;
    std::vector<double> labels;
    for (int k = 0; k < n; k++) labels.push_back(numbers.below(1000000));
    sets.assign(n);
    for (int k = 0; k < npairs; k++) {
      pairs.push_back({numbers.below(n), numbers.below(n)});
      sets.join(pairs.back().first, pairs.back().second);
    }
    const std::vector<double> expected = reachable(pairs, labels);
    EXPECT_EQ(sets.spread_lowest(labels, 1), npairs > 0);
    EXPECT_EQ(labels, expected) << npairs;
    EXPECT_FALSE(sets.spread_lowest(labels, 1));
  }
}

TEST(Bodies, values_of_a_node_fall_each_by_itself)
{
  NodeSets sets;
  sets.assign(3);
  sets.join(2, 0);
  std::vector<double> values = {5.0, 1.0, 0.0, 0.0, 4.0, 2.0};
  EXPECT_TRUE(sets.spread_lowest(values, 2));
  EXPECT_EQ(values, (std::vector<double>{4.0, 1.0, 0.0, 0.0, 4.0, 1.0}));
}

TEST(Bodies, one_body_is_one_run_over_all_atoms)
{
  const std::vector<double> labels = {NO_BODY, 7.0, NO_BODY, 7.0, NO_BODY};
  Bodies bodies;
  bodies.assign(labels.data(), 1, 5, {});
  ASSERT_EQ(bodies.count(), 1);
  ASSERT_EQ(bodies.runs().size(), 1u);
  EXPECT_EQ(bodies.runs()[0].first, 0);
  EXPECT_EQ(bodies.runs()[0].last, 5);
  EXPECT_EQ(bodies.slot_of(0), -1);
  EXPECT_EQ(bodies.slot_count(), 0);
}

TEST(Bodies, without_a_body_there_are_no_runs_but_all_slots)
{
  const std::vector<double> labels(4, NO_BODY);
  Bodies bodies;
  bodies.assign(labels.data(), 1, 4, {3.0, 8.0});
  EXPECT_EQ(bodies.count(), 0);
  EXPECT_TRUE(bodies.runs().empty());
  EXPECT_EQ(bodies.atoms(), 4);
  EXPECT_EQ(bodies.slot_count(), 2);
  bodies.assign(nullptr, 1, 0, {});
  EXPECT_EQ(bodies.atoms(), 0);
}

TEST(Bodies, runs_hold_all_atoms_and_those_of_their_body_only)
{
  Numbers numbers;
  Bodies bodies;
  for (const int kinds : {1, 2, 7, 60}) {
    const int n = 100, stride = 3;
    std::vector<double> labels(stride * n, -1.0);
    for (int i = 0; i < n; i++) {
      const int kind = numbers.below(kinds + 1);
      labels[stride * i] = kind == kinds ? NO_BODY : 10.0 * kind + 3.0;
    }
    bodies.assign(labels.data(), stride, n, {});
    int next = 0;
    for (const auto &run : bodies.runs()) {
      EXPECT_EQ(run.first, next);
      next = run.last;
      for (int i = run.first; i < run.last; i++)
        EXPECT_TRUE(bodies.body_of(i) == run.body || bodies.body_of(i) == -1);
    }
    EXPECT_EQ(next, n);
    for (int i = 0; i < n; i++) {
      EXPECT_EQ(bodies.body_of(i) == -1, labels[stride * i] == NO_BODY);
      for (int j = 0; j < i; j++)
        if (labels[stride * i] != NO_BODY) {
          EXPECT_EQ(bodies.body_of(i) == bodies.body_of(j),
                    labels[stride * i] == labels[stride * j]);
        }
    }
  }
}

TEST(Bodies, slots_are_shared_by_neighbors_in_rank_of_label_above_the_most_only)
{
  std::vector<double> across;
  for (int k = 0; k < 10; k++) across.push_back(100.0 + k);
  const std::vector<double> labels = {109.0, 5.0, 100.0, 104.0, 105.0};
  Bodies bodies;
  bodies.assign(labels.data(), 1, 5, across, 10);
  EXPECT_EQ(bodies.slot_count(), 10);
  EXPECT_FALSE(bodies.slots_are_shared());
  const auto slot_of_atom = [&](int i) {
    return bodies.slot_of(bodies.body_of(i));
  };
  EXPECT_EQ(slot_of_atom(0), 9);
  EXPECT_EQ(slot_of_atom(1), -1);
  EXPECT_EQ(slot_of_atom(2), 0);
  EXPECT_EQ(slot_of_atom(3), 4);

  bodies.assign(labels.data(), 1, 5, across, 4);
  EXPECT_EQ(bodies.slot_count(), 4);
  EXPECT_TRUE(bodies.slots_are_shared());
  EXPECT_EQ(slot_of_atom(0), 3);
  EXPECT_EQ(slot_of_atom(1), -1);
  EXPECT_EQ(slot_of_atom(2), 0);
  EXPECT_EQ(slot_of_atom(3), 1);
  EXPECT_EQ(slot_of_atom(4), 2);
}
