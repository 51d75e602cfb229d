// SPDX-License-Identifier: GPL-2.0-only

#include "bond_file_reader.h"

#include "atom_bodies.h"
#include "collective.h"
#include "core/bond_file.h"

#include "comm.h"
#include "update.h"

#include <fstream>
#include <memory>
#include <unordered_map>

namespace EVP {

namespace {

  constexpr int LINES_PER_MESSAGE = 10000;

  /// An atom of a line, all zero where another rank owns it: their sum over the ranks is the atom.
  struct End {
    double in_group, type, molecule;
    bool exists() const { return type > 0.0; }
  };

  /// What is wrong with a bond of these two atoms; empty if nothing.
  std::string complaint_of(const BondLine &line, const End &a, const End &b, const PairRules &rules,
                           BodyRule within)
  {
    if (!a.exists() || !b.exists())
      return fmt::format(
          "there is no atom {}: read the data file that was written with the bond file",
          a.exists() ? line.id_j : line.id_i);
    if (a.in_group == 0.0 || b.in_group == 0.0)
      return fmt::format("atom {} is not in the fix's group",
                         a.in_group == 0.0 ? line.id_i : line.id_j);
    const bool has_flowed = line.is_contact || line.history.q != 0.0 || line.history.k != 0.0;
    if (has_flowed && !rules.plastic)
      return "it has flowed: use pair_style evp/lj with 'plasticity isotropic', as when the file "
             "was "
             "written";
    if (line.has_changed() && !rules.has_history())
      return "it has flowed or broken: use pair_style evp/lj with 'plasticity isotropic' or "
             "'break', as "
             "when the file was written";
    const bool are_one_body = within == BodyRule::ALL ||
        (within == BodyRule::TYPE && a.type == b.type) ||
        (within == BodyRule::MOLECULE && a.molecule == b.molecule && a.molecule != 0.0);
    if (!line.is_contact && line.history.broken == 0.0 && !are_one_body)
      return fmt::format(
          "its atoms are not of one {0}, but 'within {0}' is in force: give them the {0}s "
          "that they had when the file was written, or leave 'within' out here and "
          "WITHIN: in the header",
          BODY_RULES[(int) within]);
    return "";
  }

}    // namespace

std::vector<BondStore::Bonds> read_bond_file(const LAMMPS *lmp, const std::string &name,
                                             int groupbit, const PairRules &rules, BodyRule &within,
                                             std::vector<HistoryOfPair> &histories)
{
  const Atom *atom = lmp->atom;
  const int me = lmp->comm->me;
  const MPI_Comm world = lmp->world;
  std::ifstream stream;    // these two on the first rank
  std::unique_ptr<BondReader> reader;
  std::unordered_map<int64_t, int> own;    // local index by ID
  for (int i = 0; i < atom->nlocal; i++) own[atom->tag[i]] = i;

  std::vector<BondStore::Bonds> bonds(atom->nlocal);
  std::vector<BondLine> lines;
  bigint state[] = {1, 0, 0};    // more to come, lines of this message, bodies of the file
  while (state[0]) {
    lines.clear();
    std::string complaint;
    try {
      if (me == 0 && !reader) {
        stream.open(name, std::ios::binary);
        if (!stream) throw BadInput("cannot read the bond file '" + name + "': give its path");
        reader = std::make_unique<BondReader>(stream, name, lmp->update->unit_style);
        state[2] = (bigint) reader->within();
      }
      if (me == 0) state[0] = reader->read(lines, LINES_PER_MESSAGE);
    } catch (const BadInput &bad) {
      complaint = bad.what();
    }
    state[1] = (bigint) lines.size();
    throw_together(complaint, world);
    MPI_Bcast(state, 3, MPI_LMP_BIGINT, 0, world);
    if (within == BodyRule::ALL) within = (BodyRule) state[2];
    if (within == BodyRule::MOLECULE) {
      const std::string missing = missing_molecules(lmp);
      if (!missing.empty()) throw BadInput(missing);
    }
    lines.resize(state[1]);
    MPI_Bcast(lines.data(), (int) (lines.size() * sizeof(BondLine)), MPI_BYTE, 0, world);

    std::vector<End> ends_here(2 * lines.size(), End{}), ends(2 * lines.size());
    for (size_t k = 0; k < ends.size(); k++) {
      const BondLine &line = lines[k / 2];
      const auto at = own.find(k % 2 ? line.id_j : line.id_i);
      if (at == own.end()) continue;
      const int i = at->second;
      ends_here[k] = {atom->mask[i] & groupbit ? 1.0 : 0.0, (double) atom->type[i],
                      atom->molecule ? (double) atom->molecule[i] : 0.0};
      const int64_t partner = k % 2 ? line.id_i : line.id_j;
      if (!line.is_contact) bonds[i].push_back({partner, line.deq});
      if (line.has_changed()) histories.push_back({i, !line.is_contact, partner, line.history});
    }
    MPI_Allreduce(ends_here.data(), ends.data(), (int) (3 * ends.size()), MPI_DOUBLE, MPI_SUM,
                  world);

    for (size_t k = 0; k < lines.size(); k++) {    // on all ranks, which throw together
      const std::string bad = complaint_of(lines[k], ends[2 * k], ends[2 * k + 1], rules, within);
      if (!bad.empty())
        throw BadInput(
            fmt::format("bond {} {}: {} (bond file {})", lines[k].id_i, lines[k].id_j, bad, name));
    }
  }
  return bonds;
}

}    // namespace EVP
