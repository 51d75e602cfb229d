// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law/coefficients.h"
#include "core/law/limit.h"
#include "lammps/base/lammps_names.h"

#include <algorithm>
#include <string>
#include <vector>

namespace EVP {

class BondStore;
class Effects;

/// The pairs of atom types that pair style evp/lj handles. Makes the laws of their rows for the body whose bonds were
/// measured, and tells users what the rows that name the bodies they hold for are multiplied by in this one. Keeps how
/// far pairs act: alpha (R_i + R_j) with the largest radii at the start of a run, as the neighbor list ends there.
class PairTypes : protected Pointers {
 public:
  PairTypes(LAMMPS *lmp, Coefficients &made) : Pointers(lmp), coefficients(made) {}

  /// Collective, at set-up: takes the radii and bonds of the run to come; bonds: nullptr without. No pair of types is
  /// handled yet.
  void begin_run(const BondStore *bonds);

  /// Makes both laws of two types and returns the row that they are of. plastic: the row of like types says how far the
  /// bonds of their spheres hold.
  Row make(int i, int j, bool plastic);

  /// With plasticity, of the spheres of a type. A type without a row of its own leaves it to its partners.
  const Limit &limit(int type) const { return limits[type]; }

  /// Returns the cutoff of a pair of types. Called at set-up, and again by fix adapt.
  double handle(int i, int j, double alpha);

  /// pair_style hybrid may have given a pair of types with coefficients here to another sub-style.
  bool handles(int i, int j) const { return has_types() && longest_of[index(i, j)] >= 0.0; }

  /// Cutoff of all pairs of types [length].
  double longest_cutoff() const
  {
    return has_types() ? *std::max_element(longest_of.begin(), longest_of.end()) : 0.0;
  }

  /// Stops where a radius is larger than those that the cutoffs were made for.
  void check_radii() const;

  /// At a packing: the bonds were recorded, or went, after the laws were made.
  /// Returns whether they were made anew.
  bool rescale_if_measures_changed(const BondStore *bonds, bool plastic);

  /// At the set-up of a run, again only when it changes. Warns where a row has a volume energy and there is no fix evp/volume.
  void report(bool plastic, const Effects &);

  /// What to say of keywords of rows that would change forces, but have no effect.
  std::string find_inactive_keywords(bool plastic, const Effects &) const;

  /// Collective. Stops where these bonds join types that had none when they were measured: types may have been set since.
  void check(const PairList &, const Effects &) const;

 private:
  Coefficients &coefficients;
  std::vector<double> max_radius, min_radius;    // per type
  std::vector<double> longest_of;                // [type][type], below 0 where not handled
  std::vector<Limit> limits;                     // per type
  std::string last_report, last_kv_warning, last_flow_report;

  bool has_types() const { return !longest_of.empty(); }
  size_t index(int i, int j) const { return std::min(i, j) * max_radius.size() + std::max(i, j); }
  bool set_measures(const BondStore *);
  template <class F> void stop_at_bad_row(int i, int j, F &&f) const;
  std::string describe(const Effects &) const;
  std::string describe(int i, int j, bool with_kv) const;
  std::string find_inactive_kv() const;
  void report_unlike_types();
};

/// Collective. The row that the words of a command give: FILE:ROW, or FILE and ROW, of a potential file, which is
/// looked for as LAMMPS does; or its numbers and keywords. Throws BadInput on all MPI ranks.
Row read_row(LAMMPS *, const std::vector<std::string> &words);

}    // namespace EVP
