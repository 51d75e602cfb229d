// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/commands/write_evp_bonds.h"

#include "lammps/base/atom_directory.h"
#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/bonds/fix_evp_bonds.h"

#include "comm.h"

#include <algorithm>
#include <vector>

using namespace LAMMPS_NS;
using namespace EVP;

static constexpr size_t CHUNK = 1 << 24;    // bytes of text per message

void WriteEVPBonds::command(int narg, char **arg)
{
  if (narg != 1) error->all(FLERR, "write_evp_bonds: expected one argument, the file to write");
  const BondStore &records = find_records();
  BondHeader header = {};
  std::string text = lines_of_pairs(records, header) + lines_of_spheres(records, header);
  const auto [ended, failed, begun] = records.counts();
  const auto sums =
      reduce_all(std::array{header.bonds, header.contacts, header.spheres, ended, failed, begun},
                 MPI_SUM, world);
  header = {sums[0],
            records.within,
            records.zone,
            sums[1],
            sums[2],
            {sums[3], sums[4], sums[5]},
            records.joins_by,
            records.measures.empty() ? std::vector<double>{} : records.measures.words(atom->ntypes),
            header.columns};
  if (comm->me == 0) text = bond_header(header, update->unit_style) + "\n" + text;

  const std::string name = utils::star_subst(arg[0], update->ntimestep, 0);
  // the file appears under its name only when it is whole
  const std::string unfinished = name + ".part";
  FILE *fp = comm->me == 0 ? fopen(unfinished.c_str(), "wb") : nullptr;
  bool good = write_in_order_of_ranks(text, fp);
  if (fp) {
    good = fclose(fp) == 0 && good && rename(unfinished.c_str(), name.c_str()) == 0;
    if (!good) remove(unfinished.c_str());
  }
  if (!on_all(good, world))
    error->all(FLERR, "write_evp_bonds: cannot write '{}': check the folder and the free space",
               name);
  if (comm->me == 0)
    utils::logmesg(lmp, "write_evp_bonds: {} bonds written to {}\n", header.bonds, name);
}

const BondStore &WriteEVPBonds::find_records() const
{
  auto *bonds = dynamic_cast<FixEVPBonds *>(scene::find_fix(modify, "evp/bonds"));
  if (!bonds)
    error->all(FLERR, "write_evp_bonds: there is no fix evp/bonds, hence no bonds to write");
  if (!bonds->records()->has_recorded())
    error->all(FLERR,
               "write_evp_bonds: fix {} has not recorded yet, it does so at the first setup: use "
               "'run 0' before",
               bonds->id);
  bonds->return_histories();
  bonds->check_ids();
  return *bonds->records();
}

// Both atoms have the record of a pair: that with the lower ID writes it, unless its partner was deleted, which a reader could
// not find.
std::string WriteEVPBonds::lines_of_pairs(const BondStore &records, BondHeader &header) const
{
  std::vector<BondLine> lines;
  std::vector<tagint> partners;
  const auto add = [&](const BondLine &pair) {
    if (pair.id > pair.bond.partner) return;
    lines.push_back(pair);
    partners.push_back((tagint) pair.bond.partner);
  };
  for (int i = 0; i < atom->nlocal; i++)
    for (const EVP::BondRecord &bond : records.of(i)) {
      const Remembered *const remembered = records.find_remembered(i, bond.partner);
      const bool joined = remembered && remembered->kind == Remembered::JOINED;
      add({atom->tag[i], bond, joined ? remembered->kind : BondLine::BOND});
    }
  for (int i = 0; records.has_history() && i < atom->nlocal; i++)
    for (const Remembered &one : records.remembered_of(i))
      if (!records.find(i, one.partner)) add({atom->tag[i], {one.partner, one.deq}, one.kind});
  const AtomDirectory directory(lmp, partners);

  std::string text;
  for (const BondLine &pair : lines) {
    if (directory.entries.at((tagint) pair.bond.partner).type == 0) continue;
    text += bond_text(pair);
    (pair.is_bond() ? header.bonds : header.contacts)++;
  }
  return text;
}

// Of those that the bonds do not tell everything of: one of whose values has changed since the recording
std::string WriteEVPBonds::lines_of_spheres(const BondStore &records, BondHeader &header) const
{
  const auto &groups = records.all_groups();
  bool needs_all = false;
  std::vector<BondStore::Place> places;
  for (const auto &[effect, group] : groups) {
    needs_all = needs_all || (group->needs & ALL_SPHERES);
    for (size_t k = 0; k < group->lines.size(); k++) {
      const SphereValue &value = group->lines[k];
      if (value.range == Range::NOT_IN_FILES) continue;
      places.push_back({group.get(), k});
      header.columns += (header.columns.empty() ? "" : ",") + std::string(value.name);
    }
  }
  const auto has_changed = [&](int i) {
    return std::any_of(groups.begin(), groups.end(), [&](const auto &one) {
      return one.second->has_changed(i, records.of(i).size());
    });
  };
  bool any = false;
  for (int i = 0; i < atom->nlocal; i++) any = any || has_changed(i);
  const bool all = on_any(any, world) && needs_all;
  std::string text;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!all && !has_changed(i)) continue;
    SphereLine line = {atom->tag[i], {}};
    for (const BondStore::Place &place : places) line.values.push_back(place.of(i));
    text += sphere_text(line);
    header.spheres++;
  }
  return text;
}

// To the file of the first rank, which stays as it is if nullptr; false there if it cannot be written.
bool WriteEVPBonds::write_in_order_of_ranks(const std::string &text, FILE *fp) const
{
  if (comm->me > 0) {    // an empty message is the last one
    for (size_t done = 0; done < text.size(); done += CHUNK)
      MPI_Send(&text[done], (int) std::min(CHUNK, text.size() - done), MPI_CHAR, 0, 0, world);
    MPI_Send(nullptr, 0, MPI_CHAR, 0, 0, world);
    return true;
  }
  bool good = fp && fwrite(text.data(), 1, text.size(), fp) == text.size();
  std::vector<char> received(comm->nprocs > 1 ? CHUNK : 0);
  for (int source = 1; source < comm->nprocs; source++)
    for (int size = 1; size > 0;) {
      MPI_Status status;
      MPI_Recv(received.data(), (int) CHUNK, MPI_CHAR, source, 0, world, &status);
      MPI_Get_count(&status, MPI_CHAR, &size);
      good = good && fwrite(received.data(), 1, size, fp) == (size_t) size;
    }
  return good;
}
