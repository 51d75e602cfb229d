// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/simd.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace EVP {

/// Label of an atom that belongs to no body.
constexpr double NO_BODY = std::numeric_limits<double>::infinity();

/// Sets of the nodes 0 ... n-1, connected by pairs.
class NodeSets {
 public:
  /// n sets of one node each. Room is kept.
  void assign(int n)
  {
    parent.resize(n);
    for (int k = 0; k < n; k++) parent[k] = k;
  }

  void join(int a, int b)
  {
    a = root(a);
    b = root(b);
    parent[std::max(a, b)] = std::min(a, b);
  }

  bool are_joined(int a, int b) { return root(a) == root(b); }

  /// The lowest node of the set of k.
  int root(int k)
  {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  }

  /// Gives each node the lowest values in its set, `width` values per node. Returns whether one fell.
  bool spread_lowest(std::vector<double> &values, int width)
  {
    const int n = (int) parent.size();
    bool fell = false;
    const auto at = [&](int k) {
      return values.data() + (size_t) width * k;
    };
    for (int k = 0; k < n; k++)
      if (parent[k] != k) fell = lower(at(root(k)), at(k), width) || fell;
    for (int k = 0; k < n; k++)
      if (parent[k] != k) fell = lower(at(k), at(parent[k]), width) || fell;
    return fell;
  }

  /// to = min(to, from), value by value. Returns whether one fell.
  static bool lower(double *to, const double *from, int width)
  {
    bool fell = false;
    for (int c = 0; c < width; c++)
      if (from[c] < to[c]) {
        to[c] = from[c];
        fell = true;
      }
    return fell;
  }

  double memory_usage() const { return bytes_of(parent); }

 private:
  std::vector<int> parent;
};

/// The bodies with atoms on this MPI rank. Those with atoms on other ranks too have a slot each:
/// sums over all ranks are computed per slot.
class Bodies {
 public:
  /// If more bodies have atoms on several ranks, some share a slot.
  static constexpr int MOST_SLOTS = 1024;

  /// Atoms first ... last-1 belong to that body, or to none.
  struct Run {
    int first, last;
    int body;
  };

  /// The label of atom i of n is labels[i * stride], NO_BODY or that of its body; `across` holds, in
  /// ascending order, the labels of all bodies with atoms on several ranks.
  void assign(const double *labels, int stride, int n, const std::vector<double> &across,
              int most_slots = MOST_SLOTS)
  {
    names.clear();
    double last = NO_BODY;
    for (int i = 0; i < n; i++) {
      const double label = labels[(size_t) stride * i];
      if (label != NO_BODY && label != last) names.push_back(last = label);
    }
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());

    numbers.resize(n);
    run_list.clear();
    for (int i = 0; i < n; i++) {
      const int body = numbers[i] = find(names, labels[(size_t) stride * i]);
      if (body < 0 || (!run_list.empty() && run_list.back().body == body)) continue;
      if (!run_list.empty()) run_list.back().last = i;
      run_list.push_back({run_list.empty() ? 0 : i, n, body});
    }

    const int64_t all = (int64_t) across.size();
    nslots = (int) std::min(all, (int64_t) most_slots);
    is_shared = all > nslots;
    slots.clear();
    for (const double name : names) {
      const int index = find(across, name);
      slots.push_back(index < 0 ? -1 : (int) (index * (int64_t) nslots / all));
    }
  }

  /// All atoms in runs; none where no atom belongs to a body.
  const std::vector<Run> &runs() const { return run_list; }

  /// Number of bodies with atoms on this rank.
  int count() const { return (int) names.size(); }

  /// Number of atoms on this rank, in a body or not.
  int atoms() const { return (int) numbers.size(); }

  /// The body of an atom, -1 where it belongs to none.
  int body_of(int i) const { return numbers[i]; }

  /// The slot of a body, -1 where no other rank has atoms of it.
  int slot_of(int body) const { return slots[body]; }

  /// Number of slots, the same on all ranks.
  int slot_count() const { return nslots; }

  /// Do several bodies share a slot?
  bool slots_are_shared() const { return is_shared; }

  double memory_usage() const { return bytes_of(names, numbers, slots, run_list); }

 private:
  std::vector<double> names;    // labels, ascending
  std::vector<int> numbers, slots;
  std::vector<Run> run_list;
  int nslots = 0;
  bool is_shared = false;

  static int find(const std::vector<double> &sorted, double value)
  {
    const auto found = std::lower_bound(sorted.begin(), sorted.end(), value);
    return found == sorted.end() || *found != value ? -1 : (int) (found - sorted.begin());
  }
};

}    // namespace EVP
