// SPDX-License-Identifier: GPL-2.0-only

#include "pair_list_builder.h"

#include "core/record_finder.h"
#include "scene.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "neigh_list.h"

#include <cmath>

using namespace LAMMPS_NS;

static constexpr int AHEAD = 4;    // rows, that their records are at hand when they are due

PairListBuilder::Found PairListBuilder::build(const Scene &scene, EVP::PairList &list)
{
  if (scene.bonds) {
    last_rows.assign(atom->nlocal, {0, 0});
    for (const EVP::PackedRow &row : list.rows)
      if (row.i < atom->nlocal) last_rows[row.i] = {row.first, row.last};
    list.pairs.swap_slots(last_slots);
  }
  list.clear(scene.new_pair_margin);

  Found found{};
  const int *const ilist = scene.neighbors->ilist, inum = scene.neighbors->inum;
  for (int ii = 0; ii < inum; ii++) {
    if (scene.bonds && ii + AHEAD < inum) scene.bonds->prefetch(ilist[ii + AHEAD]);
    pack_row(scene, ilist[ii], list, found);
  }
  return found;
}

void PairListBuilder::pack_row(const Scene &scene, int i, EVP::PairList &list, Found &found)
{
  // what does not change along the row, at hand
  const auto *const x = EVP::scene::rows(atom->x);
  const double *const radius = atom->radius, *const special = force->special_lj;
  const int *const type = atom->type, *const mask = atom->mask;
  const int *const neighbors = scene.neighbors->firstneigh[i];
  const int nneighbors = scene.neighbors->numneigh[i];
  const tagint *const tag = atom->tag;
  const EVP::Coefficients &coefficients = *scene.coefficients;
  const int first_law = coefficients.index(type[i], 0);
  const bool with_new_pairs = scene.new_pairs.contact != EVP::Contact::NONE;
  const bool new_repel_only = scene.new_pairs.contact == EVP::Contact::REPULSIVE;
  const int implicit_bit = scene.implicit_groupbit;
  const double closest = 1.0 - scene.new_pairs.overlap;
  constexpr double coincident = EVP::COINCIDENT * EVP::COINCIDENT;
  static const EVP::BondStore::Bonds none;
  const EVP::BondStore::Bonds &records = scene.bonds ? scene.bonds->of(i) : none;
  const Range last_row = scene.bonds ? last_rows[i] : Range{0, 0};
  EVP::RecordFinder finder(records,
                           {last_slots.data() + last_row.first, last_slots.data() + last_row.last});

  if (!EVP::PackedPairs::fits(list.pairs.size(), nneighbors))
    error->one(FLERR, "Pair evp/lj: more than {} pairs on one MPI rank: use more ranks",
               EVP::PackedPairs::MOST);
  list.pairs.make_room(nneighbors);
  bool damped = false;
  const int first = (int) list.pairs.size();
  for (int jj = 0; jj < nneighbors; jj++) {
    const int j = neighbors[jj] & NEIGHMASK;
    if (special[neighbors[jj] >> SBBITS & 3] == 0.0) continue;
    const int slot = finder.find(tag[j]);
    const bool is_bond = slot >= 0;
    if (!is_bond && !with_new_pairs) continue;

    const EVP::PairGeometry g(x, i, j);
    const double sum_radii = radius[i] + radius[j];
    if (!(g.dsq > coincident * (sum_radii * sum_radii)))
      error->one(
          FLERR,
          "Pair evp/lj: atoms {} and {} coincide, the force has no direction there: move one "
          "or delete it (delete_atoms overlap)",
          tag[i], tag[j]);

    int law = first_law + type[j];
    const EVP::Row &row = coefficients.law(law).parameters();
    const double deq = is_bond ? records[slot].deq : sum_radii;
    const double cut = !is_bond && new_repel_only ? sum_radii : row.alpha * sum_radii;
    const bool implicit = (mask[i] | mask[j]) & implicit_bit;
    damped = damped || (!implicit && row.gamma > 0.0);
    if (implicit) law = coefficients.undamped(law);
    list.pairs.push_back(deq, cut, j, law, slot);

    if (g.dsq < closest * sum_radii * (closest * sum_radii))
      count_overlap(i, j, deq, coefficients.law(law), found.overlaps);
  }
  const int last = (int) list.pairs.size();
  found.damped = found.damped || damped;
  if (last > first) list.rows.push_back({i, first, last});
}

// without newton both owners of a pair across MPI ranks hold it; one of them counts it

void PairListBuilder::count_overlap(int i, int j, double deq, const EVP::Law &law,
                                    Overlaps &overlaps) const
{
  if (!force->newton_pair && j >= atom->nlocal && atom->tag[i] > atom->tag[j]) return;
  if (overlaps.count++) return;
  const double d = std::sqrt(EVP::PairGeometry(EVP::scene::rows(atom->x), i, j).dsq);
  overlaps = {1, atom->tag[i], atom->tag[j], d, deq, law.regime(d, deq)};
}
