// SPDX-License-Identifier: GPL-2.0-only

#include "pair_list_builder.h"

#include "scene.h"

#include "neigh_list.h"

#include <cmath>

using namespace LAMMPS_NS;

static constexpr int AHEAD = 4;    // rows: records are prefetched that much earlier

PairListBuilder::Found PairListBuilder::build(const Scene &scene, EVP::PairList &list)
{
  std::swap(last, now);
  now.size = 0;
  for (Slots *of : {&last, &now}) of->rows.resize(atom->nlocal, {0, 0});
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
  const int *const neighbors = scene.neighbors->firstneigh[i];
  const int nneighbors = scene.neighbors->numneigh[i];
  if (!EVP::PackedPairs::fits(list.pairs.size(), nneighbors))
    error->one(FLERR, "Pair evp/lj: more than {} pairs on one MPI rank: use more ranks",
               EVP::PackedPairs::MOST);
  const EVP::PackedPairs::Room room = list.pairs.room(nneighbors);

  const int n = take_neighbors(scene, i, neighbors, nneighbors, room);
  if (n == 0) return;
  fill(scene, i, n, room, list.pairs, found);

  const int first = (int) list.pairs.size();
  list.pairs.add(n);
  list.rows.emplace_back();
  EVP::PackedRow &row = list.rows.back();    // by member: a copy would stall on its parts
  row.i = i;
  row.first = first;
  row.last = first + n;
}

// partner and slot of each neighbor that can act
int PairListBuilder::take_neighbors(const Scene &scene, int i, const int *neighbors, int nneighbors,
                                    const Room &room)
{
  static const EVP::BondStore::Bonds none;
  const double *const special = force->special_lj;
  const tagint *const tag = atom->tag;
  const bool with_new_pairs = scene.new_pairs.contact != EVP::Contact::NONE;
  const Range hints = last.rows[i];
  EVP::RecordFinder finder(scene.bonds ? scene.bonds->of(i) : none,
                           {last.slots.data() + hints.first, last.slots.data() + hints.last});
  int *const found = now.room(nneighbors);
  int n = 0, nfound = 0;
  for (int jj = 0; jj < nneighbors; jj++) {
    if (special[neighbors[jj] >> SBBITS & 3] == 0.0) continue;
    const int j = neighbors[jj] & NEIGHMASK;
    const int slot = finder.find(tag[j]);
    room.j[n] = j;
    room.slot[n] = slot;
    if (slot >= 0) found[nfound++] = slot;
    if (slot >= 0 || with_new_pairs) n++;
  }
  now.rows[i] = {now.size, now.size + nfound};
  now.size += nfound;
  return n;
}

// what follows from partner and slot
void PairListBuilder::fill(const Scene &scene, int i, int n, const Room &room,
                           const EVP::PackedPairs &pairs, Found &found) const
{
  const auto *const x = EVP::scene::rows(atom->x);
  const double *const radius = atom->radius, own_radius = radius[i];
  const int *const type = atom->type, *const mask = atom->mask;
  const EVP::Bond *const records = scene.bonds ? scene.bonds->of(i).data() : nullptr;
  const int first_law = scene.coefficients->index(type[i], 0);
  const EVP::Law *const laws = &scene.coefficients->law(first_law);
  const bool new_repel_only = scene.new_pairs.contact == EVP::Contact::REPULSIVE;
  const int implicit_bit = scene.implicit_groupbit;
  const double closest = 1.0 - scene.new_pairs.overlap;
  constexpr double coincident = EVP::COINCIDENT * EVP::COINCIDENT;

  bool damped = false;
  for (int k = 0; k < n; k++) {
    const int j = room.j[k], slot = room.slot[k];
    const bool is_bond = slot >= 0;
    const EVP::PairGeometry g(x, i, j);
    const double sum_radii = own_radius + radius[j];
    if (!(g.dsq > coincident * (sum_radii * sum_radii))) stop_where_centres_coincide(i, j);

    const EVP::Row &row = laws[type[j]].parameters();
    const double deq = is_bond ? records[slot].deq : sum_radii;
    const double cut = !is_bond && new_repel_only ? sum_radii : row.alpha * sum_radii;
    const bool implicit = implicit_bit && ((mask[i] | mask[j]) & implicit_bit);
    const int own = first_law + type[j];
    const int law = implicit ? scene.coefficients->undamped(own) : own;
    room.inv_deq[k] = 1.0 / deq;
    room.cutsq[k] = pairs.reach_squared(cut, is_bond);
    room.kind[k] = 2 * law + is_bond;
    damped = damped || (!implicit && row.gamma > 0.0);

    if (g.dsq < closest * sum_radii * (closest * sum_radii))
      count_overlap(i, j, deq, laws[type[j]], found.overlaps);
  }
  found.damped = found.damped || damped;
}

void PairListBuilder::stop_where_centres_coincide(int i, int j) const
{
  error->one(FLERR,
             "Pair evp/lj: atoms {} and {} coincide, the force has no direction there: move one or "
             "delete it (delete_atoms overlap)",
             atom->tag[i], atom->tag[j]);
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
