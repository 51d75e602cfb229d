/* SPDX-License-Identifier: GPL-2.0-only

   Where atoms were one step ago, for those that are moved along a path. */

#ifndef EVP_MOVER_PLACES_H
#define EVP_MOVER_PLACES_H

#include "atom.h"
#include "domain.h"

#include <algorithm>
#include <vector>

namespace EVP {

/// The unwrapped places of local atoms at the last solve, from which the velocity over the step follows.
/// The fix that owns it moves it with the atoms. Empty unless wanted.
class MoverPlaces {
 public:
  static constexpr int SIZE = 3;    ///< values per atom
  using Atom = LAMMPS_NS::Atom;
  using Domain = LAMMPS_NS::Domain;

  bool wanted() const { return is_wanted; }
  void want() { is_wanted = true; }
  void forget() { known = false; }

  void grow(int nmax) { places.resize((size_t) SIZE * nmax, 0.0); }
  void copy(int from, int to) { std::copy_n(at(from), SIZE, at(to)); }
  void pack(int i, double *buf) const { std::copy_n(at(i), SIZE, buf); }
  void unpack(int i, const double *buf) { std::copy_n(buf, SIZE, at(i)); }

  void set(Atom *atom, Domain *domain, int i) { domain->unmap(atom->x[i], atom->image[i], at(i)); }
  void remember(Atom *atom, Domain *domain)
  {
    if (!is_wanted) return;
    for (int i = 0; i < atom->nlocal; i++) set(atom, domain, i);
    known = true;
  }

  /// f(i, component, mean velocity over the last step of size dt) for all local atoms, where known.
  template <class F> void for_each_before(Atom *atom, Domain *domain, double dt, F &&f) const
  {
    if (!is_wanted || !known) return;
    for (int i = 0; i < atom->nlocal; i++) {
      double x[3];
      domain->unmap(atom->x[i], atom->image[i], x);
      for (int c = 0; c < 3; c++) f(i, c, (x[c] - at(i)[c]) / dt);
    }
  }

  double memory_usage() const { return (double) places.capacity() * sizeof(double); }

 private:
  bool is_wanted = false, known = false;
  std::vector<double> places;

  double *at(int i) { return places.data() + (size_t) SIZE * i; }
  const double *at(int i) const { return places.data() + (size_t) SIZE * i; }
};

}    // namespace EVP

#endif
