// SPDX-License-Identifier: GPL-2.0-only
//
// What styles keep in restart files, of which LAMMPS checks nothing: each part ends with a seal.
#pragma once

#include "core/base/seal.h"
#include "lammps/base/lammps_names.h"

#include "atom.h"
#include "error.h"

#include <cstdio>
#include <string>
#include <vector>

namespace EVP::restart_file {

/// On the first MPI rank: writes the section of a fix as LAMMPS reads it, its size and its words.
inline void write_section(FILE *fp, const std::vector<double> &words)
{
  const int size = (int) (words.size() * sizeof(double));
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(words.data(), size, 1, fp);
}

/// The nth record of an atom that a restart file brought: its number of words, the words, their seal. nullptr where it is missing
/// or damaged.
inline double *find_record(const Atom *atom, int i, int nth)
{
  double *record = atom->extra[i], *const end = record + atom->nextra_store;
  const auto fits = [&] {
    return record < end && record[0] >= 1.0 && record[0] <= (double) (end - record);
  };
  for (int k = 0; k < nth && fits(); k++) record += (int) record[0];
  return fits() && is_sealed(record, (size_t) record[0]) ? record : nullptr;
}

/// Stops where a section is damaged; what: 'WHO: its section of the restart file is damaged'.
[[noreturn]] inline void stop_at_damaged_section(Error *error, const std::string &what)
{
  error->all(FLERR,
             "{}, or from a version of this package that wrote another format: use an older "
             "restart file, or that version",
             what);
}

/// Stops where the record of an atom is damaged; what: 'WHO: the bonds of atom ID in the restart file are damaged'.
[[noreturn]] inline void stop_at_damaged_record(Error *error, const std::string &what)
{
  error->one(FLERR,
             "{}, or the atom is not from that file: define the fix right after read_restart",
             what);
}

}    // namespace EVP::restart_file
