// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/seal.h"
#include "core/base/simd.h"
#include "core/bonds/bond_record.h"
#include "core/bonds/sphere_table.h"
#include "core/law/bond_measures.h"
#include "core/pairs/contacts.h"
#include "core/pairs/pairs.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace EVP {

/// The records of the bonds: those of each local atom, in the order of the partners' IDs.
///
/// A pair is kept on both of its atoms, equal to the last bit, so that whichever MPI rank meets it
/// finds deq without communication. Of eq. 8 a deq never changes (paper 2.2). Where bonds flow or end, what a sphere keeps,
/// and the pairs that are no bonds but remember, are beside them, and travel with them.
///
/// The index of a bond among the records of its atom is its slot, valid until that atom moves to
/// another local index.
class BondStore {
 public:
  using Bonds = std::vector<BondRecord>;

  explicit BondStore(bool with_history = false)
  {
    if (with_history) start(Sphere::NAME, table_of<Sphere>());
    changed();
  }
  BondStore(BondStore &&) = default;
  BondStore &operator=(BondStore &&) = default;

  /// Differs between all states of all stores: once it has changed, what was looked up is void. Atoms
  /// that come and go do not change it, as new neighbor lists follow.
  long version() const { return version_now; }

  bool has_recorded() const { return recorded; }

  /// Pairs recorded, over all MPI ranks.
  int64_t count() const { return npairs; }

  /// Those that this MPI rank has counted: their atoms may have gone since.
  const BondCounts &counts() const { return counted; }
  void set_counts(const BondCounts &counts) { counted = counts; }

  /// By which PairRules::join it was found what keeps pairs from joining; within 0: by none.
  JoinRule joins_by;

  /// Of all atoms at the recording: atoms that came later have higher IDs.
  int64_t highest_id() const { return highest; }

  /// What the records say of the pairs of types, empty where nobody needed it. Taken once: types and
  /// atoms that change later do not change it.
  BondMeasures measures;

  /// What an effect keeps of all atoms together, by the name of its table. The same on all MPI ranks.
  std::map<std::string, std::vector<double>> words;

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

  // What spheres keep: a group of values for each effect that acts. The same groups on all MPI ranks

  template <class Record> bool has() const { return groups.count(Record::NAME) > 0; }

  /// Starts or drops the values of an effect.
  template <class Record> void keep(bool keeps)
  {
    if (!keeps) return drop(Record::NAME);
    if (!has<Record>()) start(Record::NAME, table_of<Record>());
    groups.at(Record::NAME)->claimed = true;
  }

  /// Those of an effect that is kept.
  template <class Record> SphereRecords<Record> columns()
  {
    return SphereRecords<Record>(groups.at(Record::NAME));
  }
  template <class Record> SphereRecords<const Record> columns() const
  {
    return SphereRecords<const Record>(groups.at(Record::NAME));
  }

  using Groups = std::map<std::string, std::shared_ptr<SphereGroup>>;
  const Groups &all_groups() const { return groups; }

  /// A value by its name, whoever keeps it: place of it among those of an atom. No group if nobody does.
  struct Place {
    SphereGroup *group = nullptr;
    size_t k = 0;
    explicit operator bool() const { return group != nullptr; }
    double &of(int i) const { return group->of(i)[k]; }
  };
  Place find_value(const std::string &name) const
  {
    for (const auto &[effect, group] : groups)
      for (size_t k = 0; k < group->lines.size(); k++)
        if (name == group->lines[k].name) return {group.get(), k};
    return {};
  }

  /// Drops the values of effects that have not kept them since the last call.
  void drop_unclaimed()
  {
    std::vector<std::string> unclaimed;
    for (const auto &[name, group] : groups)
      if (!std::exchange(group->claimed, false) && name != Sphere::NAME &&
          name != GivenStrain::NAME)
        unclaimed.push_back(name);
    for (const std::string &name : unclaimed) drop(name);
  }

  /// Must bonds that began be told from others?
  bool notes_joined() const
  {
    return std::any_of(groups.begin(), groups.end(), [](const auto &one) {
      return one.second->needs & JOINED_BONDS;
    });
  }

  /// Do bonds flow or end? Starts or drops what is kept of that.
  bool has_history() const { return (bool) history; }
  void keep_history(bool keeps)
  {
    if (keeps == has_history()) return;
    keep<Sphere>(keeps);
    counted = {};
    joins_by = {};
    changed();
  }

  /// Do plastic strains that were given to atoms wait for their limits to move? Starts or drops them.
  bool has_given() const { return (bool) given_strains; }
  void keep_given(bool keeps) { keep<GivenStrain>(keeps); }
  double &given(int i) { return given_strains[i].p; }
  double given(int i) const { return has_given() ? given_strains[i].p : GivenStrain::NONE; }

  /// Has any bond of these local atoms flowed?
  bool has_flowed(int nlocal) const
  {
    bool any = false;
    for (int i = 0; has_history() && i < nlocal; i++)
      any = any || history[i].work > 0.0 || history[i].p > 0.0;
    return any;
  }

  /// Bonds of the first atoms; both atoms of a bond have one.
  int64_t count_sides(int natoms) const
  {
    int64_t count = 0;
    for (int i = 0; i < natoms; i++) count += (int64_t) bonds[i].size();
    return count;
  }

  /// Takes the records of the local atoms, which may be in any order, all or none.
  template <class Tag>
  void record(std::vector<Bonds> &made, const Tag *ids, int64_t npairs_in, int64_t highest_in)
  {
    for (size_t i = 0; i < made.size(); i++) {
      recorded_as[i] = ids[i];
      bonds[i].swap(made[i]);
      std::sort(bonds[i].begin(), bonds[i].end(), precedes);
      // other values may be set before there are bonds
      for (const auto &[name, group] : groups)
        for (size_t k = 0; k < group->lines.size(); k++)
          if (group->lines[k].at_recording == ITS_BONDS)
            group->of((int) i)[k] = (double) bonds[i].size();
      if (has_history()) remembered[i].clear();
    }
    words.clear();
    joins_by = {};
    restore(true, npairs_in, highest_in, {});
  }

  /// Takes what a restart file says of all records; those of the atoms follow by unpack(). counts: on one MPI rank.
  void restore(bool recorded_in, int64_t npairs_in, int64_t highest_in, const BondCounts &counts)
  {
    recorded = recorded_in;
    npairs = npairs_in;
    highest = highest_in;
    counted = counts;
    changed();
  }

  /// Forgets all, as its owner goes: readers that hold on to the store see so.
  void close()
  {
    *this = BondStore(has_history());
    closed = true;
  }
  bool is_closed() const { return closed; }

  const Bonds &of(int i) const { return bonds[i]; }

  /// What a sphere keeps; with history only.
  Sphere &sphere(int i) { return history[i]; }
  const Sphere &sphere(int i) const { return history[i]; }

  /// Pairs of an atom that are no bonds, but remember; with history only.
  std::vector<Remembered> &remembered_of(int i) { return remembered[i]; }
  const std::vector<Remembered> &remembered_of(int i) const { return remembered[i]; }

  /// Bonds that began count as others from now on: their spheres have taken references of all.
  void clear_joined()
  {
    for (auto &own : remembered)
      own.erase(std::remove_if(own.begin(), own.end(),
                               [](const Remembered &one) {
                                 return one.kind == Remembered::JOINED;
                               }),
                own.end());
  }

  /// What a pair of atom i remembers; nullptr if nothing.
  const Remembered *find_remembered(int i, int64_t partner) const
  {
    if (!has_history()) return nullptr;
    for (const Remembered &one : remembered[i])
      if (one.partner == partner) return &one;
    return nullptr;
  }

  /// More bonds of local atom i, which may be new: as if they had been recorded with the others.
  void add(int i, int64_t id, const Bonds &more)
  {
    Bonds &own = bonds[i];
    recorded_as[i] = id;
    own.insert(own.end(), more.begin(), more.end());
    std::sort(own.begin(), own.end(), precedes);
    if (!has_history()) return;
    history[i].bonds += (double) more.size();
    history[i].recorded += (double) more.size();
  }

  /// After these, over all MPI ranks: how many more pairs, and the highest ID now.
  void note_added(int64_t npairs_more, int64_t highest_now)
  {
    npairs += npairs_more;
    highest = highest_now;
    changed();
  }

  /// A value of a bond of atom i has changed, or it may have ended since.
  void set(int i, int64_t partner, double BondRecord::*value, double now)
  {
    if (const BondRecord *const bond = find(i, partner))
      bonds[i][bond - bonds[i].data()].*value = now;
  }

  /// A bond of atom i has ended. The atom with the lower ID counts it.
  void end(int i, int64_t partner, bool failed)
  {
    if (!erase(i, partner) || id_of(i) > partner) return;
    counted.ended++;
    counted.failed += failed;
  }

  /// A bond of atom i begins. The atom with the lower ID counts it.
  void begin(int i, int64_t partner, double deq)
  {
    const BondRecord bond = {partner, deq};
    Bonds &own = bonds[i];
    const auto at = std::lower_bound(own.begin(), own.end(), bond, precedes);
    if (at != own.end() && at->partner == partner) return;
    own.insert(at, bond);
    if (id_of(i) < partner) counted.begun++;
  }

  /// The partner of a bond of atom i was deleted. The slips that wait are those of the bonds that are left.
  void forget(int i, int64_t partner)
  {
    if (!erase(i, partner) || !has_history() || !(history[i].bonds > 0.0)) return;
    Sphere &own = history[i];
    own.slip *= (own.bonds - 1.0) / own.bonds;
    own.bonds -= 1.0;
  }

  /// Did this atom come after the recording?
  bool is_new(int i) const { return recorded_as[i] <= 0; }

  /// Such an atom that nobody has looked at yet, to record it or to leave it loose.
  bool is_unseen(int i) const { return recorded_as[i] == 0; }
  void leave_loose(int i, int64_t id) { recorded_as[i] = -id; }

  /// The bond of a local atom with a partner, nullptr if they were not recorded.
  const BondRecord *find(int i, int64_t partner) const
  {
    return find(bonds[i].data(), bonds[i].data() + bonds[i].size(), partner);
  }

  /// The same among sorted records.
  static const BondRecord *find(const BondRecord *begin, const BondRecord *end, int64_t partner)
  {
    const BondRecord *const at = std::lower_bound(begin, end, BondRecord{partner, 0.0}, precedes);
    return at == end || at->partner != partner ? nullptr : at;
  }

  /// Prefetches the records of an atom that is needed soon, 32 of them at most.
  void prefetch(int i) const
  {
    EVP::prefetch(bonds[i].data(), std::min<size_t>(bonds[i].size(), 32) * sizeof(BondRecord));
  }

  /// How many of these local atoms, those with the bit in their mask, came after the recording.
  int64_t count_new(const int *mask, int bit, int nlocal) const
  {
    int64_t count = 0;
    for (int i = 0; i < nlocal; i++) count += is_new(i) && (mask[i] & bit);
    return count;
  }

  /// ID of a local atom that is not the one recorded under it: it had another ID, or it is new and took that of one that
  /// was deleted. 0 if there is none.
  template <class Tag> int64_t find_misplaced(const Tag *ids, int nlocal) const
  {
    int64_t found = 0;
    for (int i = 0; recorded && i < nlocal; i++)
      if (is_unseen(i) ? ids[i] <= highest : id_of(i) != ids[i]) found = ids[i];
    return found;
  }

  // records as data of atoms: see the functions of a Fix with the same purpose

  void grow(int natoms)
  {
    recorded_as.resize(natoms, 0);
    bonds.resize(natoms);
    for (const auto &[name, group] : groups) grow(*group);
    if (has_history()) remembered.resize(natoms);
  }
  void copy(int from, int to)
  {
    if (from == to) return;
    recorded_as[to] = recorded_as[from];
    bonds[to] = bonds[from];
    for (const auto &[name, group] : groups)
      std::copy_n(group->of(from), group->lines.size(), group->of(to));
    if (has_history()) remembered[to] = remembered[from];
  }

  /// A new atom has no records.
  void clear(int i)
  {
    recorded_as[i] = 0;
    bonds[i].clear();
    for (const auto &[name, group] : groups) group->clear(i, 0);
    if (has_history()) remembered[i].clear();
  }

  /// Words of an atom: own ID, number of bonds, these; with history the number of pairs that remember, and these; the
  /// values of each group.
  size_t words_of(int i) const
  {
    const size_t size = 2 + BOND_WORDS * bonds[i].size() + group_words();
    return has_history() ? size + 1 + REMEMBERED_WORDS * remembered[i].size() : size;
  }

  /// The same words for migration and restart; integers travel as bits. Returns their number.
  int pack(int i, double *buf) const
  {
    double *at = put(recorded_as[i], buf);
    at = put((int64_t) bonds[i].size(), at);
    for (const BondRecord &bond : bonds[i]) at = put(bond, at);
    if (has_history()) {
      at = put((int64_t) remembered[i].size(), at);
      for (const Remembered &one : remembered[i]) at = put(one, at);
    }
    for (const auto &[name, group] : groups)
      at = std::copy_n(group->of(i), group->lines.size(), at);
    return (int) (at - buf);
  }
  /// Do the counts among the words of an atom make n words?
  bool fits(const double *words, size_t n) const
  {
    const size_t bonds = n > 1 ? (size_t) bits_as<uint64_t>(words[1]) : n;
    if (bonds >= n || n < group_words()) return false;
    n -= group_words();
    const size_t size = 2 + BOND_WORDS * bonds;
    if (!has_history() || size >= n) return !has_history() && size == n;
    const size_t others = (size_t) bits_as<uint64_t>(words[size]);
    return others < n && size + 1 + REMEMBERED_WORDS * others == n;
  }
  int unpack(int i, const double *buf)
  {
    int64_t n = 0;
    const double *at = unpack(unpack(buf, recorded_as[i]), n);
    bonds[i].resize(n);
    for (BondRecord &bond : bonds[i]) at = unpack(at, bond);
    if (has_history()) {
      at = unpack(at, n);
      remembered[i].resize(n);
      for (Remembered &one : remembered[i]) at = unpack(at, one);
    }
    for (const auto &[name, group] : groups) {
      std::copy_n(at, group->lines.size(), group->of(i));
      at += group->lines.size();
    }
    return (int) (at - buf);
  }

  // for restart files: which values there are, and the words of the effects

  std::vector<double> pack_groups() const
  {
    std::string text = "bond " + names_of(BOND_VALUES, ",") + "\n";
    for (const auto &[name, group] : groups) text += name + " " + group->columns + "\n";
    std::vector<double> packed;
    put_text(packed, text);
    packed.push_back((double) words.size());
    for (const auto &[name, own] : words) {
      put_text(packed, name);
      packed.push_back((double) own.size());
      packed.insert(packed.end(), own.begin(), own.end());
    }
    return packed;
  }

  /// Keeps these groups, and no others. Throws BadInput where this version keeps other values under a name.
  void unpack_groups(const double *packed)
  {
    while (!groups.empty()) drop(groups.begin()->first);
    std::istringstream text(take_text(packed));
    for (std::string name, columns; text >> name >> columns;) {
      const bool is_bond = name == "bond";
      const auto known = sphere_tables().find(name);
      const std::string here = is_bond     ? names_of(BOND_VALUES, ",")
          : known == sphere_tables().end() ? columns
                                           : names_of(known->second, ",");
      if (here != columns)
        throw BadInput("the restart file has the values " + columns + " of '" + name +
                       "', this version of the package has " + here);
      if (known != sphere_tables().end()) start(name, known->second);
      if (is_bond || known != sphere_tables().end()) continue;
      // of an effect that this plugin does not have
      const std::vector<SphereValue> unknown(1 + std::count(columns.begin(), columns.end(), ','),
                                             {"", "1", 0.0, Range::NOT_IN_FILES, false});
      start(name, {unknown.data(), unknown.size(), NOTHING_ELSE});
      groups.at(name)->columns = columns;
    }
    for (auto n = (size_t) *packed++; n > 0; n--) {
      std::vector<double> &own = words[take_text(packed)];
      const auto size = (size_t) *packed++;
      own.assign(packed, packed + size);
      packed += size;
    }
  }

  double memory_usage() const
  {
    double bytes = bytes_of(bonds, recorded_as, remembered);
    for (const auto &[name, group] : groups) bytes += bytes_of(group->values);
    for (const Bonds &own : bonds) bytes += bytes_of(own);
    for (const auto &own : remembered) bytes += bytes_of(own);
    return bytes;
  }

 private:
  long version_now;
  bool recorded = false, closed = false;
  int64_t npairs = 0, highest = 0;
  BondCounts counted;

  // per atom
  std::vector<int64_t> recorded_as;    // ID, negative of those that were left loose; 0: unseen
  std::vector<Bonds> bonds;
  std::vector<std::vector<Remembered>> remembered;    // with history only

  Groups groups;                    // by name, so that their order is the same everywhere
  SphereRecords<Sphere> history;    // two of them, none where they are not kept
  SphereRecords<GivenStrain> given_strains;

  static constexpr size_t REMEMBERED_WORDS = sizeof(Remembered) / sizeof(double);

  size_t group_words() const
  {
    size_t all = 0;
    for (const auto &[name, group] : groups) all += group->lines.size();
    return all;
  }

  void start(const std::string &name, const SphereTable &table)
  {
    const auto group = std::make_shared<SphereGroup>(
        SphereGroup{names_of(table, ","), {table.begin(), table.end()}, table.needs});
    groups[name] = group;
    note_own_groups();
    grow(*group);
    if (has_history()) remembered.resize(bonds.size());
  }
  void drop(const std::string &name)
  {
    const auto at = groups.find(name);
    if (at == groups.end()) return;
    const bool noted_joined = at->second->needs & JOINED_BONDS;
    groups.erase(at);
    words.erase(name);
    note_own_groups();
    if (!has_history()) remembered.clear();
    if (noted_joined) clear_joined();
  }
  void note_own_groups()
  {
    history = has<Sphere>() ? columns<Sphere>() : SphereRecords<Sphere>();
    given_strains = has<GivenStrain>() ? columns<GivenStrain>() : SphereRecords<GivenStrain>();
  }
  void grow(SphereGroup &group) const
  {
    const size_t width = group.lines.size(), had = group.values.size() / width;
    group.values.resize(width * bonds.size());
    for (size_t i = had; i < bonds.size(); i++) group.clear((int) i, bonds[i].size());
  }

  template <class T> static double *put(const T &value, double *words)
  {
    memcpy(words, &value, sizeof(value));
    return words + sizeof(value) / sizeof(double);
  }
  template <class T> static const double *unpack(const double *words, T &value)
  {
    memcpy((void *) &value, words, sizeof(value));
    return words + sizeof(value) / sizeof(double);
  }

  int64_t id_of(int i) const { return std::abs(recorded_as[i]); }

  bool erase(int i, int64_t partner)
  {
    const BondRecord *const bond = find(i, partner);
    if (bond) bonds[i].erase(bonds[i].begin() + (bond - bonds[i].data()));
    return bond != nullptr;
  }

  static bool precedes(const BondRecord &a, const BondRecord &b) { return a.partner < b.partner; }

  void changed()
  {
    static long last = 0;
    version_now = ++last;
  }
};

}    // namespace EVP
