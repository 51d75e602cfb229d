// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "box_motion.h"
#include "collective.h"
#include "lammps_names.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "pair.h"

#include <algorithm>

namespace EVP {

/// Brings velocities or positions of ghosts up to date, by the forward communication of a pair style,
/// which hands pack() and unpack() on.
class GhostUpdate : protected Pointers {
 public:
  GhostUpdate(LAMMPS *lmp, Pair *style_in) : Pointers(lmp), style(style_in) {}

  /// Collective. Nothing to do with 'comm_modify vel yes', where LAMMPS has sent them already.
  void send_velocities()
  {
    if (!comm->ghost_velocity) comm->forward_comm(style);
  }

  /// Collective. As at every step of a run. False where LAMMPS does not know whose the ghosts are.
  bool send_positions()
  {
    updated = 0;
    positions = true;
    comm->forward_comm(style);
    positions = false;
    return on_all(updated == atom->nghost, world);
  }

  /// Periodic images are a box away, and move with a box that deforms with 'remap v'.
  int pack(int n, const int *indices, double *buf, int pbc_flag, const int *pbc) const
  {
    std::array<double, 3> image{};
    const bool moves = !positions && domain->deform_vremap;
    if (pbc_flag && (positions || moves)) {
      const double size[6] = {domain->xprd, domain->yprd, domain->zprd,
                              domain->yz,   domain->xz,   domain->xy};
      image = image_shift(moves ? domain->h_rate : size, pbc);
    }
    double **values = positions ? atom->x : atom->v;
    for (int k = 0; k < n; k++) {
      const int i = indices[k];
      const bool with_image = pbc_flag && (!moves || (atom->mask[i] & domain->deform_groupbit));
      for (int c = 0; c < 3; c++) buf[3 * k + c] = values[i][c] + (with_image ? image[c] : 0.0);
    }
    return 3 * n;
  }
  void unpack(int n, int first, const double *buf)
  {
    if (n == 0) return;
    std::copy_n(buf, (size_t) 3 * n, positions ? atom->x[first] : atom->v[first]);
    if (positions) updated += n;
  }

 private:
  Pair *style;
  bool positions = false;    // not velocities, are sent now
  int updated = 0;           // ghosts, by the last exchange of positions
};

}    // namespace EVP
