// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/base/simd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace EVP {

/// Sets of the numbers 0 ... n-1, connected by pairs.
class ConnectedSets {
 public:
  /// n sets of one number each. Room is kept.
  void assign(int n)
  {
    parent.resize(n);
    std::iota(parent.begin(), parent.end(), 0);
  }

  void join(int a, int b)
  {
    a = root(a);
    b = root(b);
    parent[std::max(a, b)] = std::min(a, b);
  }

  /// The lowest number of the set of k.
  int root(int k)
  {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  }

  double memory_usage() const { return bytes_of(parent); }

 private:
  std::vector<int> parent;
};

/// Atoms that damped pairs connect, over all MPI ranks. Body 0 is none. Those with links to other ranks
/// come next, with the same numbers on all ranks, then those of this rank alone.
///
/// To find them: clear(), add() each damped pair, find_links(), number() with the links of all ranks.
class Bodies {
 public:
  /// Atoms first ... last-1 belong to that body, or to none.
  struct Run {
    int first, last;
    int body;
  };

  /// Two labels of one body. The label of an atom is root() of it as an ID, found by its owner.
  using Link = std::array<double, 2>;

  /// n atoms and ghosts that no pair connects.
  void clear(int n)
  {
    sets.assign(n);
    damped.assign(n, false);
  }

  /// A pair of atoms, of which those with prescribed velocities belong to no body.
  void add(int i, bool i_is_integrated, int j, bool j_is_integrated)
  {
    if (i_is_integrated) damped[i] = true;
    if (j_is_integrated) damped[j] = true;
    if (i_is_integrated && j_is_integrated) sets.join(i, j);
  }

  /// The first atom on this rank that its pairs connect an atom to; a ghost if there is none.
  int root(int i) { return sets.root(i); }

  /// Of this rank, each once. labels: of atoms and ghosts, one each.
  void find_links(const AtomValues &labels, int nlocal, std::vector<Link> &links)
  {
    links.clear();
    for (int i = nlocal; i < (int) damped.size(); i++)
      if (damped[i]) links.push_back({labels[root(i)][0], labels[i][0]});
    std::sort(links.begin(), links.end());
    links.erase(std::unique(links.begin(), links.end()), links.end());
  }

  /// links: of all ranks.
  void number(const AtomValues &labels, int nlocal, const std::vector<Link> &links)
  {
    linked.clear();
    for (const Link &link : links) linked.insert(linked.end(), link.begin(), link.end());
    std::sort(linked.begin(), linked.end());
    linked.erase(std::unique(linked.begin(), linked.end()), linked.end());
    const auto place = [&](double label) {
      return (int) (std::lower_bound(linked.begin(), linked.end(), label) - linked.begin());
    };
    across.assign((int) linked.size());
    for (const auto &[a, b] : links) across.join(place(a), place(b));
    shared.resize(linked.size());
    nbodies = 1;
    for (int k = 0; k < (int) shared.size(); k++)
      shared[k] = across.root(k) == k ? nbodies++ : shared[across.root(k)];
    nshared = nbodies - 1;

    numbers.resize(nlocal);
    run_list.clear();
    for (int i = 0; i < nlocal; i++) {
      const double label = labels[i][0];
      const int first = root(i), k = place(label);
      if (first < i)
        numbers[i] = numbers[first];
      else if (k < (int) linked.size() && linked[k] == label)
        numbers[i] = shared[k];
      else
        numbers[i] = damped[i] ? nbodies++ : 0;
      if (!numbers[i] || (!run_list.empty() && run_list.back().body == numbers[i])) continue;
      if (!run_list.empty()) run_list.back().last = i;
      run_list.push_back({run_list.empty() ? 0 : i, nlocal, numbers[i]});
    }
  }

  /// All atoms in runs; none where no atom belongs to a body.
  const std::vector<Run> &runs() const { return run_list; }

  /// Number of bodies with atoms on this rank or with links between ranks, none included.
  int count() const { return nbodies; }

  /// Bodies 1 ... shared_count() have links.
  int shared_count() const { return nshared; }

  /// Of each atom of this rank.
  const std::vector<int> &of_atoms() const { return numbers; }

  double memory_usage() const
  {
    return sets.memory_usage() + across.memory_usage() + damped.capacity() / 8.0 +
        bytes_of(linked, shared, numbers, run_list);
  }

 private:
  ConnectedSets sets, across;    // of atoms and ghosts, of the labels in links
  std::vector<bool> damped;
  std::vector<double> linked;    // labels in links, ascending,
  std::vector<int> shared;       // and their bodies
  std::vector<int> numbers;
  std::vector<Run> run_list;
  int nbodies = 1, nshared = 0;
};

/// The arrays, of n values each and apart from each other, of a solve of (M + h C) v = b by conjugate
/// gradients, preconditioned by M.
struct CgArrays {
  const double *mobility, *inertia;    ///< M^-1 and M, both zero where v is prescribed
  double *change;                      ///< v minus a first guess of it
  double *residual;
  double *direction, *direction_product;    ///< and its product with M + h C
  double *z;                                ///< M^-1 residual
  double *product;                          ///< in: C z; out of products(): (M + h C) z

  /// The same from value k on.
  EVP_INLINE CgArrays from(std::size_t k) const
  {
    return {mobility + k,  inertia + k,           change + k, residual + k,
            direction + k, direction_product + k, z + k,      product + k};
  }
};

/// Over the atoms of a body: r.z, z.(M + h C) z, change.M change and v*.M v*, by which its round-off is
/// measured.
struct CgSums {
  double norm, curvature, changed, undamped;
};

/// (M + h C) v = b, preconditioned by M, in the form that needs one sum over MPI ranks per iteration
/// (Chronopoulos and Gear). Per iteration: arrays.product = C z; gather(); sum the first shared_sums() of
/// sums() over ranks; judge(); update().
///
/// Each body has its own coefficients, and does not change any more once it meets its tolerance. (With
/// common ones a slow body costs five times the iterations beside a fast one, until the residual of this
/// is below its own.)
class ConjugateGradients {
 public:
  enum class State { RUNNING, CONVERGED, NOT_FINITE };

  /// Starts from arrays.change, its residual and z. Tolerance: |r| over |M change| in the norm of M^-1,
  /// or at round-off of M undamped.
  void start(const Bodies &bodies, const CgArrays &arrays, const double *undamped, double h,
             double tolerance);

  /// From the same arrays with another residual and z; change is as it was left.
  void restart() { systems.assign(bodies->count(), System{}); }

  /// noise: of each atom [mass velocity^2], added to v*.M v*.
  void add_round_off(const std::vector<double> &noise)
  {
    for (std::size_t i = 0; i < noise.size(); i++)
      parts[bodies->of_atoms()[i]].undamped += noise[i];
  }

  void gather();
  double *sums() { return reinterpret_cast<double *>(all_sums.data()); }
  int shared_sums() const { return SUMS * (1 + bodies->shared_count()); }
  State judge();
  void update();

  /// Of judge(): largest residual over its tolerance, of the bodies with atoms here.
  double worst() const;

  double memory_usage() const { return bytes_of(all_sums, parts, systems); }

 private:
  static constexpr int SUMS = sizeof(CgSums) / sizeof(double);
  static_assert(sizeof(CgSums) == 4 * sizeof(double), "CgSums are a row of numbers");

  struct System {
    double alpha = 1.0, beta = 0.0, last_norm = HUGE_VAL;    // beta is 0 in the first iteration
    bool active = true;
  };

  const Bodies *bodies = nullptr;
  CgArrays arrays;
  double h, tolerance_squared;
  std::vector<System> systems;
  std::vector<CgSums> parts;       // on this rank
  std::vector<CgSums> all_sums;    // of bodies; first, norm: number of unfinished ones of one rank

  double target(const CgSums &) const;
  double unmet(const CgSums &) const;

  template <class F> void for_each_chunk(F &&f);
};

}    // namespace EVP
