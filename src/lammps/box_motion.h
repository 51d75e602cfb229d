// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps_names.h"

#include "domain.h"
#include "lmptype.h"

#include <algorithm>
#include <array>

namespace EVP {

/// The edges of a periodic box, or what is linear in them, as LAMMPS orders them: xx yy zz yz xz xy.
using Edges = std::array<double, 6>;

/// How far a periodic image is from its atom, or how fast it moves with a box of these rates. pbc: that
/// of LAMMPS' communication.
inline std::array<double, 3> image_shift(const double *edges, const int *pbc)
{
  return {pbc[0] * edges[0] + pbc[5] * edges[5] + pbc[4] * edges[4],
          pbc[1] * edges[1] + pbc[3] * edges[3], pbc[2] * edges[2]};
}

/// Edges for which image_shift() is the number of boxes along each of them.
constexpr Edges COUNT_OF_BOXES = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};

/// How far the unwrapped position of an atom is away, in a box of these edges.
inline std::array<double, 3> unwrapping(const Edges &edges, imageint image)
{
  const int n[3] = {(int) (image & IMGMASK) - IMGMAX, (int) (image >> IMGBITS & IMGMASK) - IMGMAX,
                    (int) (image >> IMG2BITS) - IMGMAX};
  const int pbc[6] = {n[0], n[1], n[2], n[2], n[2], n[1]};
  return image_shift(edges.data(), pbc);
}

/// A box that deforms with 'remap v', from one force evaluation to the next.
struct MovingBox {
  Edges edges{}, rates{};    ///< at the present forces, the rates being those of LAMMPS
  Edges moved{};             ///< since the forces before

  /// At a set-up, or where the box is about to be that of the next forces.
  void go_on(const Domain *domain)
  {
    for (int c = 0; c < 6; c++) moved[c] = domain->h[c] - edges[c];
    std::copy_n(domain->h_rate, 6, rates.begin());
    note_flip(domain);
  }

  /// The same box with other edges: how these have moved is the same, too, as LAMMPS flips tilts only.
  void note_flip(const Domain *domain) { std::copy_n(domain->h, 6, edges.begin()); }
};

/// Of forces times counts of boxes, see PairWork::through.
inline double work_of(const Edges &through, const Edges &moved)
{
  double sum = 0.0;
  for (int c = 0; c < 6; c++) sum += through[c] * moved[c];
  return sum;
}

}    // namespace EVP
