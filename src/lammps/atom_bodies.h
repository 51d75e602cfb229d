// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_ATOM_BODIES_H
#define LMP_EVP_ATOM_BODIES_H

#include "core/within.h"

#include "atom.h"

#include <string>

namespace LAMMPS_NS {

/// The bodies of atoms and ghosts by their types or molecules, as these are now.
class AtomBodies {
 public:
  AtomBodies(const Atom *atom, EVP::Within within) :
      type(within == EVP::Within::TYPE ? atom->type : nullptr),
      molecule(within == EVP::Within::MOLECULE ? atom->molecule : nullptr)
  {
  }

  /// Are two atoms of two bodies? One without a molecule, which has the ID 0, is of none.
  bool apart(int i, int j) const
  {
    if (molecule) return molecule[i] != molecule[j] || molecule[i] == 0;
    return type && type[i] != type[j];
  }

 private:
  const int *type;           // nullptr where they do not matter
  const tagint *molecule;    // the same
};

/// What is missing where atoms and ghosts must have molecule IDs, with the remedy; empty if they have.
std::string missing_molecules(const class LAMMPS *);

}    // namespace LAMMPS_NS

#endif
