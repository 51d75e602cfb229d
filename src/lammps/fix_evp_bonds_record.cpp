/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/bonds: making the records, and which pairs of the zone they hold. Records are made aside: an error leaves the fix as it was. */

#include "fix_evp_bonds.h"

#include "atom_directory.h"
#include "bond_file_reader.h"
#include "collective_error.h"
#include "pair_evp_lj.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void FixEVPBonds::record()
{
  PairEVPLJ *pair = find_pair();
  const AtomDirectory directory(lmp);
  if (const tagint twice = directory.twice)
    error->all(FLERR,
               "Fix {} evp/bonds: atom ID {} is given twice: use 'reset_atoms id' or mend the data "
               "file",
               id, twice);
  std::vector<Bonds> made = file.empty() ? bonds_in_zone(pair) : bonds_in_file(pair, directory);
  stop_together(twice_given(made));

  int most_here = 0, most;
  bigint sides_here = 0, sides;
  tagint highest_here = 0, highest;
  for (int i = 0; i < atom->nlocal; i++) {
    highest_here = std::max(highest_here, atom->tag[i]);
    most_here = std::max(most_here, (int) made[i].size());
    sides_here += (bigint) made[i].size();
  }
  MPI_Allreduce(&most_here, &most, 1, MPI_INT, MPI_MAX, world);
  MPI_Allreduce(&sides_here, &sides, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  MPI_Allreduce(&highest_here, &highest, 1, MPI_LMP_TAGINT, MPI_MAX, world);

  // from here on nothing can fail
  for (int i = 0; i < atom->nlocal; i++) {
    recorded_as[i] = atom->tag[i];
    bonds[i].swap(made[i]);
  }
  make_room_for(most);
  highest_id = highest;
  nrecorded = sides / 2;
  recorded = true;
  const std::string dropped = pair->bonds_dropped_by();
  pair->bonds_recorded_by(id);

  if (comm->me) return;
  if (after_restart && file.empty())
    error->warning(FLERR,
                   "Fix {} evp/bonds takes the body as it is now for undeformed, though a restart "
                   "file was read: if that held records, give the fix the ID that it had",
                   id);
  if (!dropped.empty() && file.empty())
    error->warning(
        FLERR,
        "Fix {} evp/bonds takes the body as it is now for undeformed and free of stress: "
        "the bonds that fix {} had recorded are gone; to keep bonds use write_evp_bonds "
        "before unfix, and the keyword file",
        id, dropped);
  std::string source = "from file " + file;
  if (file.empty())
    source = zone > 0.0 ? fmt::format("within {} (R_i + R_j)", zone) : "within alpha (R_i + R_j)";
  utils::logmesg(lmp, "fix evp/bonds {}: recorded {} pairs {}, at most {} per atom\n", id,
                 nrecorded, source, most);
}

/* ----------------------------------------------------------------------
   the complaint of the first MPI rank that has one stops all, with its text
------------------------------------------------------------------------- */

void FixEVPBonds::stop_together(std::string complaint) const
{
  try {
    EVP::throw_together(complaint, world);
  } catch (const EVP::BadInput &bad) {
    error->all(FLERR, "Fix {} evp/bonds: {}", id, bad.what());
  }
}

std::vector<FixEVPBonds::Bonds> FixEVPBonds::bonds_in_file(const PairEVPLJ *pair,
                                                           const AtomDirectory &) const
{
  std::vector<Bonds> made(atom->nlocal);
  try {
    const auto bonds_read = EVP::read_bond_file(
        file, update->unit_style, atom, groupbit,
        [pair](int itype, int jtype) {
          return pair->alpha_of(itype, jtype);
        },
        world);
    for (size_t i = 0; i < made.size(); i++)
      for (const EVP::Bond &bond : bonds_read[i])
        made[i].push_back({(tagint) bond.partner, bond.deq});
  } catch (const EVP::BadInput &bad) {
    error->all(FLERR, "Fix {} evp/bonds: {}", id, bad.what());
  }
  return made;
}

/* ----------------------------------------------------------------------
   a partner that is there twice has two deq
------------------------------------------------------------------------- */

std::string FixEVPBonds::twice_given(const std::vector<Bonds> &made) const
{
  for (int i = 0; i < atom->nlocal; i++) {
    std::vector<tagint> partners;
    for (const Bond &bond : made[i]) partners.push_back(bond.partner);
    std::sort(partners.begin(), partners.end());
    const auto twice = std::adjacent_find(partners.begin(), partners.end());
    if (twice == partners.end()) continue;
    const tagint low = std::min(atom->tag[i], *twice), high = std::max(atom->tag[i], *twice);
    if (!file.empty()) return fmt::format("bond {} {} is given twice in file {}", low, high, file);
    return fmt::format("it meets atoms {} and {} in two periodic images: the box must be longer "
                       "than two cut-offs: reduce alpha, or enlarge the box: {}",
                       low, high, how_to_replicate());
  }
  return "";
}

/* ----------------------------------------------------------------------
   every pair of the zone with both atoms in the group, on both of its atoms
------------------------------------------------------------------------- */

std::vector<FixEVPBonds::Bonds> FixEVPBonds::bonds_in_zone(const PairEVPLJ *pair)
{
  neighbor->build_one(list);

  Nodal home((size_t) 3 * (atom->nlocal + atom->nghost));
  for (int i = 0; i < atom->nlocal; i++) std::copy_n(atom->x[i], 3, &home[(size_t) 3 * i]);
  to_ghosts(home);

  std::string complaint;
  std::vector<Bonds> made(atom->nlocal);
  const int *mask = atom->mask;
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (!(mask[i] & groupbit)) continue;
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      const int j = list->firstneigh[i][jj] & NEIGHMASK;
      const double alpha = pair->alpha_of(atom->type[i], atom->type[j]);
      if (!(mask[j] & groupbit) || alpha == 0.0) continue;

      const double dsq = symmetric_dsq(i, j, home);
      const double sum_radii = atom->radius[i] + atom->radius[j];
      const double reach = (zone > 0.0 ? zone : alpha) * sum_radii;
      if (dsq > EVP::reach_squared(reach, EVP::RECORD_MARGIN)) continue;
      const double coincident = EVP::COINCIDENT * sum_radii;
      if (!(dsq > coincident * coincident) && complaint.empty())
        complaint = fmt::format("atoms {} and {} coincide: move one or delete it (delete_atoms "
                                "overlap)",
                                atom->tag[i], atom->tag[j]);
      made[i].push_back({atom->tag[j], std::sqrt(dsq)});
    }
  }
  stop_together(complaint);
  return made;
}

/* ----------------------------------------------------------------------
   Square of the distance of a neighbor, from either side the same to the last bit, so that both atoms
   of a pair decide alike. The place of a ghost is that of its owner and whole periodic vectors, but for
   round-off, which differs between the images of i and of j.
   home: places of the owners
------------------------------------------------------------------------- */

double FixEVPBonds::symmetric_dsq(int i, int j, const Nodal &home) const
{
  const double *const at = &home[(size_t) 3 * i], *const other = &home[(size_t) 3 * j];
  double shift[3] = {0.0, 0.0, 0.0};
  if (j >= atom->nlocal) {
    for (int c = 0; c < 3; c++) shift[c] = atom->x[j][c] - other[c];
    const double nz = std::round(shift[2] / domain->zprd);
    const double ny = std::round((shift[1] - nz * domain->yz) / domain->yprd);
    const double nx = std::round((shift[0] - ny * domain->xy - nz * domain->xz) / domain->xprd);
    shift[0] = nx * domain->xprd + ny * domain->xy + nz * domain->xz;
    shift[1] = ny * domain->yprd + nz * domain->yz;
    shift[2] = nz * domain->zprd;
  }
  // the difference of the owners' places is the same number, but for its sign
  double dsq = 0.0;
  for (int c = 0; c < 3; c++) {
    const double d = (other[c] - at[c]) + shift[c];
    dsq += d * d;
  }
  return dsq;
}
