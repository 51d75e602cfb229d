/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: from LAMMPS' neighbor list and the records to the list of the time-step loop. */

#include "pair_evp_lj.h"

#include "core/partners.h"
#include "fix_evp_bonds.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr int AHEAD = 4;    // rows, that their records are at hand when they are due

/* ----------------------------------------------------------------------
   from the neighbor list and the records to the list of the time-step loop,
   in time linear in the neighbors but for atoms of very many records, see partners.h.
   together: all processes do, with a new list or new coefficients; else this one has other radii
------------------------------------------------------------------------- */

void PairEVPLJ::pack(bool together)
{
  if (together && !scene_checked) check_scene();
  check_radii();
  if (together) {
    check_weights();
    if (bonds) check_bonds();
  }

  packed.clear(new_pair_margin());
  if (together) packed.common_build++;
  packed.nlocal = atom->nlocal;
  packed.nall = atom->nlocal + atom->nghost;
  packed_call = -1;    // until the list is whole: an error may be caught and something asked then
  packed_atoms = fingerprint_of_atoms();
  if (neighbor->ago == 0) note_positions();
  if (radii_vary) packed_radius.assign(atom->radius, atom->radius + packed.nall);
  repack = false;

  Overlaps overlaps;
  bool damped = false;
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (bonds && ii + AHEAD < list->inum) bonds->prefetch_bonds_of(list->ilist[ii + AHEAD]);
    damped = pack_row(i, overlaps) || damped;
  }
  packed_call = neighbor->ncalls;
  packed_step = neighbor->lastcall;
  if (together) agree_on_pairs(damped, overlaps);
  coefficients.choose_block_law(
      [this](int i, int j) {
        return serves(i, j);
      },
      explicit_damping && implicit_groupbit);
}

/* ----------------------------------------------------------------------
   what the pairs of any process ask of all; overlaps are warned of once per run. Velocities are sent
   where explicit_damping says so, on all processes or none: it changes here only
------------------------------------------------------------------------- */

void PairEVPLJ::agree_on_pairs(bool damped, Overlaps overlaps)
{
  bigint here[2] = {damped, overlaps.count}, all[2];
  MPI_Allreduce(here, all, 2, MPI_LMP_BIGINT, MPI_SUM, world);
  explicit_damping = all[0] > 0;

  const bigint count = all[1];
  if (count == 0 || overlap_warned) return;
  overlap_warned = true;

  int owner = overlaps.count ? comm->me : comm->nprocs, first;
  MPI_Allreduce(&owner, &first, 1, MPI_INT, MPI_MIN, world);
  MPI_Bcast(&overlaps, sizeof(overlaps), MPI_BYTE, first, world);
  if (comm->me == 0)
    error->warning(
        FLERR,
        "Pair evp/lj: {} pairs overlap by more than {} (R_i + R_j), first atoms {} and {} "
        "at d = {:.6g}, deq = {:.6g}, {} regime, at step {} with timestep {:.6g}: the law has no "
        "hard core, so check step, speed and load",
        count, settings_now.overlap, overlaps.tag_i, overlaps.tag_j, overlaps.d, overlaps.deq,
        overlaps.regime == 1 ? "first" : "second", update->ntimestep, update->dt);
}

/* ----------------------------------------------------------------------
   does this style damp one of the pairs?
   Periodic images of a partner share its ID and have its deq; check_bonds() sees to it that no two
   of them can be within dlim
------------------------------------------------------------------------- */

bool PairEVPLJ::pack_row(int i, Overlaps &overlaps)
{
  // what does not change along the row, at hand
  const auto *const x = EVP::scene::rows(atom->x);
  const double *const radius = atom->radius, *const special = force->special_lj;
  const int *const type = atom->type;
  const int *const neighbors = list->firstneigh[i], nneighbors = list->numneigh[i];
  const tagint *const tag = atom->tag;
  FixEVPBonds::Bonds none;
  EVP::Partners<FixEVPBonds::Bond> partners(bonds ? bonds->ordered_bonds_of(i) : none);
  const int first_law = coefficients.index(type[i], 0);
  const EVP::Law *const row_laws = &coefficients.law(first_law);
  const bool new_pairs = settings_now.contact != Contact::NONE;
  const bool new_repel_only = settings_now.contact == Contact::REPULSIVE;
  const bool some_implicit = implicit_groupbit != 0;
  const double closest = 1.0 - settings_now.overlap;
  constexpr double coincident = EVP::COINCIDENT * EVP::COINCIDENT;

  if (!EVP::PackedPairs::fits(packed.pairs.size(), nneighbors))
    error->one(FLERR, "Pair evp/lj: more than {} pairs on one MPI rank: use more ranks",
               EVP::PackedPairs::MOST);
  packed.pairs.make_room(nneighbors);
  bool damped = false;
  const int first = (int) packed.pairs.size();
  for (int jj = 0; jj < nneighbors; jj++) {
    const int j = neighbors[jj] & NEIGHMASK;
    if (special[sbmask(neighbors[jj])] == 0.0) continue;
    const FixEVPBonds::Bond *const bond = partners.find(tag[j]);
    const bool is_bond = bond != nullptr;
    if (!is_bond && !new_pairs) continue;

    const EVP::PairGeometry g(x, i, j);
    const double sum_radii = radius[i] + radius[j];
    if (!(g.dsq > coincident * (sum_radii * sum_radii))) stop_where_centres_coincide(i, j);

    const EVP::Row &row = row_laws[type[j]].parameters();
    const double deq = is_bond ? bond->deq : sum_radii;
    const double cut = !is_bond && new_repel_only ? sum_radii : row.alpha * sum_radii;
    const bool implicit = some_implicit && is_implicit(i, j);
    const int own = first_law + type[j], law = implicit ? coefficients.undamped(own) : own;
    packed.pairs.push_back(deq, cut, j, law, is_bond);
    damped = damped || (!implicit && row.gamma > 0.0);

    if (g.dsq < closest * sum_radii * (closest * sum_radii))
      count_overlap(i, j, deq, law, overlaps);
  }
  const int last = (int) packed.pairs.size();
  if (last > first) packed.rows.push_back({i, first, last});
  return damped;
}

/* ----------------------------------------------------------------------
   the records are in the order of the packing, so that each is found at once
------------------------------------------------------------------------- */

std::vector<double> PairEVPLJ::rest_distances() const
{
  std::vector<double> distances(packed.pairs.size());
  FixEVPBonds::Bonds none;
  for (const EVP::PackedRow &row : packed.rows) {
    EVP::Partners<FixEVPBonds::Bond> partners(bonds ? bonds->ordered_bonds_of(row.i) : none);
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &pair = packed.pairs[n];
      distances[n] = pair.is_bond ? partners.find(atom->tag[pair.j])->deq
                                  : atom->radius[row.i] + atom->radius[pair.j];
    }
  }
  return distances;
}

/* ----------------------------------------------------------------------
   without newton both owners of a pair across processes hold it; one of them counts it
------------------------------------------------------------------------- */

void PairEVPLJ::count_overlap(int i, int j, double deq, int law, Overlaps &overlaps) const
{
  if (!force->newton_pair && j >= atom->nlocal && atom->tag[i] > atom->tag[j]) return;
  if (overlaps.count++) return;
  const double d = std::sqrt(EVP::PairGeometry(EVP::scene::rows(atom->x), i, j).dsq);
  overlaps = {1, atom->tag[i], atom->tag[j], d, deq, coefficients.law(law).regime(d, deq)};
}

/* ----------------------------------------------------------------------
   of special_bonds, or of the pair special option of this sub-style of pair_style hybrid
------------------------------------------------------------------------- */

void PairEVPLJ::check_weights() const
{
  for (int k = 1; k < 4; k++)
    if (force->special_lj[k] != 0.0 && force->special_lj[k] != 1.0)
      error->all(FLERR,
                 "Pair evp/lj takes special_bonds weights 0 or 1 only, got {}: the force of a pair "
                 "is whole or absent",
                 force->special_lj[k]);
}

/* ---------------------------------------------------------------------- */

bool PairEVPLJ::radii_changed() const
{
  return !std::equal(packed_radius.begin(), packed_radius.end(), atom->radius);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::stop_where_centres_coincide(int i, int j) const
{
  error->one(FLERR,
             "Pair evp/lj: atoms {} and {} coincide, the force has no direction there: move one or "
             "delete it (delete_atoms overlap)",
             atom->tag[i], atom->tag[j]);
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
  if (const auto misplaced = bonds->find_misplaced())
    error->one(FLERR, bonds->misplaced_message(misplaced));

  double longest = 0.0;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (serves(i, j)) longest = std::max(longest, std::sqrt(cutsq[i][j]));
  longest *= 1.0 - 2.0 * EVP::LIST_MARGIN;    // a box of two cut-offs but for round-off will do

  const double *h = domain->h_inv;    // its rows are the reciprocals of the box's heights
  const double height[3] = {1.0 / std::sqrt(h[0] * h[0] + h[5] * h[5] + h[4] * h[4]),
                            1.0 / std::sqrt(h[1] * h[1] + h[3] * h[3]), 1.0 / h[2]};
  for (int c = 0; c < domain->dimension; c++) {
    if (!domain->periodicity[c] || height[c] >= 2.0 * longest) continue;
    const std::string larger = bonds->how_to_replicate();
    error->all(FLERR,
               "Pair evp/lj: the periodic box is {:.6g} high along {}, less than two cut-offs of "
               "{:.6g}, so that a bond could meet its atom in two images: reduce alpha, or enlarge "
               "the box: {}",
               height[c], "xyz"[c], longest, larger);
  }
}
