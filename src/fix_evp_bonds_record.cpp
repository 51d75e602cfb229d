/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/bonds: making the records, from the zone or from a file. */

#include "fix_evp_bonds.h"

#include "lammps_compat.h"
#include "pair_evp_lj.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <memory>

using namespace LAMMPS_NS;

static constexpr int LINES_PER_MESSAGE = 10000;

void FixEVPBonds::record()
{
  PairEVPLJ *pair = find_pair();
  check_unique_ids();
  if (file.empty())
    record_zone(pair);
  else
    record_file(pair);
  check_unique();

  int most_here = 0, most;
  bigint sides_here = 0, sides;
  tagint highest_here = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    recorded_as[i] = atom->tag[i];
    highest_here = std::max(highest_here, atom->tag[i]);
    most_here = std::max(most_here, (int) bonds[i].size());
    sides_here += (bigint) bonds[i].size();
  }
  MPI_Allreduce(&most_here, &most, 1, MPI_INT, MPI_MAX, world);
  MPI_Allreduce(&sides_here, &sides, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  MPI_Allreduce(&highest_here, &highest_id, 1, MPI_LMP_TAGINT, MPI_MAX, world);
  make_room_for(most);
  nrecorded = sides / 2;
  recorded = true;
  pair->bonds_recorded_by(id);

  if (comm->me) return;
  if (after_restart && file.empty())
    error->warning(FLERR,
                   "Fix {} evp/bonds takes the body as it is now for undeformed, though a restart "
                   "file was read: if that held records, give the fix the ID that it had",
                   id);
  std::string source = "from file " + file;
  if (file.empty())
    source = zone > 0.0 ? fmt::format("within {} (R_i + R_j)", zone) : "within alpha (R_i + R_j)";
  utils::logmesg(lmp, "fix evp/bonds {}: recorded {} pairs {}, at most {} per atom\n", id,
                 nrecorded, source, most);
}

/* ----------------------------------------------------------------------
   a partner that is there twice has two deq
------------------------------------------------------------------------- */

void FixEVPBonds::check_unique() const
{
  for (int i = 0; i < atom->nlocal; i++) {
    const Bonds sorted = sorted_bonds_of(i);
    const auto twice =
        std::adjacent_find(sorted.begin(), sorted.end(), [](const Bond &a, const Bond &b) {
          return a.partner == b.partner;
        });
    if (twice == sorted.end()) continue;
    const tagint low = std::min(atom->tag[i], twice->partner);
    const tagint high = std::max(atom->tag[i], twice->partner);
    if (!file.empty())
      error->one(FLERR, "Fix {} evp/bonds: bond {} {} of file {} is given twice", id, low, high,
                 file);
    error->one(FLERR,
               "Fix {} evp/bonds meets atoms {} and {} in two periodic images: the box must be "
               "longer than two zones, enlarge it (replicate) or reduce the zone",
               id, low, high);
  }
}

/* ----------------------------------------------------------------------
   one bit for each ID, set where an atom has it
------------------------------------------------------------------------- */

std::vector<unsigned char> FixEVPBonds::present_ids() const
{
  tagint highest_here = 0, highest;
  for (int i = 0; i < atom->nlocal; i++) highest_here = std::max(highest_here, atom->tag[i]);
  MPI_Allreduce(&highest_here, &highest, 1, MPI_LMP_TAGINT, MPI_MAX, world);
  if (highest / 8 >= MAXSMALLINT)
    error->all(FLERR, "Fix {} evp/bonds: the ID {} is too large: use reset_atoms id first", id,
               highest);

  std::vector<unsigned char> present(highest / 8 + 1, 0);
  for (int i = 0; i < atom->nlocal; i++) present[atom->tag[i] / 8] |= 1 << (atom->tag[i] % 8);
  EVP::compat::or_bits(present, world);
  return present;
}

/* ----------------------------------------------------------------------
   LAMMPS takes data files with an ID twice, whose bonds nobody could tell apart
------------------------------------------------------------------------- */

void FixEVPBonds::check_unique_ids() const
{
  bigint atoms_here = atom->nlocal, atoms, ids = 0;
  MPI_Allreduce(&atoms_here, &atoms, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  for (unsigned char byte : present_ids())
    for (; byte; byte &= byte - 1) ids++;
  if (ids != atoms)
    error->all(FLERR,
               "Fix {} evp/bonds: {} atoms have {} different IDs: an ID is given twice, use "
               "'reset_atoms id' or mend the data file",
               id, atoms, ids);
}

/* ----------------------------------------------------------------------
   every pair of the zone with both atoms in the group, on both of its atoms
------------------------------------------------------------------------- */

void FixEVPBonds::record_zone(const PairEVPLJ *pair)
{
  if (!list->occasional)    // the request is spelled in numbers, see lammps_compat.h
    error->all(FLERR, "Fix {} evp/bonds got another neighbor list than it asked for", id);
  neighbor->build_one(list);

  double **x = atom->x;
  const int *mask = atom->mask;
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (!(mask[i] & groupbit)) continue;
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      const int j = list->firstneigh[i][jj] & NEIGHMASK;
      const double alpha = pair->alpha_of(atom->type[i], atom->type[j]);
      if (!(mask[j] & groupbit) || alpha == 0.0) continue;

      const double dx = x[i][0] - x[j][0], dy = x[i][1] - x[j][1], dz = x[i][2] - x[j][2];
      const double dsq = dx * dx + dy * dy + dz * dz;
      const double reach = (zone > 0.0 ? zone : alpha) * (atom->radius[i] + atom->radius[j]);
      if (dsq > reach * reach) continue;
      if (!(dsq > 0.0))
        error->one(FLERR,
                   "Fix {} evp/bonds: atoms {} and {} are at one point: move one or delete it "
                   "(delete_atoms overlap)",
                   id, atom->tag[i], atom->tag[j]);
      bonds[i].push_back({atom->tag[j], std::sqrt(dsq)});
    }
  }
}

/* ----------------------------------------------------------------------
   the first process reads and checks the text, in pieces; all stop together
------------------------------------------------------------------------- */

void FixEVPBonds::record_file(const PairEVPLJ *pair)
{
  FILE *fp = nullptr;
  std::unique_ptr<EVP::BondReader> reader;
  std::string complaint;
  if (comm->me == 0) {
    fp = fopen(file.c_str(), "rb");
    if (!fp) complaint = "cannot read the bond file '" + file + "': give its path";
    try {
      if (fp) reader = std::make_unique<EVP::BondReader>(fp, file, update->unit_style);
    } catch (const EVP::BadInput &bad) {
      complaint = bad.what();
    }
  }
  stop_together(complaint);

  std::vector<EVP::BondLine> lines;
  for (int more = 1; more;) {
    lines.clear();
    if (comm->me == 0) {
      try {
        more = reader->read(lines, LINES_PER_MESSAGE);
      } catch (const EVP::BadInput &bad) {
        complaint = bad.what();
      }
    }
    stop_together(complaint);
    MPI_Bcast(&more, 1, MPI_INT, 0, world);
    int count = (int) lines.size();
    MPI_Bcast(&count, 1, MPI_INT, 0, world);
    lines.resize(count);
    MPI_Bcast(lines.data(), count * (int) sizeof(EVP::BondLine), MPI_BYTE, 0, world);
    add_lines(pair, lines);
  }
  if (fp) fclose(fp);
}

/* ----------------------------------------------------------------------
   what the first process has to complain of stops all, with its text
------------------------------------------------------------------------- */

void FixEVPBonds::stop_together(std::string complaint) const
{
  int length = (int) complaint.size();
  MPI_Bcast(&length, 1, MPI_INT, 0, world);
  if (length == 0) return;
  complaint.resize(length);
  MPI_Bcast(&complaint[0], length, MPI_CHAR, 0, world);
  error->all(FLERR, "Fix {} evp/bonds: {}", id, complaint);
}

/* ----------------------------------------------------------------------
   the owners say what the named atoms are, all check, the owners store
------------------------------------------------------------------------- */

void FixEVPBonds::add_lines(const PairEVPLJ *pair, const std::vector<EVP::BondLine> &lines)
{
  struct Named {
    double radius, type, in_group;    // 0 where the atom is not here
  };
  std::vector<Named> here(2 * lines.size(), Named{0.0, 0.0, 0.0}), named(here.size());
  const auto owned = [this](int64_t atom_id) {
    // the map is an array without a check of its own
    const int i = atom_id > atom->map_tag_max ? -1 : atom->map((tagint) atom_id);
    return i < atom->nlocal ? i : -1;
  };
  for (size_t k = 0; k < here.size(); k++) {
    const int i = owned(k % 2 ? lines[k / 2].id_j : lines[k / 2].id_i);
    if (i >= 0)
      here[k] = {atom->radius[i], (double) atom->type[i], atom->mask[i] & groupbit ? 1.0 : 0.0};
  }
  MPI_Allreduce(here.data(), named.data(), 3 * (int) here.size(), MPI_DOUBLE, MPI_MAX, world);

  for (size_t k = 0; k < lines.size(); k++) {
    const EVP::BondLine &line = lines[k];
    const Named &a = named[2 * k], &b = named[2 * k + 1];
    const std::string bond = fmt::format("bond {} {} of file {}", line.id_i, line.id_j, file);
    if (a.type == 0.0 || b.type == 0.0)
      error->all(FLERR,
                 "Fix {} evp/bonds: {}: there is no atom {}; read the data file that was "
                 "written with the bond file",
                 id, bond, a.type == 0.0 ? line.id_i : line.id_j);
    if (a.in_group == 0.0 || b.in_group == 0.0)
      error->all(FLERR, "Fix {} evp/bonds: {}: atom {} is not in the fix's group", id, bond,
                 a.in_group == 0.0 ? line.id_i : line.id_j);
    const double dlim = pair->alpha_of((int) a.type, (int) b.type) * (a.radius + b.radius);
    if (line.deq > dlim * (1.0 + 1e-9))
      error->all(FLERR,
                 "Fix {} evp/bonds: {}: deq = {} is beyond the pair's dlim = alpha (R_i + R_j) "
                 "= {}, which the neighbor list does not reach: raise alpha, or leave the bond out",
                 id, bond, line.deq, dlim);

    for (int side = 0; side < 2; side++) {
      const int i = owned(side ? line.id_j : line.id_i);
      const auto partner = (tagint) (side ? line.id_i : line.id_j);
      if (i >= 0) bonds[i].push_back({partner, line.deq});
    }
  }
}
