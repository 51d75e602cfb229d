// SPDX-License-Identifier: GPL-2.0-only

#include "pair_histories.h"

#include "collective.h"
#include "scene.h"

#include "comm.h"
#include "irregular.h"

#include <algorithm>

namespace EVP {

void PairHistories::begin_run()
{
  flow_warned = false;
  if (!on_any(due, world)) return;
  due = false;
  newly_broken.clear();
  error->all(FLERR,
             "Pair evp/lj: the last run ended in an error, so that flow and broken bonds since its "
             "last neighbor build are lost: go back to a restart file");
}

void PairHistories::commit(bool at_rest, VolumeForces *volume, PairWork *work)
{
  due = true;
  if (at_rest) find_next();
  if (rules.flows) list.pairs.commit();
  if (rules.breaks()) break_bonds(volume, work);
}

// what the force loop finds, at the present positions
void PairHistories::find_next()
{
  beyond.clear();
  PackedPairs &pairs = list.pairs;
  std::fill(pairs.moves.begin(), pairs.moves.end(), 1);
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (rules.breaks() && p.is_bond() && p.is_beyond()) beyond.push_back(p.index);
    if (!rules.flows) return;
    const Law &law = coefficients.law(p.law);
    const double r = std::min(p.distance(), p.cut) * p.inv_deq;    // so far a bond flows
    const bool ended = p.is_beyond() && !p.is_bond();
    const double kept = law.kept(law.flowed(r, 1.0, p.offset), p.offset, pairs.cap[p.index]);
    pairs.next_offset[p.index] = ended ? CONTACT_ENDED : kept;
    pairs.spent[p.index] = ended ? -pairs.work[p.index] : law.dissipated(p.offset, kept);
  });
}

void PairHistories::break_bonds(VolumeForces *volume, PairWork *work)
{
  for (const int k : beyond) {
    const PackedPair pair = list.pairs[k];
    if (!pair.is_bond()) continue;
    const auto row =
        std::upper_bound(list.rows.begin(), list.rows.end(), k, [](int index, const PackedRow &r) {
          return index < r.last;
        });
    newly_broken.push_back({row->i, pair.j, list.pairs.history_of(k).work});
    if (work) work->stored.note_broken(list, k, pair.offset, rest_of_broken(row->i, pair));
    turn_into_contact(row->i, k, volume);
  }
  beyond.clear();
}

// 0 where nothing is left
double PairHistories::rest_of_broken(int i, const PackedPair &bond) const
{
  if (rules.contact == Contact::NONE) return 0.0;
  return rules.rest_of_broken(atom->radius[i] + atom->radius[bond.j], 1.0 / bond.inv_deq);
}

void PairHistories::turn_into_contact(int i, int k, VolumeForces *volume)
{
  const PackedPair pair = list.pairs[k];
  list.pairs.turn_into_contact(k, rest_of_broken(i, pair),
                               coefficients.law(pair.law).cap(false, true));
  if (volume) volume->drop(k);
}

void PairHistories::carry(const PairList &before, VolumeForces *volume)
{
  std::vector<const PackedRow *> row_of(list.nlocal, nullptr);
  for (const PackedRow &row : before.rows) row_of[row.i] = &row;
  for (const PackedRow &row : list.rows)
    for (int k = row.first; row_of[row.i] && k < row.last; k++) {
      const int old = find_pair(before, *row_of[row.i], [&](int j) {
        return j == list.pairs.j[k];
      });
      if (old < 0) continue;
      const PairHistory history = before.pairs.history_of(old);
      if (history.broken != 0.0 && list.pairs[k].is_bond()) turn_into_contact(row.i, k, volume);
      if (rules.flows) list.pairs.take_history(k, history);
    }
}

void PairHistories::return_to(BondStore &records, bool list_matches, PerAtomComm &exchange)
{
  if (!due) return;
  due = false;
  if (!on_all(list_matches, world))
    error->all(
        FLERR,
        "Pair evp/lj: atoms were added or deleted before it could keep how bonds have flowed "
        "or broken: define fix evp/bonds before all fixes that do so");
  send_to_owners(records, exchange);
  newly_broken.clear();
  warn_of_low_offsets();
}

// Atoms and ghosts are those that the list was packed for. Without newton both owners of a pair across MPI ranks, or
// across a periodic boundary, hold a copy: that of the atom with the lower ID is taken for both
void PairHistories::send_to_owners(BondStore &records, PerAtomComm &exchange)
{
  const tagint *tag = atom->tag;
  const int nlocal = atom->nlocal, newton = force->newton_pair;

  PerAtomComm::Values owner((size_t) 3 * (nlocal + atom->nghost),
                            0.0);    // rank, local index
  for (int i = 0; i < nlocal; i++) {
    owner[(size_t) 3 * i] = comm->me;
    owner[(size_t) 3 * i + 1] = i;
  }
  exchange.forward_comm(owner);

  records.clear_contacts();
  std::vector<HistoryOfPair> messages;
  std::vector<int> ranks;
  const auto post = [&](int ghost, int own, bool is_record, const PairHistory &h) {
    ranks.push_back((int) owner[(size_t) 3 * ghost]);
    messages.push_back({(int) owner[(size_t) 3 * ghost + 1], is_record, tag[own], h});
  };
  const auto send = [&](int i, int j, bool is_record, const PairHistory &h) {
    if (j < nlocal) {
      records.take({i, is_record, tag[j], h});
      records.take({j, is_record, tag[i], h});
    } else if (newton || tag[i] < tag[j]) {
      records.take({i, is_record, tag[j], h});
      post(j, i, is_record, h);
    }
  };
  // either copy of a bond may have met its cut-off alone, by round-off: that breaks both
  std::vector<HistoryOfPair> deferred;
  for (const BrokenBond &bond : newly_broken) {
    const PairHistory h = {0.0, bond.work, 1.0};
    if (bond.j < nlocal || newton || tag[bond.i] < tag[bond.j]) {
      send(bond.i, bond.j, true, h);
      continue;
    }
    post(bond.j, bond.i, true, h);
    deferred.push_back({bond.i, true, tag[bond.j], h});
  }
  const PackedPairs &pairs = list.pairs;
  for (const PackedRow &row : list.rows)
    for (int k = row.first; pairs.has_flow() && k < row.last; k++) {
      PairHistory h = pairs.history_of(k);
      h.broken = 0.0;    // of what is left of such a bond
      if (!(h == PairHistory{})) send(row.i, pairs.j[k], pairs.slot[k] >= 0, h);
    }

  Irregular irregular(lmp);
  const int n = irregular.create_data((int) messages.size(), ranks.data(), 1);
  std::vector<HistoryOfPair> received(n);
  irregular.exchange_data((char *) messages.data(), sizeof(HistoryOfPair),
                          (char *) received.data());
  irregular.destroy_data();
  for (const HistoryOfPair &m : received) records.take(m);
  for (const HistoryOfPair &m : deferred) records.take(m);
}

// once per run
void PairHistories::warn_of_low_offsets()
{
  if (!rules.flows || flow_warned) return;
  double lowest = -1.0;
  for (const int law : coefficients.laws_in_use())
    lowest = std::max(lowest, coefficients.law(law).lowest_offset());
  bool too_low = false;
  for (size_t k = 0; k < list.pairs.size(); k++) too_low = too_low || list.pairs.offset[k] < lowest;
  flow_warned = on_any(too_low, world);
  if (flow_warned && comm->me == 0)
    error->warning(FLERR,
                   "Pair evp/lj: pairs have flowed in compression to q below {:.3g} deq, where the "
                   "second regime is the stiffer, so that further flow creates energy: check load "
                   "and overlap",
                   lowest);
}

bool PairHistories::find(int i, int j, PairHistory &found) const
{
  if (row_index_build != list.build) {
    row_index_build = list.build;
    row_index.assign(list.nlocal, -1);
    for (size_t r = 0; r < list.rows.size(); r++) row_index[list.rows[r].i] = (int) r;
  }
  for (const auto &[own, other] : {std::pair(i, j), std::pair(j, i)}) {
    if (own >= list.nlocal || row_index[own] < 0) continue;
    const tagint partner = atom->tag[other];
    const int k = find_pair(list, list.rows[row_index[own]], [&](int at) {
      return atom->tag[at] == partner;
    });
    if (k < 0) continue;
    found = list.pairs.history_of(k);
    return true;
  }
  return false;
}

}    // namespace EVP
