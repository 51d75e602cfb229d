// SPDX-License-Identifier: GPL-2.0-only
//
// Where atoms were one step ago, for those that are moved along a path.

#ifndef EVP_LAST_POSITIONS_H
#define EVP_LAST_POSITIONS_H

#include "core/memory.h"

#include "atom.h"
#include "domain.h"
#include "pointers.h"

#include <algorithm>
#include <vector>

namespace EVP {

/// The unwrapped positions of local atoms at the last solve, from which their mean velocity over the
/// step follows. The fix that owns it moves it with the atoms. Does nothing unless wanted.
class LastPositions : protected LAMMPS_NS::Pointers {
 public:
  explicit LastPositions(LAMMPS_NS::LAMMPS *lmp) : Pointers(lmp) {}

  bool wanted() const { return size > 0; }

  /// From now on. Returns the number of values per atom.
  int want()
  {
    size = 3;
    grow(atom->nmax);
    return size;
  }
  void forget() { known = false; }

  void remember()
  {
    for (int i = 0; i < atom->nlocal; i++) set(i);
    known = wanted();
  }

  /// f(i, component, mean velocity over the last step of size dt) for all local atoms, where known.
  template <class F> void for_each_mean_velocity(double dt, F &&f) const
  {
    if (!known) return;
    for (int i = 0; i < atom->nlocal; i++) {
      double x[3];
      domain->unmap(atom->x[i], atom->image[i], x);
      for (int c = 0; c < 3; c++) f(i, c, (x[c] - positions[(size_t) size * i + c]) / dt);
    }
  }

  // what the owner's functions for its arrays call; pack() and unpack() return the number of values
  void grow(int nmax) { positions.resize((size_t) size * nmax, 0.0); }
  void copy(int from, int to) { std::copy_n(at(from), size, at(to)); }
  void set(int i)
  {
    if (wanted()) domain->unmap(atom->x[i], atom->image[i], at(i));
  }
  int pack(int i, double *buf)
  {
    std::copy_n(at(i), size, buf);
    return size;
  }
  int unpack(int i, const double *buf)
  {
    std::copy_n(buf, size, at(i));
    return size;
  }

  double memory_usage() const { return bytes_of(positions); }

 private:
  int size = 0;    // values per atom
  bool known = false;
  std::vector<double> positions;

  double *at(int i) { return positions.data() + (size_t) size * i; }
};

}    // namespace EVP

#endif
