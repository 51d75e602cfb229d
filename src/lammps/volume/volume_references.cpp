// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/volume/volume_references.h"

#include "lammps/base/atom_directory.h"
#include "lammps/base/collective.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace EVP {

VolumeReferences::Changes
VolumeReferences::pairs_packed(PairData &pair_data, const SphereRecords<VolumeRecord> &records_in)
{
  pairs = &pair_data;
  records = records_in;
  const VolumeScene now = {relative_cutoffs(), exclusions()};
  std::vector<double> &words = store().words[VolumeRecord::NAME];
  const auto then = VolumeScene::of_words(words);
  Changes changes;
  changes.all_set = then.relative_cutoffs != now.relative_cutoffs;
  changes.exclusion_undone = !std::includes(now.exclusions.begin(), now.exclusions.end(),
                                            then.exclusions.begin(), then.exclusions.end());
  if (changes.all_set && !then.relative_cutoffs.empty()) {    // of all bonds that there are
    store().clear_joined();
    std::vector<char> &join = pairs->lists().bonds.join;
    std::fill(join.begin(), join.end(), 0);
  }
  const bigint atoms = sum_of_partners();
  if (std::exchange(partners, atoms) != atoms || changes.all_set) {
    const std::vector<double> to_be = batches_to_be(changes.all_set);
    const std::vector<NeighborDensity> rest = at_rest(to_be);
    const std::vector<char> known = set_references(rest, changes.all_set, to_be);
    if (changes.all_set)
      for (const char one : known) changes.newly_set.push_back(!one);
    for (int i = 0; i < atom->nlocal; i++) lose_partners(records[i], rest[i]);
  }
  words = now.words();
  return changes;
}

std::vector<double> VolumeReferences::relative_cutoffs() const
{
  std::vector<double> all;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      all.push_back(relative_cutoff(pairs->coefficients().row(i, j).alpha));
  return all;
}

// those of neigh_modify exclude
std::vector<VolumeScene::Exclusion> VolumeReferences::exclusions() const
{
  enum { TYPES, GROUPS, MOLECULES };
  const Neighbor *const rules = neighbor;
  std::vector<VolumeScene::Exclusion> all;
  const auto add = [&all](double kind, int a, int b) {
    all.push_back({kind, (double) std::min(a, b), (double) std::max(a, b)});
  };
  for (int k = 0; k < rules->nex_type; k++) add(TYPES, rules->ex1_type[k], rules->ex2_type[k]);
  for (int k = 0; k < rules->nex_group; k++) add(GROUPS, rules->ex1_group[k], rules->ex2_group[k]);
  for (int k = 0; k < rules->nex_mol; k++)
    all.push_back({MOLECULES, (double) rules->ex_mol_group[k], (double) rules->ex_mol_intra[k]});
  std::sort(all.begin(), all.end());
  return all;
}

// Collective. Of the atoms with bonds and their types, whatever the order of atoms and the number of MPI ranks
bigint VolumeReferences::sum_of_partners() const
{
  uint64_t sum = 0;
  for (int i = 0; i < atom->nlocal; i++)
    if (!store().of(i).empty())
      sum += (((uint64_t) atom->tag[i] * 0x9E3779B97F4A7C15ULL) ^
              (0xD6E8FEB86659FD93ULL * (uint64_t) atom->type[i])) >>
          28;    // the sum of 2^27 atoms does not overflow
  return reduce_all((bigint) sum, MPI_SUM, world);
}

// Was it recorded after the references were set? A loose one that has joined since has none, and never counts
bool VolumeReferences::is_new(int i) const
{
  return !records[i].is_known() && !store().of(i).empty() &&
      !(store().has_history() && store().sphere(i).recorded == 0.0);
}

// Collective. Of own atoms, once references have been set; a fix that is new sets those of all, but for those of a bond
// file. 0 of atoms that have none
std::vector<double> VolumeReferences::batches_to_be(bool all_set) const
{
  const bool keeps = !all_set || store().words[VolumeRecord::NAME].empty();
  double last = 0.0;
  for (int i = 0; i < atom->nlocal; i++) last = std::max(last, records[i].batch);
  last = reduce_all(last, MPI_MAX, world);
  std::vector<double> to_be(atom->nlocal, 0.0);
  for (int i = 0; i < atom->nlocal; i++) {
    if (keeps && records[i].is_known())
      to_be[i] = records[i].batch;
    else if (all_set ? !store().of(i).empty() : is_new(i))
      to_be[i] = last + 1.0;
  }
  return to_be;
}

// Collective. The densities of the bonds of each atom at their deq, but for those that began since, or whose partner, on any
// MPI rank, is gone, has another pair style, has no reference or a later one
std::vector<NeighborDensity> VolumeReferences::at_rest(const std::vector<double> &to_be) const
{
  std::vector<tagint> partners;
  for (int i = 0; i < atom->nlocal; i++)
    for (const BondRecord &bond : store().of(i)) partners.push_back((tagint) bond.partner);
  const AtomDirectory directory(lmp, partners, to_be.data());

  std::vector<NeighborDensity> sums(atom->nlocal, NeighborDensity{});
  for (int i = 0; i < atom->nlocal; i++)
    for (const BondRecord &bond : store().of(i)) {
      const AtomDirectory::Entry &partner = directory.entries.at((tagint) bond.partner);
      if (partner.type == 0 || partner.value == 0.0 || partner.value > to_be[i]) continue;
      const Remembered *const kept = store().find_remembered(i, bond.partner);
      if (kept && kept->kind == Remembered::JOINED) continue;
      const double alpha = pairs->coefficients().row(atom->type[i], partner.type).alpha;
      if (alpha > 0.0)
        sums[i].add(bond.deq, relative_cutoff(alpha) * (atom->radius[i] + partner.radius));
    }
  return sums;
}

// Collective. Where bonds have flowed or ended the bond file says what the references were; a fix that is new sets all to
// what they are at the deq of now. Else only those of atoms that are new. Returns which own atoms had theirs
std::vector<char> VolumeReferences::set_references(const std::vector<NeighborDensity> &rest,
                                                   bool all_set, const std::vector<double> &to_be)
{
  std::vector<char> is_known(atom->nlocal, 0);
  bigint unknown = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    VolumeRecord &own = records[i];
    is_known[i] = own.batch == to_be[i] && own.is_known();
    if (all_set || !is_known[i]) own.at_rest = rest[i];
    if (is_known[i]) continue;
    own.reference = {rest[i], 0.0, 0.0};
    own.batch = rest[i].slope > 0.0 ? to_be[i] : 0.0;
    own.strain = 0.0;
    unknown += all_set && store().has_history() && !store().sphere(i).is_new(store().of(i).size());
  }
  set_gaps(is_known);
  unknown = reduce_all(unknown, MPI_SUM, world);
  if (unknown > 0 && comm->me == 0)
    error->warning(FLERR,
                   "{}: the densities at rest of {} atoms whose bonds have flowed or ended are not "
                   "known, and are taken from the bonds of now: define the fix before the first "
                   "run, and right after read_restart",
                   who, unknown);
  return is_known;
}

// Collective. The gap of each atom to the mean of its type, of those that are not at a surface: these have a slope far below
// the mean, which that of all atoms begins.
void VolumeReferences::set_gaps(const std::vector<char> &is_known)
{
  constexpr int ROUNDS = 5, WIDTH = 3;
  constexpr double SURFACE = 0.85;
  std::vector<NeighborDensity> mean(atom->ntypes + 1, NeighborDensity{});
  for (int round = 0; round < ROUNDS; round++) {
    std::vector<double> sums(WIDTH * mean.size(), 0.0);
    for (int i = 0; i < atom->nlocal; i++) {
      const NeighborDensity &own = records[i].at_rest;
      if (own.slope == 0.0 || own.slope < SURFACE * mean[atom->type[i]].slope) continue;
      double *const sum = &sums[WIDTH * (size_t) atom->type[i]];
      sum[0] += 1.0;
      sum[1] += own.rho;
      sum[2] += own.slope;
    }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), (int) sums.size(), MPI_DOUBLE, MPI_SUM, world);
    for (size_t type = 1; type < mean.size(); type++)
      if (const double *const sum = &sums[WIDTH * type]; sum[0] > 0.0)
        mean[type] = {sum[1] / sum[0], sum[2] / sum[0]};
  }
  for (int i = 0; i < atom->nlocal; i++) {
    VolumeReference &own = records[i].reference;
    if (!is_known[i]) own.gap = std::max(0.0, mean[atom->type[i]].rho - own.own.rho);
  }
}

// The bonds of an atom that are left after partners were deleted, or got another pair style: the reference loses their
// shares at deq, and is that of the bonds which are left where nothing else has changed it
void VolumeReferences::lose_partners(VolumeRecord &record, const NeighborDensity &left)
{
  constexpr double ROUND_OFF = 1e-12;
  VolumeReference &reference = record.reference;
  if (reference.own.slope == 0.0) return;
  const double negligible = ROUND_OFF * reference.own.slope;
  if (std::fabs(record.at_rest.rho - left.rho) <= negligible) return;
  reference.gap =
      std::max(std::min(0.0, reference.gap), reference.gap + (record.at_rest.rho - left.rho));
  reference.own = {left.rho + (reference.own.rho - record.at_rest.rho),
                   left.slope + (reference.own.slope - record.at_rest.slope)};
  record.at_rest = left;
  if (!(reference.own.slope > negligible)) record = {};
}

}    // namespace EVP
