// SPDX-License-Identifier: GPL-2.0-only
//
// Where atoms were one step ago, for those that are moved along a path.

#ifndef EVP_LAST_POSITIONS_H
#define EVP_LAST_POSITIONS_H

#include "core/bytes.h"

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
  static constexpr int SIZE = 3;    ///< values per atom

  explicit LastPositions(LAMMPS_NS::LAMMPS *lmp) : Pointers(lmp) {}

  bool wanted() const { return is_wanted; }
  void want()
  {
    is_wanted = true;
    grow(atom->nmax);
  }
  void forget() { known = false; }

  void remember()
  {
    if (!is_wanted) return;
    for (int i = 0; i < atom->nlocal; i++) set(i);
    known = true;
  }

  /// f(i, component, mean velocity over the last step of size dt) for all local atoms, where known.
  template <class F> void for_each_mean_velocity(double dt, F &&f) const
  {
    if (!is_wanted || !known) return;
    for (int i = 0; i < atom->nlocal; i++) {
      double x[3];
      domain->unmap(atom->x[i], atom->image[i], x);
      for (int c = 0; c < 3; c++) f(i, c, (x[c] - positions[(size_t) SIZE * i + c]) / dt);
    }
  }

  // what the owner's functions of the same kind call; pack() and unpack() return the number of values
  void grow(int nmax)
  {
    if (is_wanted) positions.resize((size_t) SIZE * nmax, 0.0);
  }
  void copy(int from, int to)
  {
    if (is_wanted) std::copy_n(at(from), SIZE, at(to));
  }
  void set(int i)
  {
    if (is_wanted) domain->unmap(atom->x[i], atom->image[i], at(i));
  }
  int pack(int i, double *buf)
  {
    if (is_wanted) std::copy_n(at(i), SIZE, buf);
    return is_wanted ? SIZE : 0;
  }
  int unpack(int i, const double *buf)
  {
    if (is_wanted) std::copy_n(buf, SIZE, at(i));
    return is_wanted ? SIZE : 0;
  }

  double memory_usage() const { return bytes_of(positions); }

 private:
  bool is_wanted = false, known = false;
  std::vector<double> positions;

  double *at(int i) { return positions.data() + (size_t) SIZE * i; }
};

}    // namespace EVP

#endif
