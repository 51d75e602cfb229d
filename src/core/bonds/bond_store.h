// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"
#include "core/law/bond_measures.h"
#include "core/law/limit.h"
#include "core/pairs/contacts.h"
#include "core/pairs/pairs.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace EVP {

/// A recorded pair, as one of its atoms keeps it.
struct BondRecord {
  int64_t partner;    ///< ID of the other atom
  double deq;         ///< distance at recording [length]
};

/// What a pair remembers beside the record of a bond, or without one: as one of its atoms keeps it.
struct Remembered {
  enum Kind : int64_t {
    CONTACT,    ///< repels below its deq, as it has flowed: until it has been beyond R_i + R_j
    APART,      ///< what is left of a bond of eq. 8 that broke: repels below its deq, for good
    INSIDE,    ///< the same as a contact, and may become a bond once it has been apart: see PairRules
    JOINED    ///< a bond that began, beside its record: in the volume energy it is as a pair without a bond
  };
  int64_t partner;
  double deq;    ///< [length]
  int64_t kind;
};
constexpr const char *REMEMBERED[] = {"contact", "apart", "inside", "joined"};    ///< for users

/// Bonds that have changed since the recording.
struct BondCounts {
  int64_t ended = 0;     ///< for good
  int64_t failed = 0;    ///< of these, at a strain; the others passed dlim
  int64_t begun = 0;
};

/// What a sphere keeps beside its pairs.
struct Sphere {
  double p;           ///< plastic strain
  double work;        ///< half of what its pairs have dissipated by flow [energy]
  double slip;        ///< of its bonds, that p does not have yet: see FlowSums
  double bonds;       ///< how many it had when p last moved on
  double recorded;    ///< how many were recorded

  /// Takes the slips of its bonds into p; bonds_now: how many it has. Without any they are dropped.
  void move_on(double bonds_now)
  {
    if (bonds > 0.0) p += slip / (bonds * SLIP_PER_STRAIN);
    slip = 0.0;
    bonds = bonds_now;
  }

  /// Is it as at the recording of this many bonds?
  bool is_new(size_t bonds_now) const
  {
    return p == 0.0 && work == 0.0 && slip == 0.0 && bonds == (double) bonds_now &&
        recorded == (double) bonds_now;
  }
};

/// The density of the neighbors of a particle, rho = sum t^2 with t = 1 - d/dlim over the pairs within
/// dlim, and how it falls with a volume strain that is the same everywhere, G = 1/3 sum 2 t d/dlim.
struct NeighborDensity {
  double rho, slope;

  void add(double d, double dlim)
  {
    const double t = std::max(0.0, 1.0 - d / dlim);
    rho += t * t;
    slope += 2.0 / 3.0 * t * d / dlim;
  }
};

/// What of a particle is known at rest, by its bonds.
struct VolumeReference {
  NeighborDensity own;
  double gap;           ///< by how much its density is below the mean of the interior, else 0
  double torn;          ///< bits: see Torn
  double lost = 0.0;    ///< what pairs that pull no more have added to the gap of new pairs

  enum Torn {
    BROKEN = 1,    ///< bonds have broken here: its new pairs do not pull on it
    OPEN = 2       ///< by its strain, where bonds flow: its new pairs do not pull, on either atom
  };
  bool is_torn() const { return ((int) torn & (BROKEN | OPEN)) != 0; }
  bool is(Torn bit) const { return ((int) torn & bit) != 0; }
  void set(Torn bit, bool on = true) { torn = on ? (int) torn | bit : (int) torn & ~bit; }
};

/// What a sphere keeps for fix evp/volume. All 0 where it has no bond.
struct VolumeRecord {
  VolumeReference reference;    ///< as of when the bonds were first seen, less those that have left
  NeighborDensity at_rest;      ///< of the bonds that have not, at their deq of now
  /// Counts the times that references were taken, of this one from 1; 0 without. A bond counts for a sphere if its partner
  /// was there at that time: one that comes later changes nothing of it.
  double batch = 0.0;
  double strain = 0.0;    ///< by the forces of the last step, with plasticity

  bool is_known() const { return batch > 0.0; }
};

/// What the references were taken for. Empty where they have not been taken.
struct VolumeScene {
  std::vector<double> reaches;    ///< of pairs of types, i <= j: dlim, or the zone, over R_i + R_j
  /// Rules by which pairs are kept out of the neighbor list: kind, two numbers and one.
  using Exclusion = std::array<double, 3>;
  std::vector<Exclusion> exclusions;    ///< in ascending order

  // for restart files

  static constexpr size_t WORDS = 3;    ///< of an exclusion
  static size_t words_of(int ntypes) { return 1 + (size_t) ntypes * (ntypes + 1) / 2; }

  /// 1, or 0 where there are none, and the reaches.
  std::vector<double> words_of_reaches(int ntypes) const
  {
    std::vector<double> words = {reaches.empty() ? 0.0 : 1.0};
    words.insert(words.end(), reaches.begin(), reaches.end());
    words.resize(words_of(ntypes), 0.0);
    return words;
  }
  std::vector<double> words_of_exclusions() const
  {
    std::vector<double> words;
    for (const Exclusion &one : exclusions) words.insert(words.end(), one.begin(), one.end());
    return words;
  }

  /// Takes these words, of a body of that many types and of n exclusions.
  void unpack(const double *of_reaches, int ntypes, const double *of_exclusions, size_t n)
  {
    reaches.assign(of_reaches + 1, of_reaches + (of_reaches[0] != 0.0 ? words_of(ntypes) : 1));
    exclusions.resize(n);
    for (size_t k = 0; k < n; k++)
      std::copy_n(of_exclusions + WORDS * k, WORDS, exclusions[k].begin());
  }
};

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

  explicit BondStore(bool with_history_in = false) : with_history(with_history_in) { changed(); }

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

  /// What fix evp/volume took the references for: see VolumeForces.
  VolumeScene volume_scene;

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

  /// Do bonds flow or end? Starts or drops what is kept of that.
  bool has_history() const { return with_history; }
  void keep_history(bool keep)
  {
    if (keep == with_history) return;
    with_history = keep;
    spheres.clear();
    remembered.clear();
    counted = {};
    joins_by = {};
    grow((int) bonds.size());
    changed();
  }

  /// Are there references for fix evp/volume? Starts or drops them.
  bool has_volume() const { return with_volume; }
  void keep_volume(bool keep)
  {
    if (keep == with_volume) return;
    with_volume = keep;
    volumes.assign(keep ? bonds.size() : 0, VolumeRecord{});
    if (!keep) forget_joined();
    volume_scene = {};
  }

  /// Do plastic strains that were given to atoms wait for their limits to move? The same on all MPI ranks. Starts or drops them.
  bool has_given() const { return with_given; }
  void keep_given(bool keep)
  {
    if (keep == with_given) return;
    with_given = keep;
    given_strains.assign(keep ? bonds.size() : 0, NOT_GIVEN);
  }
  double &given(int i) { return given_strains[i]; }
  double given(int i) const { return with_given ? given_strains[i] : NOT_GIVEN; }
  static constexpr double NOT_GIVEN = -1.0;

  VolumeRecord &volume(int i) { return volumes[i]; }
  const VolumeRecord &volume(int i) const { return volumes[i]; }

  /// Has any bond of these local atoms flowed?
  bool has_flowed(int nlocal) const
  {
    return with_history &&
        std::any_of(spheres.begin(), spheres.begin() + nlocal, [](const Sphere &own) {
             return own.work > 0.0 || own.p > 0.0;
           });
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
      if (with_volume) volumes[i] = {};
      if (!with_history) continue;
      const auto n = (double) bonds[i].size();
      spheres[i] = {0.0, 0.0, 0.0, n, n};
      remembered[i].clear();
    }
    volume_scene = {};
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
    *this = BondStore(with_history);
    closed = true;
  }
  bool is_closed() const { return closed; }

  const Bonds &of(int i) const { return bonds[i]; }

  /// What a sphere keeps; with history only.
  Sphere &sphere(int i) { return spheres[i]; }
  const Sphere &sphere(int i) const { return spheres[i]; }

  /// Pairs of an atom that are no bonds, but remember; with history only.
  std::vector<Remembered> &remembered_of(int i) { return remembered[i]; }
  const std::vector<Remembered> &remembered_of(int i) const { return remembered[i]; }

  /// Bonds that began count as others from now on: their spheres have taken references of all.
  void forget_joined()
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
    if (!with_history) return nullptr;
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
    if (!with_history) return;
    spheres[i].bonds += (double) more.size();
    spheres[i].recorded += (double) more.size();
  }

  /// After these, over all MPI ranks: how many more pairs, and the highest ID now.
  void note_added(int64_t npairs_more, int64_t highest_now)
  {
    npairs += npairs_more;
    highest = highest_now;
    changed();
  }

  /// deq of a bond of atom i has moved, or it may have ended since.
  void move(int i, int64_t partner, double deq)
  {
    if (const BondRecord *const bond = find(i, partner)) bonds[i][bond - bonds[i].data()].deq = deq;
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
    if (!erase(i, partner) || !with_history || !(spheres[i].bonds > 0.0)) return;
    Sphere &own = spheres[i];
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
    if (with_volume) volumes.resize(natoms);
    if (with_given) given_strains.resize(natoms, NOT_GIVEN);
    if (!with_history) return;
    const size_t had = spheres.size();
    remembered.resize(natoms);
    spheres.resize(natoms);
    for (size_t i = had; i < spheres.size(); i++) {
      const auto n = (double) bonds[i].size();
      spheres[i] = {0.0, 0.0, 0.0, n, n};
    }
  }
  void copy(int from, int to)
  {
    if (from == to) return;
    recorded_as[to] = recorded_as[from];
    bonds[to] = bonds[from];
    if (with_volume) volumes[to] = volumes[from];
    if (with_given) given_strains[to] = given_strains[from];
    if (!with_history) return;
    spheres[to] = spheres[from];
    remembered[to] = remembered[from];
  }

  /// A new atom has no records.
  void clear(int i)
  {
    recorded_as[i] = 0;
    bonds[i].clear();
    if (with_volume) volumes[i] = {};
    if (with_given) given_strains[i] = NOT_GIVEN;
    if (!with_history) return;
    spheres[i] = {};
    remembered[i].clear();
  }

  /// Words of an atom: own ID, number of bonds, partner and deq of each; with history what the sphere keeps, the number of
  /// pairs that remember, and these; with references these; with given strains that.
  size_t words_of(int i) const
  {
    const size_t words = 2 + 2 * bonds[i].size() + further_words();
    return with_history ? words + SPHERE + 1 + 3 * remembered[i].size() : words;
  }

  /// The same words for migration and restart; integers travel as bits. Returns their number.
  int pack(int i, double *buf) const
  {
    double *at = put(recorded_as[i], buf);
    at = put((int64_t) bonds[i].size(), at);
    for (const BondRecord &bond : bonds[i]) at = put(bond, at);
    if (with_history) {
      at = put(spheres[i], at);
      at = put((int64_t) remembered[i].size(), at);
      for (const Remembered &one : remembered[i]) at = put(one, at);
    }
    if (with_volume) at = put(volumes[i], at);
    if (with_given) at = put(given_strains[i], at);
    return (int) (at - buf);
  }
  /// Do the counts among the words of an atom make n words?
  bool fits(const double *words, size_t n) const
  {
    const size_t bonds = n > 1 ? (size_t) bits_as<uint64_t>(words[1]) : n;
    if (bonds >= n || n < further_words()) return false;
    n -= further_words();
    const size_t size = 2 + 2 * bonds + (with_history ? SPHERE : 0);
    if (!with_history || size >= n) return !with_history && size == n;
    const size_t others = (size_t) bits_as<uint64_t>(words[size]);
    return others < n && size + 1 + 3 * others == n;
  }
  int unpack(int i, const double *buf)
  {
    int64_t n = 0;
    const double *at = unpack(unpack(buf, recorded_as[i]), n);
    bonds[i].resize(n);
    for (BondRecord &bond : bonds[i]) at = unpack(at, bond);
    if (with_history) {
      at = unpack(unpack(at, spheres[i]), n);
      remembered[i].resize(n);
      for (Remembered &one : remembered[i]) at = unpack(at, one);
    }
    if (with_volume) at = unpack(at, volumes[i]);
    if (with_given) at = unpack(at, given_strains[i]);
    return (int) (at - buf);
  }

  double memory_usage() const
  {
    double bytes = bytes_of(bonds, recorded_as, spheres, remembered, volumes, given_strains);
    for (const Bonds &own : bonds) bytes += bytes_of(own);
    for (const auto &own : remembered) bytes += bytes_of(own);
    return bytes;
  }

 private:
  bool with_history, with_volume = false, with_given = false;
  long version_now;
  bool recorded = false, closed = false;
  int64_t npairs = 0, highest = 0;
  BondCounts counted;

  // per atom
  std::vector<int64_t> recorded_as;    // ID, negative of those that were left loose; 0: unseen
  std::vector<Bonds> bonds;
  std::vector<Sphere> spheres;                        // with history only
  std::vector<std::vector<Remembered>> remembered;    // with history only

  std::vector<VolumeRecord> volumes;    // with references for fix evp/volume only
  std::vector<double> given_strains;    // with given strains only; NOT_GIVEN for the other atoms

  static constexpr size_t SPHERE = sizeof(Sphere) / sizeof(double),
                          VOLUME = sizeof(VolumeRecord) / sizeof(double);

  size_t further_words() const { return (with_volume ? VOLUME : 0) + (with_given ? 1 : 0); }

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
