/* SPDX-License-Identifier: GPL-2.0-only

   Atoms by ID: who keeps which, and the messages. */

#include "atom_directory.h"

#include "atom.h"

#include <algorithm>
#include <cstdint>

using namespace LAMMPS_NS;

static constexpr size_t MOST_BYTES = (size_t) 1 << 30;    // received at once; MPI counts by int

/* ----------------------------------------------------------------------
   which items of a piece go to which rank, and how many come from each
------------------------------------------------------------------------- */

class AtomDirectory::Routes {
 public:
  Routes(const std::vector<int> &ranks, int nranks, MPI_Comm world_in) :
      world(world_in), sent(nranks, 0), received(nranks, 0), order(ranks.size())
  {
    for (const int rank : ranks) sent[rank]++;
    std::vector<size_t> next(nranks, 0);
    for (int rank = 1; rank < nranks; rank++) next[rank] = next[rank - 1] + sent[rank - 1];
    for (size_t k = 0; k < ranks.size(); k++) order[next[ranks[k]]++] = k;
    MPI_Alltoall(sent.data(), 1, MPI_INT, received.data(), 1, MPI_INT, world);
  }

  template <class Item> std::vector<Item> send(const Item *items) const
  {
    std::vector<Item> sorted;
    for (const size_t k : order) sorted.push_back(items[k]);
    return exchange(sorted, sent, received);
  }

  /// The answers to what send() returned, in the order of the items sent.
  template <class Item> void send_back(const std::vector<Item> &answers, Item *items) const
  {
    const std::vector<Item> sorted = exchange(answers, received, sent);
    for (size_t k = 0; k < order.size(); k++) items[order[k]] = sorted[k];
  }

 private:
  MPI_Comm world;
  std::vector<int> sent, received;    // items to and from each rank
  std::vector<size_t> order;          // of the items, by rank

  template <class Item>
  std::vector<Item> exchange(std::vector<Item> out, const std::vector<int> &to,
                             const std::vector<int> &from) const
  {
    std::vector<int> bytes[2], first[2];
    size_t total = 0;
    for (int side = 0; side < 2; side++) {
      int sum = 0;
      for (const int count : side ? from : to) {
        bytes[side].push_back(count * (int) sizeof(Item));
        first[side].push_back(sum);
        sum += bytes[side].back();
      }
      total = (size_t) sum / sizeof(Item);
    }
    std::vector<Item> in(total);
    MPI_Alltoallv(out.data(), bytes[0].data(), first[0].data(), MPI_BYTE, in.data(),
                  bytes[1].data(), first[1].data(), MPI_BYTE, world);
    return in;
  }
};

/* ---------------------------------------------------------------------- */

AtomDirectory::AtomDirectory(const Atom *atom, MPI_Comm world_in) : world(world_in)
{
  MPI_Comm_size(world, &nranks);
  piece = std::max<size_t>(1, MOST_BYTES / sizeof(Entry) / nranks);

  const auto natoms = (size_t) atom->nlocal;
  const size_t n = rounds(natoms);
  for (size_t round = 0, first = 0; round < n; round++) {
    const size_t last = std::min(natoms, first + piece);
    std::vector<Entry> own;
    std::vector<int> ranks;
    for (; first < last; first++) {
      own.push_back({atom->tag[first], atom->type[first], atom->mask[first],
                     atom->radius ? atom->radius[first] : 0.0});
      ranks.push_back(rank_of(atom->tag[first]));
    }
    const std::vector<Entry> kept = Routes(ranks, nranks, world).send(own.data());
    entries.insert(entries.end(), kept.begin(), kept.end());
  }
  std::sort(entries.begin(), entries.end(), [](const Entry &a, const Entry &b) {
    return a.id < b.id;
  });
}

/* ----------------------------------------------------------------------
   as many for all as the rank with most items needs
------------------------------------------------------------------------- */

size_t AtomDirectory::rounds(size_t items) const
{
  bigint here = (bigint) ((items + piece - 1) / piece), most;
  MPI_Allreduce(&here, &most, 1, MPI_LMP_BIGINT, MPI_MAX, world);
  return (size_t) most;
}

/* ----------------------------------------------------------------------
   IDs that are multiples of a number are common: their hashes are not
------------------------------------------------------------------------- */

int AtomDirectory::rank_of(tagint id) const
{
  return (int) ((((uint64_t) id * 0x9E3779B97F4A7C15ULL) >> 33) % (uint64_t) nranks);
}

/* ---------------------------------------------------------------------- */

tagint AtomDirectory::find_twice() const
{
  const auto twice =
      std::adjacent_find(entries.begin(), entries.end(), [](const Entry &a, const Entry &b) {
        return a.id == b.id;
      });
  tagint here = twice == entries.end() ? 0 : twice->id, any;
  MPI_Allreduce(&here, &any, 1, MPI_LMP_TAGINT, MPI_MAX, world);
  return any;
}

/* ---------------------------------------------------------------------- */

AtomDirectory::Entry AtomDirectory::find_here(tagint id) const
{
  const auto at =
      std::lower_bound(entries.begin(), entries.end(), id, [](const Entry &entry, tagint wanted) {
        return entry.id < wanted;
      });
  return at == entries.end() || at->id != id ? Entry{id, 0, 0, 0.0} : *at;
}

/* ---------------------------------------------------------------------- */

std::vector<AtomDirectory::Entry> AtomDirectory::find(const std::vector<tagint> &ids) const
{
  std::vector<Entry> found(ids.size());
  const size_t n = rounds(ids.size());
  for (size_t round = 0, first = 0; round < n; round++) {
    const size_t last = std::min(ids.size(), first + piece);
    std::vector<int> ranks;
    for (size_t k = first; k < last; k++) ranks.push_back(rank_of(ids[k]));
    const Routes routes(ranks, nranks, world);
    std::vector<Entry> answers;
    for (const tagint id : routes.send(ids.data() + first)) answers.push_back(find_here(id));
    routes.send_back(answers, found.data() + first);
    first = last;
  }
  return found;
}
