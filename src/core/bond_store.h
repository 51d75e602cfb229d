// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_measures.h"
#include "core/contacts.h"
#include "core/pairs.h"
#include "core/simd.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace EVP {

/// A recorded pair, as one of its atoms keeps it.
struct Bond {
  int64_t partner;    ///< ID of the other atom
  double deq;         ///< distance at recording [length]
};

/// The history of a pair on its way to the atom with local index i.
struct HistoryOfPair {
  int i;
  bool is_record;    ///< of a bond, broken or not; else of a contact
  int64_t partner;
  PairHistory history;
};

/// A pair that is no bond, but has flowed: as one of its atoms keeps it.
struct FlowedContact {
  int64_t partner;
  PairHistory history;
};

/// The records of the bonds: those of each local atom, in the order of the partners' IDs.
///
/// A pair is kept on both of its atoms, equal to the last bit, so that whichever MPI rank meets it
/// finds deq without communication. A deq never changes (paper 2.2). What does change, a PairHistory
/// per bond and the contacts that have flowed, is kept beside them where asked for, and travels with
/// them.
///
/// The index of a bond among the records of its atom is its slot, valid until that atom moves to
/// another local index.
class BondStore {
 public:
  using Bonds = std::vector<Bond>;

  explicit BondStore(bool with_history_in = false) : with_history(with_history_in) { changed(); }

  /// Differs between all states of all stores: once it has changed, what was looked up is void. Atoms
  /// that come and go do not change it, as new neighbor lists follow.
  long version() const { return version_now; }

  bool has_recorded() const { return recorded; }

  /// Pairs recorded, over all MPI ranks.
  int64_t count() const { return npairs; }

  /// Bonds that have broken so far, as this MPI rank has counted them: their atoms may have gone since.
  int64_t broken() const { return nbroken; }

  /// Of all atoms at the recording: atoms that came later have higher IDs.
  int64_t highest_id() const { return highest; }

  /// What the records say of the pairs of types, empty where nobody needed it. Taken once: types and
  /// atoms that change later do not change it.
  BondMeasures measures;

  /// Own atoms whose density at rest came with a bond file, for fix evp/volume at the set-up that read it.
  struct DensityAtRest {
    int i;
    double rho, gap;
  };
  std::vector<DensityAtRest> densities_at_rest;

  /// Most words that an atom of this MPI rank has.
  int most_words() const
  {
    size_t most = 0;
    for (size_t i = 0; i < bonds.size(); i++) most = std::max(most, words_of(i));
    return (int) most;
  }

  /// Which atoms are one body: pairs of two bodies have no bonds.
  BodyRule within = BodyRule::ALL;

  /// Pairs up to zone (R_i + R_j) were recorded; 0: up to the alpha of their types.
  double zone = 0.0;

  /// Is there a history? Starts or drops one; what was recorded then has none yet.
  bool has_history() const { return with_history; }
  void keep_history(bool keep)
  {
    if (keep == with_history) return;
    with_history = keep;
    histories.clear();
    flowed_contacts.clear();
    nbroken = 0;
    grow((int) bonds.size());
    changed();
  }

  /// Has any pair of a local atom flowed or, where that counts, broken?
  bool has_changed(bool broken_counts = true) const
  {
    for (size_t i = 0; i < histories.size(); i++) {
      if (!flowed_contacts[i].empty()) return true;
      for (const PairHistory &history : histories[i])
        if (history.q != 0.0 || (broken_counts && !(history == PairHistory{}))) return true;
    }
    return false;
  }

  /// Records of the first atoms whose bonds have not broken; both atoms of a bond have one.
  int64_t count_unbroken(int natoms) const
  {
    int64_t count = 0;
    for (int i = 0; i < natoms; i++) {
      count += (int64_t) bonds[i].size();
      for (size_t k = 0; with_history && k < bonds[i].size(); k++) count -= is_broken(i, (int) k);
    }
    return count;
  }

  bool is_broken(int i, int slot) const { return with_history && histories[i][slot].broken != 0.0; }

  /// Takes the records of the local atoms, which may be in any order, all or none.
  template <class Tag>
  void record(std::vector<Bonds> &made, const Tag *ids, int64_t npairs_in, int64_t highest_in)
  {
    for (size_t i = 0; i < made.size(); i++) {
      recorded_as[i] = ids[i];
      bonds[i].swap(made[i]);
      std::sort(bonds[i].begin(), bonds[i].end(), precedes);
      if (with_history) {
        histories[i].assign(bonds[i].size(), PairHistory{});
        flowed_contacts[i].clear();
      }
    }
    restore(true, npairs_in, highest_in, 0);
  }

  /// Takes what a restart file says of all records; those of the atoms follow by unpack(). broken: on one MPI rank.
  void restore(bool recorded_in, int64_t npairs_in, int64_t highest_in, int64_t broken_in)
  {
    recorded = recorded_in;
    npairs = npairs_in;
    highest = highest_in;
    nbroken = broken_in;
    changed();
  }

  /// Forgets all, as its owner goes: readers that hold on to the store see so.
  void close()
  {
    *this = BondStore(with_history);
    closed = true;
  }
  bool is_closed() const { return closed; }

  const Bonds &of(int i) const { return bonds[i]; }

  /// History of the bonds of an atom, by slot; nullptr without.
  const PairHistory *histories_of(int i) const
  {
    return with_history ? histories[i].data() : nullptr;
  }

  /// Contacts of an atom that have flowed; with history only.
  const std::vector<FlowedContact> &contacts_of(int i) const { return flowed_contacts[i]; }

  void clear_contacts()
  {
    for (auto &own : flowed_contacts) own.clear();
  }

  /// Takes the history of a pair of atom i: of a record, or of a contact that has flowed, as what is
  /// left of a broken bond may, too. A broken bond stays as it is.
  void take(const HistoryOfPair &pair)
  {
    const auto &[i, is_record, partner, history] = pair;
    if (!is_record) return flowed_contacts[i].push_back({partner, history});
    if (const Bond *const bond = find(i, partner)) {
      const auto slot = (int) (bond - bonds[i].data());
      if (histories[i][slot].broken == 0.0) take(i, slot, history);
    }
  }

  /// The same of the bond in a slot. The atom with the lower ID counts those that break.
  void take(int i, int slot, const PairHistory &history)
  {
    histories[i][slot] = history;
    if (history.broken != 0.0 && recorded_as[i] < bonds[i][slot].partner) nbroken++;
  }

  /// The bond of a local atom with a partner, nullptr if they were not recorded.
  const Bond *find(int i, int64_t partner) const
  {
    return find(bonds[i].data(), bonds[i].data() + bonds[i].size(), partner);
  }

  /// The same among sorted records.
  static const Bond *find(const Bond *begin, const Bond *end, int64_t partner)
  {
    const Bond *const at = std::lower_bound(begin, end, Bond{partner, 0.0}, precedes);
    return at == end || at->partner != partner ? nullptr : at;
  }

  /// Prefetches the records of an atom that is needed soon, 32 of them at most.
  void prefetch(int i) const
  {
    EVP::prefetch(bonds[i].data(), std::min<size_t>(bonds[i].size(), 32) * sizeof(Bond));
  }

  /// How many of these local atoms, those with the bit in their mask, came after the recording.
  int64_t count_new(const int *mask, int bit, int nlocal) const
  {
    int64_t count = 0;
    for (int i = 0; i < nlocal; i++) count += recorded_as[i] == 0 && (mask[i] & bit);
    return count;
  }

  /// ID of a local atom that is not the one recorded under it: it had another ID, or it is new and took that of one that
  /// was deleted. 0 if there is none.
  template <class Tag> int64_t find_misplaced(const Tag *ids, int nlocal) const
  {
    int64_t found = 0;
    for (int i = 0; recorded && i < nlocal; i++)
      if (recorded_as[i] == 0 ? ids[i] <= highest : recorded_as[i] != ids[i]) found = ids[i];
    return found;
  }

  // records as data of atoms: see the functions of a Fix with the same purpose

  void grow(int natoms)
  {
    recorded_as.resize(natoms, 0);
    bonds.resize(natoms);
    if (!with_history) return;
    const size_t had = histories.size();
    histories.resize(natoms);
    flowed_contacts.resize(natoms);
    for (size_t i = had; i < histories.size(); i++) histories[i].assign(bonds[i].size(), {});
  }
  void copy(int from, int to)
  {
    if (from == to) return;
    recorded_as[to] = recorded_as[from];
    bonds[to] = bonds[from];
    if (!with_history) return;
    histories[to] = histories[from];
    flowed_contacts[to] = flowed_contacts[from];
  }

  /// A new atom has no records.
  void clear(int i)
  {
    recorded_as[i] = 0;
    bonds[i].clear();
    if (!with_history) return;
    histories[i].clear();
    flowed_contacts[i].clear();
  }

  /// Words of an atom: own ID, number of records, then partner, deq and history of each, then the
  /// number of contacts, and partner and history of each; without history no words of it.
  size_t words_of(int i) const
  {
    if (!with_history) return 2 + 2 * bonds[i].size();
    return 3 + (2 + PairHistory::WORDS) * bonds[i].size() +
        (1 + PairHistory::WORDS) * flowed_contacts[i].size();
  }

  /// The same words for migration and restart; integers travel as bits. Returns their number.
  int pack(int i, double *buf) const
  {
    double *at = put(recorded_as[i], buf);
    at = put((int64_t) bonds[i].size(), at);
    for (size_t slot = 0; slot < bonds[i].size(); slot++) {
      at = put(bonds[i][slot], at);
      if (with_history) at = put(histories[i][slot], at);
    }
    if (with_history) {
      at = put((int64_t) flowed_contacts[i].size(), at);
      for (const FlowedContact &contact : flowed_contacts[i]) at = put(contact, at);
    }
    return (int) (at - buf);
  }
  /// Do the counts among the words of an atom make n words?
  bool fits(const double *words, size_t n) const
  {
    const size_t bonds = n > 1 ? (size_t) bits_as<uint64_t>(words[1]) : n;
    if (bonds >= n) return false;
    const size_t size = 2 + (with_history ? 2 + PairHistory::WORDS : 2) * bonds;
    if (!with_history || size >= n) return !with_history && size == n;
    const size_t contacts = (size_t) bits_as<uint64_t>(words[size]);
    return contacts < n && size + 1 + (1 + PairHistory::WORDS) * contacts == n;
  }
  int unpack(int i, const double *buf)
  {
    int64_t n = 0;
    const double *at = take(take(buf, recorded_as[i]), n);
    bonds[i].resize(n);
    if (with_history) histories[i].resize(n);
    for (size_t slot = 0; slot < bonds[i].size(); slot++) {
      at = take(at, bonds[i][slot]);
      if (with_history) at = take(at, histories[i][slot]);
    }
    if (with_history) {
      at = take(at, n);
      flowed_contacts[i].resize(n);
      for (FlowedContact &contact : flowed_contacts[i]) at = take(at, contact);
    }
    return (int) (at - buf);
  }

  double memory_usage() const
  {
    double bytes = bytes_of(bonds, recorded_as, histories, flowed_contacts);
    for (const Bonds &own : bonds) bytes += bytes_of(own);
    for (const auto &own : histories) bytes += bytes_of(own);
    for (const auto &own : flowed_contacts) bytes += bytes_of(own);
    return bytes;
  }

 private:
  bool with_history;
  long version_now;
  bool recorded = false, closed = false;
  int64_t npairs = 0, highest = 0, nbroken = 0;

  // per atom
  std::vector<int64_t> recorded_as;
  std::vector<Bonds> bonds;
  std::vector<std::vector<PairHistory>> histories;            // with history only
  std::vector<std::vector<FlowedContact>> flowed_contacts;    // with history only

  template <class T> static double *put(const T &value, double *words)
  {
    memcpy(words, &value, sizeof(value));
    return words + sizeof(value) / sizeof(double);
  }
  template <class T> static const double *take(const double *words, T &value)
  {
    memcpy(&value, words, sizeof(value));
    return words + sizeof(value) / sizeof(double);
  }

  static bool precedes(const Bond &a, const Bond &b) { return a.partner < b.partner; }

  void changed()
  {
    static long last = 0;
    version_now = ++last;
  }
};

/// Looks the records of one atom up by partner, for neighbor after neighbor.
///
/// Neighbor lists hardly change their order from one build to the next, so that the slots that the
/// last list found, in its order, mostly name the next one: one comparison then finds it.
class RecordFinder {
 public:
  static constexpr int NO_SLOT = -1;

  /// Slots that are expected next, in this order; any numbers will do. *end is NO_SLOT.
  struct Hints {
    const int *begin, *end;
  };

  RecordFinder(const BondStore::Bonds &records_in, Hints hints_in) :
      records(records_in.data()), n((int) records_in.size()), hints(hints_in)
  {
  }

  /// Slot of the record with that partner, -1 if there is none. Asked again, as for another image of
  /// the same partner, it is found again.
  int find(int64_t partner)
  {
    const int slot = *hints.begin;
    if ((unsigned) slot < (unsigned) n && records[slot].partner == partner) {
      hints.begin++;
      return slot;
    }
    return n ? search(partner) : -1;
  }

 private:
  const Bond *const records;
  const int n;
  Hints hints;
  int search(int64_t partner)
  {
    const Bond *const at = BondStore::find(records, records + n, partner);
    if (!at) return -1;
    const int slot = (int) (at - records);
    const int *const near_end = hints.begin + std::clamp<ptrdiff_t>(hints.end - hints.begin, 0, 64);
    const int *const hint = std::find(hints.begin, near_end, slot);
    if (hint != near_end) hints.begin = hint + 1;
    return slot;
  }
};

}    // namespace EVP
