// SPDX-License-Identifier: GPL-2.0-only
//
// Connected sets, and the bodies of one MPI rank and of several.

#include "core/cg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
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
  EXPECT_EQ(bodies.runs()[0].first, 0);
  EXPECT_EQ(bodies.runs()[0].last, 5);
  EXPECT_EQ(bodies.runs()[0].body, 1);
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

TEST(Bodies, prescribed_atoms_belong_to_none_and_connect_none)
{
  const std::vector<double> labels = {1.0, 2.0, 3.0};
  Bodies bodies;
  bodies.clear(3);
  bodies.add(0, true, 1, false);
  bodies.add(1, false, 2, true);
  bodies.number(labels.data(), 1, 3, {});
  EXPECT_EQ(bodies.of_atoms(), (std::vector<int>{1, 0, 2}));
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

// Atoms at random on four ranks, each pair on one of its ranks or on both, some atoms prescribed.
TEST(Bodies, over_ranks_they_are_what_pairs_connect)
{
  Numbers numbers;
  for (const bool on_both : {false, true})
    for (const int npairs : {0, 10, 50, 90, 130, 400}) {
      const int n = 160, nranks = 4;
      std::vector<int> owner, prescribed;
      for (int i = 0; i < n; i++) {
        owner.push_back(numbers.below(nranks));
        prescribed.push_back(numbers.below(12) == 0);
      }
      std::vector<std::pair<int, int>> pairs, connecting;
      std::vector<double> expected;
      std::vector<bool> damped(n, false);
      for (int i = 0; i < n; i++) expected.push_back(i);
      for (int k = 0; k < npairs; k++) {
        const int i = numbers.below(n), j = (i + 1 + numbers.below(n - 1)) % n;
        pairs.push_back({i, j});
        damped[i] = damped[j] = true;
        if (!prescribed[i] && !prescribed[j]) connecting.push_back({i, j});
      }
      expected = reachable(connecting, expected);

      struct Rank {
        std::vector<int> atoms;    // own, then ghosts
        int nlocal = 0;
        std::vector<double> labels;
        Bodies bodies;
      };
      std::vector<Rank> ranks(nranks);
      for (int i = 0; i < n; i++) ranks[owner[i]].atoms.push_back(i);
      std::vector<double> label_of(n);
      for (int r = 0; r < nranks; r++) {
        Rank &rank = ranks[r];
        rank.nlocal = (int) rank.atoms.size();
        const auto index = [&](int i) {
          const auto found = std::find(rank.atoms.begin(), rank.atoms.end(), i);
          if (found != rank.atoms.end()) return (int) (found - rank.atoms.begin());
          rank.atoms.push_back(i);
          return (int) rank.atoms.size() - 1;
        };
        std::vector<std::pair<int, int>> here;
        for (const auto &[i, j] : pairs) {
          if (owner[i] == r) here.push_back({index(i), index(j)});
          if (owner[j] == r && owner[i] != r && on_both) here.push_back({index(j), index(i)});
        }
        rank.bodies.clear((int) rank.atoms.size());
        for (const auto &[a, b] : here)
          rank.bodies.add(a, !prescribed[rank.atoms[a]], b, !prescribed[rank.atoms[b]]);
        for (int a = 0; a < rank.nlocal; a++)
          label_of[rank.atoms[a]] = 1.0 + rank.atoms[rank.bodies.root(a)];
      }
      std::vector<Bodies::Link> links;
      for (Rank &rank : ranks) {
        for (const int i : rank.atoms) rank.labels.push_back(label_of[i]);
        std::vector<Bodies::Link> own;
        rank.bodies.find_links(rank.labels.data(), 1, rank.nlocal, own);
        links.insert(links.end(), own.begin(), own.end());
      }

      std::map<double, std::set<std::pair<int, int>>>
          names;    // rank, number; rank 0 of shared ones
      std::map<std::pair<int, int>, std::set<double>> atoms;
      int shared = ranks[0].bodies.shared_count();
      for (int r = 0; r < nranks; r++) {
        Rank &rank = ranks[r];
        rank.bodies.number(rank.labels.data(), 1, rank.nlocal, links);
        if (r == 0) shared = rank.bodies.shared_count();
        EXPECT_EQ(rank.bodies.shared_count(), shared);
        for (int a = 0; a < rank.nlocal; a++) {
          const int i = rank.atoms[a], number = rank.bodies.of_atoms()[a];
          ASSERT_EQ(number == 0, prescribed[i] || !damped[i]) << i;
          if (number == 0) continue;
          const std::pair<int, int> name = {number <= shared ? 0 : r, number};
          names[expected[i]].insert(name);
          atoms[name].insert(expected[i]);
        }
      }
      for (const auto &[body, found] : names) EXPECT_EQ(found.size(), 1u) << body;
      for (const auto &[name, found] : atoms) EXPECT_EQ(found.size(), 1u) << name.second;
    }
}
