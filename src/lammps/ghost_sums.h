// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps_names.h"

#include "comm.h"
#include "force.h"
#include "pair.h"

#include <algorithm>
#include <vector>

namespace EVP {

/// Adds what ghosts hold to their owners, by the reverse communication of a pair style, which hands pack() and
/// unpack() on.
class GhostSums : protected Pointers {
 public:
  static constexpr int MOST = 6;    ///< values per atom: no more than LAMMPS sends of a sphere

  GhostSums(LAMMPS *lmp, Pair *style_in) : Pointers(lmp), style(style_in) {}

  /// Collective. So many values per atom and ghost. Nothing to do where ghosts take no reactions.
  void to_owners(std::vector<double> &values, int values_per_atom)
  {
    if (!force->newton_pair) return;
    summed = values.data();
    width = values_per_atom;
    comm->reverse_comm(style, width);
  }

  int pack(int n, int first, double *buf) const
  {
    std::copy_n(summed + (size_t) width * first, (size_t) width * n, buf);
    return width * n;
  }
  void unpack(int n, const int *indices, const double *buf) const
  {
    for (int k = 0; k < n; k++, buf += width)
      for (int c = 0; c < width; c++) summed[(size_t) width * indices[k] + c] += buf[c];
  }

 private:
  Pair *style;
  double *summed = nullptr;
  int width = 0;
};

}    // namespace EVP
