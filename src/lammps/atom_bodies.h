// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/contacts.h"
#include "core/per_atom_comm.h"
#include "lammps_names.h"

#include "atom.h"

#include <string>

namespace EVP {

/// The bodies of atoms and ghosts by their types or molecules, as these are now.
class AtomBodies {
 public:
  AtomBodies(const Atom *atom, BodyRule within) :
      type(within == BodyRule::TYPE ? atom->type : nullptr),
      molecule(within == BodyRule::MOLECULE ? atom->molecule : nullptr)
  {
  }

  /// Are two atoms of two bodies? One without a molecule, which has the ID 0, is of none.
  bool in_different_bodies(int i, int j) const
  {
    if (molecule) return molecule[i] != molecule[j] || molecule[i] == 0;
    return type && type[i] != type[j];
  }

 private:
  const int *type;           // nullptr where they do not matter
  const tagint *molecule;    // the same
};

/// What is missing where atoms and ghosts must have molecule IDs, with the remedy; empty if they have.
std::string missing_molecules(const LAMMPS *);

}    // namespace EVP
