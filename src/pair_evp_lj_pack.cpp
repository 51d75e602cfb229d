/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: from LAMMPS' neighbor list and the records to the list of the time-step loop. */

#include "pair_evp_lj.h"

#include "fix_evp_bonds.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "neigh_list.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

/* ----------------------------------------------------------------------
   from the neighbor list and the records to the list of the time-step loop,
   in time linear in the neighbors: the partners of i are marked at their
   index, then each neighbor looks whether it is marked
------------------------------------------------------------------------- */

void PairEVPLJ::pack()
{
  check_radii();
  if (bonds) check_bonds();

  const int nall = atom->nlocal + atom->nghost;
  packed.clear();
  packed.nlocal = atom->nlocal;
  packed.nall = nall;
  repack = false;
  explicit_damping = false;

  size_t neighbors = 0;
  for (int ii = 0; ii < list->inum; ii++) neighbors += list->numneigh[list->ilist[ii]];
  packed.pairs.reserve(neighbors);

  // Periodic images share a tag: all of them stand for the one index that the map knows, and have
  // its deq; check_bonds() sees to it that no two of them can be within dlim.
  if (bonds) {
    canonical.resize(nall);
    for (int j = 0; j < nall; j++) canonical[j] = atom->map(atom->tag[j]);
    mark.assign(nall, -1);
    mark_deq.resize(nall);
  }

  Overlaps overlaps;
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (bonds)
      for (const auto &bond : bonds->bonds_of(i)) {
        // the map is an array without a check of its own, and a deleted partner may be beyond its end
        const int m = bond.partner > atom->map_tag_max ? -1 : atom->map(bond.partner);
        if (m < 0) continue;    // out of sight, hence beyond every cut-off
        mark[m] = i;
        mark_deq[m] = bond.deq;
      }

    const int first = (int) packed.pairs.size();
    for (int jj = 0; jj < list->numneigh[i]; jj++) pack_pair(i, list->firstneigh[i][jj], overlaps);
    const int last = (int) packed.pairs.size();
    if (last > first) packed.rows.push_back({i, first, last});
  }

  find_block_law();

  if (!overlap_warned) warn_of_overlaps(overlaps);
}

/* ----------------------------------------------------------------------
   the laws of the pairs of types that this style serves, where they differ.
   Those of implicit pairs differ in gamma, which matters only beside explicit ones
------------------------------------------------------------------------- */

void PairEVPLJ::find_block_law()
{
  std::vector<int> used;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j]) used.push_back(law_index(i, j));

  const bool mixed = explicit_damping && implicit_groupbit;
  bool alike = !mixed;
  for (const int k : used) alike = alike && laws[k].parameters() == laws[used[0]].parameters();
  if (alike && !used.empty()) used.resize(1);
  if (mixed)
    for (int k = (int) used.size() - 1; k >= 0; k--) used.push_back(nlaws() + used[k]);
  block_law.assign(laws, used);
}

/* ----------------------------------------------------------------------
   once per run, by the first process
------------------------------------------------------------------------- */

void PairEVPLJ::warn_of_overlaps(Overlaps overlaps)
{
  bigint count;
  MPI_Allreduce(&overlaps.count, &count, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (count == 0) return;
  overlap_warned = true;

  int owner = overlaps.count ? comm->me : comm->nprocs, first;
  MPI_Allreduce(&owner, &first, 1, MPI_INT, MPI_MIN, world);
  MPI_Bcast(&overlaps, sizeof(overlaps), MPI_BYTE, first, world);
  if (comm->me == 0)
    error->warning(
        FLERR,
        "Pair evp/lj: {} pairs overlap by more than {} (R_i + R_j), first atoms {} and {} "
        "at d = {:.6g}, step {}: the law has no hard core, so check step, speed and load",
        count, settings_now.overlap, overlaps.tag_i, overlaps.tag_j, overlaps.d, update->ntimestep);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::pack_pair(int i, int jneigh, Overlaps &overlaps)
{
  const int j = jneigh & NEIGHMASK;
  if (force->special_lj[sbmask(jneigh)] == 0.0) return;

  bool is_bond = false;
  if (bonds) {
    const int m = canonical[j];
    is_bond = mark[m] == i;
  }
  if (!is_bond && settings_now.contact == Contact::NONE) return;

  const EVP::PairGeometry g(reinterpret_cast<const double(*)[3]>(atom->x[0]), i, j);
  if (!(g.dsq > 0.0))
    error->one(FLERR,
               "Pair evp/lj: atoms {} and {} are at one point, the force has no direction there: "
               "move one or delete it (delete_atoms overlap)",
               atom->tag[i], atom->tag[j]);

  const int law = law_index(atom->type[i], atom->type[j]);
  const double sum_radii = atom->radius[i] + atom->radius[j];
  const double deq = is_bond ? mark_deq[canonical[j]] : sum_radii;
  const bool repels_only = !is_bond && settings_now.contact == Contact::REPULSIVE;
  const double cut = repels_only ? sum_radii : laws[law].parameters().alpha * sum_radii;
  const bool implicit = is_implicit(i, j);
  packed.pairs.push_back({1.0 / deq, cut * cut, j, implicit ? nlaws() + law : law, is_bond});
  if (!implicit && laws[law].parameters().gamma > 0.0) explicit_damping = true;

  const double closest = (1.0 - settings_now.overlap) * sum_radii;
  const bool counted_there =
      !force->newton_pair && j >= atom->nlocal && atom->tag[i] > atom->tag[j];
  if (g.dsq < closest * closest && !counted_there)
    overlaps.add(atom->tag[i], atom->tag[j], std::sqrt(g.dsq));
}

/* ----------------------------------------------------------------------
   the neighbor list reaches alpha (R_i + R_j) for the radii at set-up only
------------------------------------------------------------------------- */

void PairEVPLJ::check_radii() const
{
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->radius[i] > max_radius[atom->type[i]])
      error->one(
          FLERR,
          "Pair evp/lj: the radius of atom {} is {:.8g}, but the cut-off was set for at most "
          "{:.8g} in its type: radii must not grow past the largest at the start of the run; "
          "split the run there",
          atom->tag[i], atom->radius[i], max_radius[atom->type[i]]);
}

/* ----------------------------------------------------------------------
   what would hand a deq to another atom, or to a second image of the same
------------------------------------------------------------------------- */

void PairEVPLJ::check_bonds() const
{
  const tagint misplaced = bonds->find_misplaced();
  if (misplaced) error->one(FLERR, bonds->misplaced_message(misplaced));

  double longest = 0.0;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j]) longest = std::max(longest, std::sqrt(cutsq[i][j]));
  const double *h = domain->h_inv;    // its rows are the reciprocals of the box's heights
  const double height[3] = {1.0 / std::sqrt(h[0] * h[0] + h[5] * h[5] + h[4] * h[4]),
                            1.0 / std::sqrt(h[1] * h[1] + h[3] * h[3]), 1.0 / h[2]};
  for (int c = 0; c < domain->dimension; c++)
    if (domain->periodicity[c] && height[c] < 2.0 * longest)
      error->all(FLERR,
                 "Pair evp/lj: the periodic box is {:.6g} high along {}, less than two cut-offs of "
                 "{:.6g}, so that a bond could meet its atom in two images: enlarge the box "
                 "(replicate) or reduce alpha",
                 height[c], "xyz"[c], longest);
}
