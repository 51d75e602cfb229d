// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_file.h"
#include "lammps/base/lammps_names.h"
#include "lammps/base/per_atom.h"

#include <string>
#include <utility>
#include <vector>

namespace EVP {

/// What to do where the two atoms of a bond could meet in two periodic images.
std::string remedy_of_images(const Fix *);

/// A recording of bonds for fix evp/bonds, made aside: where it fails, the store is as it was.
class BondRecording : protected Pointers {
 public:
  /// who: the fix, in messages. within: which atoms are one body, if that is given.
  BondRecording(LAMMPS *lmp, const Fix *fix_in, const std::string &who_in, BodyRule within_in) :
      Pointers(lmp), fix(fix_in), who(who_in), within(within_in)
  {
  }

  /// Collective. The pairs of a full neighbor list within zone (R_i + R_j), or within alpha where zone is 0. store: of a
  /// body that was recorded before: only pairs with an atom that nobody has looked at since. Throws BadInput on all MPI ranks.
  void record_zone(const NeighList *, double zone, const class PairData *, WithPerAtomComm<Fix> &,
                   const BondStore *store = nullptr);

  /// The same of the bonds of a file, which may say what within and zone are.
  void record_file(const std::string &name, const PairRules &);

  /// Collective. Cannot fail.
  void give_to(BondStore &);

  /// Collective. Adds the pairs of new atoms in the group to those that it has; takes: or leaves them loose. Pairs that are near and no
  /// bonds join only once they have been apart.
  void add_to(BondStore &, bool takes) const;

  /// What users should know of it once it was given. bodies_repel: each other.
  void report(const BondStore &, bool bodies_repel) const;

 private:
  const Fix *const fix;
  const std::string who;
  BodyRule within;
  double zone = 0.0;
  std::vector<BondStore::Bonds> made;                 // of each local atom
  std::vector<std::vector<Remembered>> remembered;    // of each local atom, from a file
  std::string columns;    // from a file: names of the values of spheres, and these, by local atom
  std::vector<std::pair<int, std::vector<double>>> spheres;
  BondCounts counts;                              // from a file
  JoinRule joins_by;                              // see BondStore
  std::vector<double> of_file;                    // measures of the bonds, as words; else empty
  std::string source;                             // for users
  std::vector<std::vector<Remembered>> inside;    // of each local atom, of those with a new one
  bigint overlaps = 0, loose = 0;    // pairs of two bodies; atoms of the group without a molecule
  double deepest = 0.0;              // of pairs of two bodies: overlap over R_i + R_j
  bigint special = 0;                // pairs that special_bonds keeps out of the neighbor list
  int64_t most = 0;                  // records of an atom

  std::string find_bond_twice(const std::string &file) const;
  void give_values(BondStore &) const;
  bigint count_special(const class PairData *) const;
};

/// Collective. The measures of the records of all MPI ranks. A bond whose partner was deleted counts for its atom, and
/// for no pair of types.
BondMeasures measure_bonds(LAMMPS *, const BondStore &);

}    // namespace EVP
