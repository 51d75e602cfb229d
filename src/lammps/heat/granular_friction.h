// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/pairs/pairs.h"
#include "lammps/base/lammps_names.h"

#include <vector>

namespace LAMMPS_NS {
class FixNeighHistory;
}    // namespace LAMMPS_NS

namespace EVP {

/// The power of the tangential forces of granular pair styles, of those whose single() has these forces.
class GranularFriction : protected Pointers {
 public:
  static constexpr int WIDTH = 6;    ///< values per atom that it sends to ghosts

  GranularFriction(LAMMPS *lmp, PerAtomComm &exchange_in) : Pointers(lmp), exchange(exchange_in) {}

  /// Two spheres that rub: the tangential force on i, where it acts, what it takes.
  struct Contact {
    int i, j;
    Vector force, along;
    double arm_i, arm_j;
    double power;    ///< at the velocities at the end of the step [energy/time]
  };

  void find_styles();
  /// Those that act now.
  void find_forces();
  /// Collective. Of the forces that were found last.
  void find_powers();
  const std::vector<Contact> &contacts() const { return pairs; }

  double memory_usage() const { return bytes_of(pairs, moving); }

 private:
  /// memory: where the style keeps what its pairs remember; nullptr where they do not.
  struct Style {
    Pair *pair;
    FixNeighHistory *memory;
    bool shortens_arms;    // is the point of contact within the overlap?
  };

  PerAtomComm &exchange;
  std::vector<Style> styles;
  std::vector<Contact> pairs;
  std::vector<double> remembered;    // of a pair
  AtomValues moving{WIDTH};          // velocities and rates of rotation of atoms and ghosts
};

}    // namespace EVP
