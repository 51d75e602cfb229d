// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_GHOST_UPDATE_H
#define LMP_EVP_GHOST_UPDATE_H

#include "comm.h"
#include "pointers.h"

namespace LAMMPS_NS {

/// Brings velocities or positions of ghosts up to date, by the forward communication of a pair style,
/// which hands pack() and unpack() on.
class GhostUpdate : protected Pointers {
 public:
  GhostUpdate(LAMMPS *lmp, class Pair *style_in) : Pointers(lmp), style(style_in) {}

  /// Collective. Nothing to do with 'comm_modify vel yes', where LAMMPS has sent them already.
  void send_velocities()
  {
    if (!comm->ghost_velocity) comm->forward_comm(style);
  }

  /// Collective. As at every step of a run. False where LAMMPS does not know whose the ghosts are.
  bool send_positions();

  int pack(int n, const int *indices, double *buf, int pbc_flag, const int *pbc) const;
  void unpack(int n, int first, const double *buf);

 private:
  class Pair *style;
  bool positions = false;    // not velocities, are sent now
  int updated = 0;           // ghosts, by the last exchange of positions
};

}    // namespace LAMMPS_NS

#endif
