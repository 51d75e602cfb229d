/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/bonds: the records as data of atoms, which grow, move and change process with them. */

#include "fix_evp_bonds.h"

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

double FixEVPBonds::memory_usage()
{
  double bytes = (double) bonds.capacity() * sizeof(Bonds);
  bytes += (double) recorded_as.capacity() * sizeof(tagint);
  for (const Bonds &of_atom : bonds) bytes += (double) of_atom.capacity() * sizeof(Bond);
  return bytes;
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::grow_arrays(int nmax)
{
  recorded_as.resize(nmax, 0);
  bonds.resize(nmax);
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::copy_arrays(int i, int j, int /*delflag*/)
{
  if (i == j) return;
  recorded_as[j] = recorded_as[i];
  give_back_room(j, bonds[i].size());
  bonds[j] = bonds[i];
}

/* ----------------------------------------------------------------------
   atoms that come later have no bonds
------------------------------------------------------------------------- */

void FixEVPBonds::set_arrays(int i)
{
  recorded_as[i] = 0;
  bonds[i].clear();
  give_back_room(i, 0);
}

/* ----------------------------------------------------------------------
   the same words serve migration and restart: own ID, count, (partner, deq) ...
------------------------------------------------------------------------- */

int FixEVPBonds::pack_bonds(int i, double *buf) const
{
  int m = 0;
  buf[m++] = ubuf(recorded_as[i]).d;
  buf[m++] = ubuf((bigint) bonds[i].size()).d;
  for (const Bond &bond : bonds_of(i)) {
    buf[m++] = ubuf(bond.partner).d;
    buf[m++] = bond.deq;
  }
  return m;
}

/* ---------------------------------------------------------------------- */

int FixEVPBonds::unpack_bonds(int i, const double *buf)
{
  int m = 0;
  recorded_as[i] = (tagint) ubuf(buf[m++]).i;
  const auto count = (size_t) ubuf(buf[m++]).i;
  give_back_room(i, count);
  bonds[i].resize(count);
  for (Bond &bond : bonds[i]) {
    bond = {(tagint) ubuf(buf[m]).i, buf[m + 1]};
    m += 2;
  }
  make_room_for((int) bonds[i].size());
  return m;
}

/* ---------------------------------------------------------------------- */

int FixEVPBonds::pack_exchange(int i, double *buf)
{
  return pack_bonds(i, buf);
}

/* ---------------------------------------------------------------------- */

int FixEVPBonds::unpack_exchange(int nlocal, double *buf)
{
  return unpack_bonds(nlocal, buf);
}
