// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/bonds/bond_recording.h"

#include "lammps/base/atom_directory.h"
#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/pairs/pair_data.h"

#include "comm.h"
#include "domain.h"
#include "fix.h"
#include "neigh_list.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <unordered_map>

namespace EVP {

/// Of R_i + R_j: parts that are cut out of one packing overlap by less, as its spheres touch within 0.2 %.
constexpr double SLIGHT_OVERLAP = 0.005;

std::string remedy_of_images(const Fix *fix)
{
  return fmt::format(
      "reduce alpha, or enlarge the box: 'unfix {}', replicate, and define the fix again", fix->id);
}

void BondRecording::record_zone(const NeighList *list, double zone_in, const PairData *pair_data,
                                WithPerAtomComm<Fix> &exchange, const BondStore *store)
{
  zone = zone_in;
  source = zone > 0.0 ? fmt::format("within {} (R_i + R_j)", zone) : "within alpha (R_i + R_j)";
  const int nall = atom->nlocal + atom->nghost;
  AtomValues owner_x(3, nall);
  for (int i = 0; i < atom->nlocal; i++) std::copy_n(atom->x[i], 3, owner_x[i]);
  exchange.forward_comm(owner_x);
  AtomValues shifts(3, nall);    // whole periodic vectors
  exchange.forward_comm_images(shifts, domain->h);

  AtomValues takes(1, nall, 1.0);    // one of the pair must be so
  for (int i = 0; store && i < atom->nlocal; i++) takes[i][0] = store->is_unseen(i);
  if (store) exchange.forward_comm(takes);

  made.resize(atom->nlocal);
  remembered.resize(atom->nlocal);
  inside.resize(atom->nlocal);
  const PairRules &rules = pair_data->rules();
  const double reach = store && rules.joins() ? APART * rules.join.within : 0.0;
  BondStore::Bonds own;    // of one atom: copies take no more room than they need
  std::string complaint;
  const int *mask = atom->mask;
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    own.clear();
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      if (scene::is_excluded(force, list->firstneigh[i][jj])) continue;
      const int j = list->firstneigh[i][jj] & NEIGHMASK;
      const double alpha = pair_data->alpha_of(atom->type[i], atom->type[j]);
      if (alpha == 0.0 || takes[i][0] + takes[j][0] == 0.0) continue;

      // from either side the same to the last bit, so that both atoms decide alike: the position of a ghost has
      // round-off, which differs between the images of i and of j
      const Vector r = Vector(owner_x[j]) - Vector(owner_x[i]) + Vector(shifts[j]);
      const double dsq = dot(r, r);
      const double sum_radii = atom->radius[i] + atom->radius[j];
      const double zone_here = (zone > 0.0 ? zone : alpha) * sum_radii;
      if (dsq <= reach * sum_radii * (reach * sum_radii))
        inside[i].push_back({atom->tag[j], sum_radii, Remembered::INSIDE});
      if (!(mask[i] & mask[j] & fix->groupbit)) continue;
      if (dsq > cutoff_squared(zone_here, RECORD_MARGIN)) continue;
      if (in_different_bodies(atom, within, i, j)) {
        if (dsq < cutoff_squared(sum_radii, -RECORD_MARGIN)) overlaps++;
        deepest = std::max(deepest, 1.0 - std::sqrt(dsq) / sum_radii);
        continue;
      }
      const double coincident = COINCIDENT * sum_radii;
      if (!(dsq > coincident * coincident) && complaint.empty())
        complaint =
            fmt::format("atoms {} and {} coincide: move one or delete it (delete_atoms overlap)",
                        atom->tag[i], atom->tag[j]);
      own.push_back({atom->tag[j], std::sqrt(dsq)});
    }
    made[i] = own;
  }
  throw_together(complaint, world);
  overlaps = reduce_all(overlaps, MPI_SUM, world) / 2;    // both atoms see a pair
  deepest = reduce_all(deepest, MPI_MAX, world);
  special = reduce_all(count_special(pair_data), MPI_SUM, world) / 2;
  throw_together(find_bond_twice(""), world);
}

// Sides of the pairs within the zone that LAMMPS leaves out of its neighbor lists, as their special_bonds weight is 0
bigint BondRecording::count_special(const PairData *pair_data) const
{
  bigint count = 0;
  for (int i = 0; atom->nspecial && atom->map_style != Atom::MAP_NONE && i < atom->nlocal; i++) {
    const int *const ends = atom->nspecial[i];    // of 1-2, 1-3 and 1-4 neighbors
    for (int k = 0; k < ends[2]; k++) {
      if (force->special_lj[1 + (k >= ends[0]) + (k >= ends[1])] != 0.0) continue;
      const int j = domain->closest_image(i, atom->map(atom->special[i][k]));
      if (j < 0 || !(atom->mask[i] & atom->mask[j] & fix->groupbit) ||
          in_different_bodies(atom, within, i, j))
        continue;
      const double reach = zone > 0.0 ? zone : pair_data->alpha_of(atom->type[i], atom->type[j]);
      const PairGeometry g(scene::rows(atom->x), i, j);
      count += g.dsq <= cutoff_squared(reach * (atom->radius[i] + atom->radius[j]), RECORD_MARGIN);
    }
  }
  return count;
}

namespace {

  constexpr int LINES_PER_MESSAGE = 10000;

  /// An atom of a line, all zero where another rank owns it: their sum over the ranks is the atom.
  struct End {
    double in_group, type, molecule;
    bool exists() const { return type > 0.0; }
  };

  constexpr char HAS_FLOWED[] = "it has flowed: use pair_style evp/lj with 'plasticity isotropic', "
                                "as when the file was written";

  /// What is wrong with a bond of these two atoms; empty if nothing.
  std::string complaint_of(const BondLine &line, const End &a, const End &b, const PairRules &rules,
                           BodyRule within)
  {
    if (!a.exists() || !b.exists())
      return fmt::format(
          "there is no atom {}: read the data file that was written with the bond file",
          a.exists() ? line.bond.partner : line.id);
    if (a.in_group == 0.0 || b.in_group == 0.0)
      return fmt::format("atom {} is not in the fix's group: use a group with all bonded atoms",
                         a.in_group == 0.0 ? line.id : line.bond.partner);
    if (line.kind == Remembered::CONTACT && !rules.plastic) return HAS_FLOWED;
    if (line.kind == Remembered::APART && !rules.breaks())
      return "it has broken: use pair_style evp/lj with 'break' and 'plasticity none', as when the "
             "file was written";
    const bool are_one_body = within == BodyRule::ALL ||
        (within == BodyRule::TYPE && a.type == b.type) ||
        (within == BodyRule::MOLECULE && a.molecule == b.molecule && a.molecule != 0.0);
    if (line.is_bond() && !are_one_body && !(rules.joins() && rules.join.all))
      return fmt::format("its atoms are not of one {0}, but 'within {0}' is in force: give them "
                         "the {0}s that they had when the file was written, or leave 'within' out "
                         "here and WITHIN: in the header",
                         BODY_RULES[(int) within]);
    return "";
  }

}    // namespace

void BondRecording::record_file(const std::string &name, const PairRules &rules)
{
  source = "from file " + name;
  const int me = comm->me;
  std::ifstream stream;    // these two on the first rank
  std::unique_ptr<BondReader> reader;
  std::unordered_map<int64_t, int> own;    // local index by ID
  for (int i = 0; i < atom->nlocal; i++) own[atom->tag[i]] = i;

  made.resize(atom->nlocal);
  remembered.resize(atom->nlocal);
  std::vector<char> has_line(atom->nlocal, 0);
  bigint nspheres = 0;    // of the file so far
  std::vector<BondLine> lines;
  std::vector<SphereLine> sphere_lines;
  std::vector<double> packed;    // these: IDs and values
  // more to come; pairs and spheres of this message; bodies of the file
  bigint state[] = {1, 0, 0, 0};
  while (state[0]) {
    lines.clear();
    sphere_lines.clear();
    std::string complaint;
    try {
      if (me == 0 && !reader) {
        stream.open(name, std::ios::binary);
        if (!stream) throw BadInput("cannot read the bond file '" + name + "': give its path");
        reader = std::make_unique<BondReader>(stream, name, update->unit_style);
        state[3] = (bigint) reader->header.within;
        zone = reader->header.zone;
        counts = reader->header.counts;
        joins_by = reader->header.joins_by;
        of_file = reader->header.measures;
        columns = reader->header.columns;
      }
      if (me == 0) state[0] = reader->read(lines, sphere_lines, LINES_PER_MESSAGE);
    } catch (const BadInput &bad) {
      complaint = bad.what();
    }
    state[1] = (bigint) lines.size();
    state[2] = (bigint) sphere_lines.size();
    throw_together(complaint, world);
    MPI_Bcast(state, 4, MPI_LMP_BIGINT, 0, world);
    MPI_Bcast(&zone, 1, MPI_DOUBLE, 0, world);
    MPI_Bcast(&counts, sizeof(counts), MPI_BYTE, 0, world);
    MPI_Bcast(&joins_by, sizeof(joins_by), MPI_BYTE, 0, world);
    int sizes[] = {(int) of_file.size(), (int) columns.size()};
    MPI_Bcast(sizes, 2, MPI_INT, 0, world);
    of_file.resize(sizes[0]);
    columns.resize(sizes[1]);
    MPI_Bcast(of_file.data(), sizes[0], MPI_DOUBLE, 0, world);
    MPI_Bcast(columns.data(), sizes[1], MPI_CHAR, 0, world);
    const std::vector<std::string> names = split_columns(columns);
    if (within == BodyRule::ALL) within = (BodyRule) state[3];
    if (within == BodyRule::MOLECULE) {
      const std::string missing = missing_molecules(lmp);
      if (!missing.empty()) throw BadInput(missing);
    }
    lines.resize(state[1]);
    MPI_Bcast(lines.data(), (int) (lines.size() * sizeof(BondLine)), MPI_BYTE, 0, world);
    packed.clear();
    for (const SphereLine &sphere : sphere_lines) {
      packed.push_back(bits_as<double>(sphere.id));
      packed.insert(packed.end(), sphere.values.begin(), sphere.values.end());
    }
    packed.resize(state[2] * (1 + names.size()));
    MPI_Bcast(packed.data(), (int) packed.size(), MPI_DOUBLE, 0, world);

    std::vector<End> ends_here(2 * lines.size(), End{}), ends(2 * lines.size());
    for (size_t k = 0; k < ends.size(); k++) {
      const BondLine &line = lines[k / 2];
      const auto at = own.find(k % 2 ? line.bond.partner : line.id);
      if (at == own.end()) continue;
      const int i = at->second;
      ends_here[k] = {atom->mask[i] & fix->groupbit ? 1.0 : 0.0, (double) atom->type[i],
                      atom->molecule ? (double) atom->molecule[i] : 0.0};
      BondRecord bond = line.bond;
      if (k % 2) bond.partner = line.id;
      if (line.is_bond()) made[i].push_back(bond);
      if (line.kind != BondLine::BOND) remembered[i].push_back({bond.partner, bond.deq, line.kind});
    }
    MPI_Allreduce(ends_here.data(), ends.data(), (int) (3 * ends.size()), MPI_DOUBLE, MPI_SUM,
                  world);

    for (size_t k = 0; k < lines.size(); k++) {    // on all ranks, which throw together
      const std::string bad = complaint_of(lines[k], ends[2 * k], ends[2 * k + 1], rules, within);
      if (!bad.empty())
        throw BadInput(fmt::format("bond {} {}: {} (bond file {})", lines[k].id,
                                   lines[k].bond.partner, bad, name));
    }

    nspheres += state[2];
    const size_t work = std::find(names.begin(), names.end(), "plastic_work") - names.begin();
    const double *sphere = packed.data();
    for (bigint k = 0; k < state[2]; k++, sphere += 1 + names.size()) {
      const auto sphere_id = bits_as<int64_t>(sphere[0]);
      const double *const values = sphere + 1;
      if (work < names.size() && values[work] > 0.0 && !rules.plastic)
        throw BadInput(fmt::format("sphere {}: {} (bond file {})", sphere_id, HAS_FLOWED, name));
      const auto at = own.find(sphere_id);
      if (at != own.end() && !std::exchange(has_line[at->second], 1))
        spheres.push_back({at->second, {values, values + names.size()}});
    }
  }
  throw_together(find_bond_twice(name), world);

  if (reduce_all((bigint) spheres.size(), MPI_SUM, world) != nspheres)
    throw BadInput("a line 'sphere ...' names an atom that is not there, or twice: read the data "
                   "file that was written with the bond file (bond file " +
                   name + ")");
}

// a partner that is there twice has two deq
std::string BondRecording::find_bond_twice(const std::string &file) const
{
  for (int i = 0; i < atom->nlocal; i++) {
    std::vector<int64_t> partners;
    for (const BondRecord &bond : made[i]) partners.push_back(bond.partner);
    for (const Remembered &one : remembered[i])
      if (one.kind != Remembered::JOINED) partners.push_back(one.partner);
    std::sort(partners.begin(), partners.end());
    const auto twice = std::adjacent_find(partners.begin(), partners.end());
    if (twice == partners.end()) continue;
    const int64_t own = atom->tag[i], low = std::min(own, *twice), high = std::max(own, *twice);
    if (!file.empty()) return fmt::format("bond {} {} is given twice in file {}", low, high, file);
    return fmt::format("it meets atoms {} and {} in two periodic images: the box must be longer "
                       "than two cutoffs: {}",
                       low, high, remedy_of_images(fix));
  }
  return "";
}

void BondRecording::give_to(BondStore &store)
{
  int64_t highest = 0, sides = 0;    // ID, records of all
  for (int i = 0; i < atom->nlocal; i++) {
    highest = std::max(highest, (int64_t) atom->tag[i]);
    most = std::max(most, (int64_t) made[i].size());
    sides += (int64_t) made[i].size();
    loose +=
        within == BodyRule::MOLECULE && atom->mask[i] & fix->groupbit && atom->molecule[i] == 0;
  }
  loose = reduce_all(loose, MPI_SUM, world);
  most = reduce_all(most, MPI_MAX, world);
  highest = reduce_all(highest, MPI_MAX, world);
  sides = reduce_all(sides, MPI_SUM, world);

  store.within = within;
  store.zone = zone;
  if (!of_file.empty()) {    // the box may have other types beyond those of the file
    of_file.resize(BondMeasures::words_of(atom->ntypes), 0.0);
    store.measures.unpack(of_file.data(), atom->ntypes);
  }
  store.record(made, atom->tag, sides / 2 + counts.ended - counts.begun, highest);
  if (store.has_history()) {
    if (comm->me == 0) store.set_counts(counts);
    store.joins_by = joins_by;
    for (size_t i = 0; i < remembered.size(); i++) store.remembered_of((int) i) = remembered[i];
  }
  give_values(store);
}

// Collective. Those of spheres that are kept here
void BondRecording::give_values(BondStore &store) const
{
  const std::vector<std::string> names = split_columns(columns);
  for (size_t k = 0; k < names.size(); k++) {
    const bool are_given = names[k] == GivenStrain::TABLE[0].name;
    bool any_given = false;
    for (const auto &[i, values] : spheres)
      any_given = any_given || (are_given && values[k] >= 0.0);
    if (on_any(any_given, world)) store.keep_given(true);
    const BondStore::Place place = store.find_value(names[k]);
    for (const auto &[i, values] : spheres)
      if (place && !(are_given && store.given(i) >= 0.0))    // by fix_modify since, which is later
        place.of(i) = values[k];
  }
}

void BondRecording::add_to(BondStore &store, bool takes) const
{
  int64_t highest = store.highest_id();
  std::array<bigint, 2> counts{};    // atoms that are new; sides of pairs
  for (int i = 0; i < atom->nlocal; i++) {
    const bool is_new = store.is_unseen(i);
    highest = std::max(highest, (int64_t) atom->tag[i]);
    if (is_new) store.leave_loose(i, atom->tag[i]);
    if (takes && (atom->mask[i] & fix->groupbit) && (is_new || !made[i].empty())) {
      counts[0] += is_new;
      counts[1] += (bigint) made[i].size();
      store.add(i, atom->tag[i], made[i]);
    }
    for (const Remembered &one : inside[i])
      if (!store.find(i, one.partner)) store.remembered_of(i).push_back(one);
  }
  counts = reduce_all(counts, MPI_SUM, world);
  store.note_added(counts[1] / 2, reduce_all(highest, MPI_MAX, world));
  if (comm->me == 0 && counts[0] > 0)
    utils::logmesg(lmp, "fix evp/bonds {}: recorded {} pairs {} of {} new atoms at step {}\n",
                   fix->id, counts[1] / 2, source, counts[0], update->ntimestep);
}

void BondRecording::report(const BondStore &store, bool bodies_repel) const
{
  if (comm->me) return;
  if (overlaps && bodies_repel) {
    const std::string what =
        fmt::format("{} pairs of two bodies overlap at the start, and repel each other from the "
                    "first step on, the deepest by {:.2g} of R_i + R_j",
                    overlaps, deepest);
    if (deepest > SLIGHT_OVERLAP)
      error->warning(FLERR, "{}: {}: move the bodies apart if that is not meant", who, what);
    else
      utils::logmesg(lmp, "fix evp/bonds {}: {}\n", fix->id, what);
  }
  if (special)
    error->warning(FLERR,
                   "{}: {} pairs within reach are not recorded, as special_bonds gives them the "
                   "weight 0: use 'special_bonds lj 1 1 1' before the first run, or no bonds of "
                   "LAMMPS, if they are to be bonds of this fix",
                   who, special);
  const std::string bodies =
      within == BodyRule::ALL ? "" : fmt::format(" and within {}", BODY_RULES[(int) within]);
  utils::logmesg(lmp, "fix evp/bonds {}: recorded {} pairs {}{}, at most {} per atom\n", fix->id,
                 store.count(), source, bodies, most);
  if (loose)
    utils::logmesg(lmp, "fix evp/bonds {}: {} atoms of molecule ID 0 belong to no body\n", fix->id,
                   loose);
}

BondMeasures measure_bonds(LAMMPS *lmp, const BondStore &store)
{
  const Atom *atom = lmp->atom;
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (const BondRecord &bond : store.of(i)) partners.push_back((tagint) bond.partner);
  const AtomDirectory directory(lmp, partners);

  BondCensus census(atom->ntypes);
  for (int i = 0; i < atom->nlocal; i++) {
    const BondStore::Bonds &bonds = store.of(i);
    if (bonds.empty()) continue;
    census.add_particle(atom->type[i], bonds.size());
    for (const BondRecord &bond : bonds) {
      const int type = directory.entries.at((tagint) bond.partner).type;
      if (type) census.add_bond(atom->type[i], type, bond.deq);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, census.sums.data(), (int) census.sums.size(), MPI_DOUBLE, MPI_SUM,
                lmp->world);
  return census.measures();
}

}    // namespace EVP
