// SPDX-License-Identifier: GPL-2.0-only
//
// What spheres keep for fix evp/volume.
#pragma once

#include "core/bonds/sphere_table.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace EVP {

/// The density of the neighbors of a particle, rho = sum t^2 with t = 1 - d/dlim over the pairs within
/// dlim, and how it falls with a volume strain that is the same everywhere, G = 1/3 sum 2 t d/dlim.
struct NeighborDensity {
  double rho, slope;

  void add(double d, double dlim)
  {
    const double t = std::max(0.0, 1.0 - d / dlim);
    rho += t * t;
    slope += 2.0 / 3.0 * t * d / dlim;
  }
};

/// What of a particle is known at rest, by its bonds.
struct VolumeReference {
  NeighborDensity own;
  double gap;           ///< by how much its density is below the mean of the interior, else 0
  double torn;          ///< bits: see Torn
  double lost = 0.0;    ///< what pairs that pull no more have added to the gap of new pairs

  enum Torn {
    BROKEN = 1,    ///< bonds have broken here: its new pairs do not pull on it
    OPEN = 2       ///< by its strain, where bonds flow: its new pairs do not pull, on either atom
  };
  bool is_torn() const { return ((int) torn & (BROKEN | OPEN)) != 0; }
  bool is(Torn bit) const { return ((int) torn & bit) != 0; }
  void set(Torn bit, bool on = true) { torn = on ? (int) torn | bit : (int) torn & ~bit; }
};

/// What a sphere keeps for fix evp/volume. All 0 where it has no bond.
struct VolumeRecord {
  VolumeReference reference;    ///< as of when the bonds were first seen, less those that have left
  NeighborDensity at_rest;      ///< of the bonds that have not, at their deq of now
  /// Counts the times that references were set, of this one from 1; 0 without. A bond counts for a sphere if its partner
  /// was there at that time: one that comes later changes nothing of it.
  double batch = 0.0;
  double strain = 0.0;    ///< by the forces of the last step, with plasticity

  bool is_known() const { return batch > 0.0; }

  static constexpr const char *NAME = "volume";
  static constexpr unsigned NEEDS =
      ALL_SPHERES | JOINED_BONDS;    // gaps are to the mean of the body
  static constexpr SphereValue TABLE[] = {
      {"rho0", "1", BY_BONDS, Range::ANY, false},
      {"G", "1", BY_BONDS, Range::NOT_NEGATIVE, false},
      {"gap", "1", BY_BONDS, Range::ANY, false},
      {"torn", "1", 0.0, Range::COUNT, false},
      {"lost", "1", 0.0, Range::ANY, false},
      {"rho0_of_bonds", "1", BY_BONDS, Range::NOT_IN_FILES, false},
      {"G_of_bonds", "1", BY_BONDS, Range::NOT_IN_FILES, false},
      {"batch", "1", 0.0, Range::BATCH, false},
      {"volume_strain", "1", BY_BONDS, Range::ANY, false}};
};
inline const bool has_volume_table = add_table<VolumeRecord>();

/// What the references were set for. Empty where they have not been set.
struct VolumeScene {
  std::vector<double>
      relative_cutoffs;    ///< of pairs of types, i <= j: dlim, or the zone, over R_i + R_j
  /// Rules by which pairs are kept out of the neighbor list: kind, two numbers and one.
  using Exclusion = std::array<double, 3>;
  std::vector<Exclusion> exclusions = {};    ///< in ascending order

  // among the words of the BondStore

  std::vector<double> words() const
  {
    std::vector<double> words = {(double) relative_cutoffs.size()};
    words.insert(words.end(), relative_cutoffs.begin(), relative_cutoffs.end());
    for (const Exclusion &one : exclusions) words.insert(words.end(), one.begin(), one.end());
    return words;
  }
  static VolumeScene of_words(const std::vector<double> &words)
  {
    if (words.empty()) return {};
    auto at = words.begin() + 1 + (std::ptrdiff_t) words[0];
    VolumeScene scene = {{words.begin() + 1, at}};
    for (Exclusion one; at != words.end(); scene.exclusions.push_back(one))
      for (double &number : one) number = *at++;
    return scene;
  }
};

}    // namespace EVP
