// SPDX-License-Identifier: GPL-2.0-only

#include "bond_file_reader.h"

#include "atom_bodies.h"
#include "collective.h"
#include "core/bond_file.h"
#include "core/pair_list.h"
#include "pair_network.h"

#include "comm.h"

#include <cstdio>
#include <memory>
#include <unordered_map>

namespace EVP {

namespace {

  constexpr int LINES_PER_MESSAGE = 10000;

  /// An atom of a line, all zero where another rank owns it: their sum over the ranks is the atom.
  struct End {
    double type, in_group, radius, molecule;
  };

  [[noreturn]] void refuse(const BondLine &line, const std::string &why)
  {
    throw BadInput(fmt::format("bond {} {}: {}", line.id_i, line.id_j, why));
  }

  void check_bodies(const BondLine &line, const End &a, const End &b, Within within,
                    const std::string &file)
  {
    const bool of_types = within == Within::TYPE;
    if (within == Within::ALL || (of_types && a.type == b.type) ||
        (!of_types && a.molecule == b.molecule && a.molecule != 0.0))
      return;
    refuse(
        line,
        fmt::format("its atoms are of {}s {} and {}, but with 'within {}' only atoms of one {} are "
                    "bonded, bond file {}: give them the {}s that they had when it was written, or "
                    "leave 'within' out here and WITHIN: in its header",
                    WITHINS[(int) within], (bigint) (of_types ? a.type : a.molecule),
                    (bigint) (of_types ? b.type : b.molecule), WITHINS[(int) within],
                    WITHINS[(int) within], file, WITHINS[(int) within]));
  }

  /// Pairs on which flow has done negative work: it can, but only where pairs were pressed together so far that it
  /// creates energy, so that such a file is read.
  struct NegativeWork {
    bigint count = 0;
    BondLine first = {};

    void note(const BondLine &line, double depth)
    {
      if (line.history.work >= -ROUND_OFF * depth) return;
      if (count++ == 0) first = line;
    }

    void warn(const LAMMPS *lmp, const std::string &file) const
    {
      if (count == 0 || lmp->comm->me != 0) return;
      lmp->error->warning(
          FLERR,
          "Fix evp/bonds: {} pairs have a negative plastic work, first {} {} with {:.6g}, bond "
          "file {}: they have flowed so far in compression that flow creates energy, or the file "
          "was "
          "changed; check the run that wrote it",
          count, first.id_i, first.id_j, first.history.work, file);
    }

    static constexpr double ROUND_OFF = 1e-9;
  };

}    // namespace

std::vector<BondStore::Bonds> read_bond_file(const LAMMPS *lmp, const std::string &name,
                                             int groupbit, const PairNetwork *network,
                                             Within &within, std::vector<HistoryOfPair> &histories)
{
  const Atom *atom = lmp->atom;
  const int me = lmp->comm->me;
  const MPI_Comm world = lmp->world;
  std::unique_ptr<FILE, int (*)(FILE *)> stream(nullptr, fclose);    // these two on the first rank
  std::unique_ptr<BondReader> reader;
  std::unordered_map<int64_t, int> own;    // local index by ID
  for (int i = 0; i < atom->nlocal; i++) own[atom->tag[i]] = i;

  std::vector<BondStore::Bonds> bonds(atom->nlocal);
  std::vector<BondLine> lines;
  bigint beyond = 0;    // bonds with deq beyond dlim, so far
  NegativeWork negative;
  // more to come, lines of this message, bonds admitted beyond dlim, bodies of the file
  bigint state[] = {1, 0, 0, 0};
  while (state[0]) {
    lines.clear();
    std::string complaint;
    try {
      if (me == 0 && !reader) {
        stream.reset(fopen(name.c_str(), "rb"));
        if (!stream) throw BadInput("cannot read the bond file '" + name + "': give its path");
        reader = std::make_unique<BondReader>(stream.get(), name, lmp->update->unit_style);
        state[2] = reader->beyond();
        state[3] = (bigint) reader->within();
      }
      if (me == 0) state[0] = reader->read(lines, LINES_PER_MESSAGE);
    } catch (const BadInput &bad) {
      complaint = bad.what();
    }
    state[1] = (bigint) lines.size();
    throw_together(complaint, world);
    MPI_Bcast(state, 4, MPI_LMP_BIGINT, 0, world);
    if (within == Within::ALL) within = (Within) state[3];
    if (within == Within::MOLECULE) {
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
      ends_here[k] = {(double) atom->type[i], atom->mask[i] & groupbit ? 1.0 : 0.0, atom->radius[i],
                      atom->molecule ? (double) atom->molecule[i] : 0.0};
      const int64_t partner = k % 2 ? line.id_i : line.id_j;
      if (!line.is_contact) bonds[i].push_back({partner, line.deq});
      if (!(line.history == PairHistory{}))
        histories.push_back({i, !line.is_contact, partner, line.history});
    }
    MPI_Allreduce(ends_here.data(), ends.data(), (int) (4 * ends.size()), MPI_DOUBLE, MPI_SUM,
                  world);

    // all ranks check all lines, and throw together
    for (size_t k = 0; k < ends.size(); k++) {
      const BondLine &line = lines[k / 2];
      const int64_t id = k % 2 ? line.id_j : line.id_i;
      if (ends[k].type == 0.0)
        refuse(line,
               fmt::format("there is no atom {}: read the data file that was written with the "
                           "bond file {}",
                           id, name));
      if (ends[k].in_group == 0.0)
        refuse(line, fmt::format("atom {} is not in the fix's group, bond file {}", id, name));
      if (k % 2 == 0) continue;
      if (!(line.history == PairHistory{}) && !network->rules.has_history())
        refuse(line,
               fmt::format("it has flowed or broken, bond file {}: use pair_style evp/lj with "
                           "'unload elastic' or 'break', as when the file was written",
                           name));
      if ((line.history.offset != 0.0 || line.is_contact) && !network->rules.flows)
        refuse(line,
               fmt::format("it has flowed, bond file {}: use pair_style evp/lj with 'unload "
                           "elastic', as when the file was written",
                           name));
      negative.note(line, network->depth_given((int) ends[k - 1].type, (int) ends[k].type));
      if (line.is_contact) continue;

      // the margin is wider than that of the recording, which has rounded deq since
      const End &a = ends[k - 1], &b = ends[k];
      if (line.history.broken == 0.0) check_bodies(line, a, b, within, name);
      const double dlim = network->alpha_of((int) a.type, (int) b.type) * (a.radius + b.radius);
      if (line.deq > dlim * (1.0 + BOND_MARGIN) && ++beyond > state[2])
        refuse(line,
               fmt::format("deq = {} is beyond dlim = alpha (R_i + R_j) = {}, but was not when the "
                           "file {} was written: read it with the alpha and the radii of then, "
                           "and reduce them after 'run 0'",
                           line.deq, dlim, name));
    }
  }
  negative.warn(lmp, name);
  return bonds;
}

}    // namespace EVP
