/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/bonds: restart files. They carry no check of their own, and a changed bit is another
   material: every section of ours ends with a checksum. */

#include "fix_evp_bonds.h"

#include "core/checksum.h"

#include "atom.h"
#include "comm.h"
#include "error.h"

#include <cstring>

using namespace LAMMPS_NS;

static constexpr double FORMAT = 1001.0;    // of the words that follow; no zone is that large

/* ---------------------------------------------------------------------- */

void FixEVPBonds::write_restart(FILE *fp)
{
  double state[] = {FORMAT, zone, recorded ? 1.0 : 0.0, (double) nrecorded, (double) highest_id,
                    0.0};
  state[5] = EVP::checksum(state, 5);
  const int size = sizeof(state);
  if (comm->me == 0) {
    fwrite(&size, sizeof(int), 1, fp);
    fwrite(state, size, 1, fp);
  }
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::restart(char *buf)
{
  double state[6];
  memcpy(state, buf, sizeof(double));
  if (state[0] == FORMAT) memcpy(state, buf, sizeof(state));
  if (state[0] != FORMAT || state[5] != EVP::checksum(state, 5))
    error->all(FLERR,
               "Fix {} evp/bonds: its section of the restart file is damaged, or from a version of "
               "this package that wrote another format",
               id);
  after_restart = false;    // this is the fix that the file knows
  recorded = state[2] != 0.0;
  nrecorded = (bigint) state[3];
  highest_id = (tagint) state[4];
  if (recorded && comm->me == 0 && (!file.empty() || (zone > 0.0 && zone != state[1])))
    utils::logmesg(
        lmp,
        "fix evp/bonds {}: the bonds come from the restart file, not from the zone or file "
        "given here\n",
        id);
  zone = state[1];
  records_due = recorded && nrecorded > 0;
}

/* ---------------------------------------------------------------------- */

int FixEVPBonds::pack_restart(int i, double *buf)
{
  // the first word is read as a plain number by every fix that skips this record
  const int n = 1 + pack_bonds(i, buf + 1);
  buf[0] = n + 1;
  buf[n] = EVP::checksum(buf, n);
  return n + 1;
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::unpack_restart(int nlocal, int nth)
{
  const double *extra = atom->extra[nlocal];
  const int stored = atom->nextra_store;
  int m = 0, size = 0;
  bool whole = true;
  for (int k = 0; whole && k <= nth; k++) {
    m += size;
    whole = m < stored && extra[m] >= 1.0 && extra[m] <= stored - m;
    size = whole ? (int) extra[m] : 0;
  }
  if (!whole || size < 4 || extra[m + size - 1] != EVP::checksum(extra + m, size - 1))
    error->one(
        FLERR,
        "Fix {} evp/bonds: the bonds of atom {} in the restart file are damaged, or the atom "
        "is not from that file: define the fix right after read_restart",
        id, atom->tag[nlocal]);
  unpack_bonds(nlocal, extra + m + 1);
  // LAMMPS keeps what it read in the order of that moment
  if (recorded_as[nlocal] && recorded_as[nlocal] != atom->tag[nlocal]) restored_late = true;
  records_due = false;
}

/* ----------------------------------------------------------------------
   after the section of the fix, those of the atoms must have been there too
------------------------------------------------------------------------- */

void FixEVPBonds::check_restored()
{
  int due = records_due, due_everywhere;
  MPI_Allreduce(&due, &due_everywhere, 1, MPI_INT, MPI_MIN, world);
  if (due_everywhere)
    error->all(
        FLERR,
        "Fix {} evp/bonds: the restart file is damaged, it announces {} bonds and holds none", id,
        nrecorded);
  records_due = false;
}

/* ---------------------------------------------------------------------- */

int FixEVPBonds::size_restart(int i)
{
  return 4 + 2 * (int) bonds[i].size();
}

/* ---------------------------------------------------------------------- */

int FixEVPBonds::maxsize_restart()
{
  return 4 + 2 * most_bonds;
}
