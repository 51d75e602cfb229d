// SPDX-License-Identifier: GPL-2.0-only
//
// The loops of the conjugate gradients against plain sums, and the same bits on every instruction
// set; connected sets, and the bodies of one MPI rank. The solve itself, body by body and on any
// number of ranks: tests/lammps/test_bodies_apart.py.

#include "core/damping/cg.h"
#include "pair_cases.h"

#include <algorithm>
#include <utility>

using namespace EVP;
using pair_cases::on_each_instruction_set;

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

// three values each, around the widths of registers, sums and chunks
const int ATOMS[] = {1, 2, 3, 85, 86, 171, 500};

AtomValues labels_of(const std::vector<double> &numbers)
{
  AtomValues labels(1, numbers.size());
  labels.set_first(numbers.size(), numbers.data());
  return labels;
}

Bodies one_body(int natoms)
{
  Bodies bodies;
  bodies.clear(natoms);
  for (int i = 1; i < natoms; i++) bodies.add(i - 1, true, i, true);
  if (natoms == 1) bodies.add(0, true, 0, true);
  bodies.number(AtomValues(1, natoms, 1.0), natoms, {});
  return bodies;
}

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

// The product C z is an array that stays, scaled, as if C were diagonal.
TEST(Cg, iterations_are_those_of_plain_sums_and_have_the_same_bits_on_every_instruction_set)
{
  for (const int natoms : ATOMS) {
    const std::size_t n = (std::size_t) 3 * natoms;
    const Bodies bodies = one_body(natoms);
    const double h = 0.3;
    Values first(0);
    on_each_instruction_set([&] {
      Values values(n);
      auto &[mobility, inertia, change, r, direction, direction_product, z, product] = values.array;
      const std::vector<double> stiff = product;
      Values plain = values;
      ConjugateGradients cg;
      cg.start(bodies, values.view(), inertia.data(), h, 1e-12);
      double alpha = 1.0, last_norm = 0.0;
      for (int it = 0; it < 3; it++) {
        for (std::size_t k = 0; k < n; k++)
          product[k] = plain.array[7][k] = stiff[k] * plain.array[6][k];
        cg.gather();
        ASSERT_EQ(cg.judge(), ConjugateGradients::State::RUNNING);
        cg.update();

        auto &p = plain.array;
        double norm = 0.0, curvature = 0.0;
        for (std::size_t k = 0; k < n; k++) {
          p[7][k] = p[3][k] + h * p[7][k];
          norm += p[3][k] * p[6][k];
          curvature += p[7][k] * p[6][k];
        }
        const double beta = it ? norm / last_norm : 0.0;
        alpha = norm / (curvature - beta * norm / alpha);
        last_norm = norm;
        for (std::size_t k = 0; k < n; k++) {
          p[4][k] = p[6][k] + beta * p[4][k];
          p[2][k] += alpha * p[4][k];
          p[5][k] = p[7][k] + beta * p[5][k];
          p[3][k] -= alpha * p[5][k];
          p[6][k] = p[0][k] * p[3][k];
        }
        for (int a = 2; a < 8; a++)
          for (std::size_t k = 0; k < n; k++)
            EXPECT_NEAR(values.array[a][k], p[a][k], 1e-11 * (1.0 + std::fabs(p[a][k])));
      }
      if (first.array[0].empty()) first = values;
      for (int a = 0; a < 8; a++) EXPECT_EQ(values.array[a], first.array[a]);
    });
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
  const AtomValues labels = labels_of({1.0, 2.0, 3.0, 2.0, 5.0});
  Bodies bodies;
  bodies.clear(5);
  bodies.add(1, true, 3, true);
  bodies.number(labels, 5, {});
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
  bodies.number(labels, 3, {});
  EXPECT_EQ(bodies.of_atoms(), (std::vector<int>{1, 0, 2}));
}

TEST(Bodies, without_a_body_there_are_no_runs_but_the_numbers_of_shared_bodies)
{
  const AtomValues labels = labels_of({11.0, 12.0});
  Bodies bodies;
  for (const int n : {2, 0}) {
    bodies.clear(n);
    bodies.number(labels, n, {{3.0, 8.0}, {4.0, 4.0}});
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
    const int n = 100;
    AtomValues labels(1, n);
    bodies.clear(n);
    for (int k = 0; k < npairs; k++) bodies.add(numbers.below(n), true, numbers.below(n), true);
    for (int i = 0; i < n; i++) labels[i][0] = 1.0 + bodies.root(i);
    bodies.number(labels, n, {});
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
