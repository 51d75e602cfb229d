// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/pairs.h"
#include "lammps_names.h"
#include "scene.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace EVP {

/// The pairs of atom types that pair style evp/lj handles, and how far these act: alpha (R_i + R_j) with
/// the largest radii at the start of a run, as the neighbor list ends there.
class Cutoffs : protected Pointers {
 public:
  explicit Cutoffs(LAMMPS *lmp) : Pointers(lmp) {}

  void set_types(int ntypes)
  {
    ntypes++;
    max_radius.assign(ntypes, 0.0);
    min_radius.assign(ntypes, 0.0);
    longest_of.assign((size_t) ntypes * ntypes, -1.0);
  }

  bool has_types() const { return !longest_of.empty(); }

  /// Collective. Takes the radii of the run to come; no pair of types is handled yet.
  void begin_run()
  {
    std::fill(longest_of.begin(), longest_of.end(), -1.0);
    std::fill(max_radius.begin(), max_radius.end(), 0.0);
    std::fill(min_radius.begin(), min_radius.end(), HUGE_VAL);
    for (int i = 0; i < atom->nlocal; i++) {
      double &largest = max_radius[atom->type[i]], &smallest = min_radius[atom->type[i]];
      const double radius = atom->radius[i];
      largest = std::max(largest, radius);
      smallest = std::min(smallest, std::isfinite(radius) ? radius : -HUGE_VAL);
    }
    const int ntypes = (int) max_radius.size();
    MPI_Allreduce(MPI_IN_PLACE, max_radius.data(), ntypes, MPI_DOUBLE, MPI_MAX, world);
    MPI_Allreduce(MPI_IN_PLACE, min_radius.data(), ntypes, MPI_DOUBLE, MPI_MIN, world);

    // particles to come
    for (Fix *fix : modify->get_fix_list())
      if (utils::strmatch(fix->style, "^pour") || utils::strmatch(fix->style, "^deposit"))
        for (int type = 1; type < ntypes; type++) {
          int itype = type;
          const auto *radius = (const double *) fix->extract("radius", itype);
          if (radius) max_radius[type] = std::max(max_radius[type], *radius);
        }
  }

  /// Returns the cutoff of a pair of types. Called at set-up, and again by fix adapt.
  double handle(int i, int j, double alpha)
  {
    const double smallest = std::min(min_radius[i], min_radius[j]);
    if (!(smallest > 0.0))
      error->all(
          FLERR,
          "Pair evp/lj needs particles with a radius above zero, and finite, found {} in types {} "
          "and {}: use 'set ... diameter'",
          smallest, i, j);
    const double cut = alpha * (max_radius[i] + max_radius[j]) * (1.0 + LIST_MARGIN);
    longest_of[index(i, j)] = cut;
    return cut;
  }

  /// pair_style hybrid may have given a pair of types with coefficients here to another sub-style.
  bool handles(int i, int j) const { return has_types() && longest_of[index(i, j)] >= 0.0; }

  /// Of all pairs of types [length].
  double longest() const
  {
    return has_types() ? *std::max_element(longest_of.begin(), longest_of.end()) : 0.0;
  }

  /// Stops where a radius is larger than those that the cutoffs were made for.
  void check_radii() const
  {
    for (int i = 0; i < atom->nlocal; i++)
      if (atom->radius[i] > max_radius[atom->type[i]] && handles(atom->type[i], atom->type[i]))
        error->one(
            FLERR,
            "Pair evp/lj: the radius of atom {} is {:.8g}, but the cutoff was set for at most "
            "{:.8g} in its type: radii must not grow past the largest at the start of the run; "
            "split the run there",
            atom->tag[i], atom->radius[i], max_radius[atom->type[i]]);
  }

 private:
  std::vector<double> max_radius, min_radius;    // per type
  std::vector<double> longest_of;                // [type][type], below 0 where not handled

  size_t index(int i, int j) const { return std::min(i, j) * max_radius.size() + std::max(i, j); }
};

}    // namespace EVP
