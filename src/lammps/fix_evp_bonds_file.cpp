/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/bonds: records from a bond file. The first MPI rank reads and checks it, all take from it
   what concerns their atoms. */

#include "fix_evp_bonds.h"

#include "atom_directory.h"
#include "core/bond_file.h"
#include "pair_network.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "update.h"

#include <algorithm>
#include <memory>
#include <utility>

using namespace LAMMPS_NS;

namespace {

constexpr int LINES_PER_MESSAGE = 10000;

struct CloseFile {
  void operator()(FILE *stream) const { fclose(stream); }
};

/// Local indices of this rank's own atoms, by ID.
class OwnAtoms {
 public:
  explicit OwnAtoms(const Atom *atom)
  {
    for (int i = 0; i < atom->nlocal; i++) order.emplace_back(atom->tag[i], i);
    std::sort(order.begin(), order.end());
  }

  /// -1 if the atom is on another rank.
  int find(int64_t id) const
  {
    const auto at = std::lower_bound(order.begin(), order.end(), std::make_pair(id, 0));
    return at == order.end() || at->first != id ? -1 : at->second;
  }

 private:
  std::vector<std::pair<int64_t, int>> order;
};

/// The lines of a bond file, checked against the atoms.
class CheckedLines {
 public:
  CheckedLines(const std::string &name_in, const char *units, const PairNetwork *pair_in,
               int groupbit_in) :
      name(name_in),
      pair(pair_in), groupbit(groupbit_in), beyond(0), stream(fopen(name.c_str(), "rb"))
  {
    if (!stream) throw EVP::BadInput("cannot read the bond file '" + name + "': give its path");
    reader = std::make_unique<EVP::BondReader>(stream.get(), name, units);
  }

  bool read(std::vector<EVP::BondLine> &lines) { return reader->read(lines, LINES_PER_MESSAGE); }

  /// IDs of both atoms of each line, as far as LAMMPS can have such atoms.
  static std::vector<tagint> atoms_of(const std::vector<EVP::BondLine> &lines)
  {
    std::vector<tagint> ids;
    for (const EVP::BondLine &line : lines)
      for (const int64_t id : {line.id_i, line.id_j})
        ids.push_back(id > MAXTAGINT ? 0 : (tagint) id);
    return ids;
  }

  /// atoms: those of atoms_of(). Throws BadInput if a line cannot be a bond of theirs.
  void check(const std::vector<EVP::BondLine> &lines,
             const std::vector<AtomDirectory::Entry> &atoms)
  {
    for (size_t k = 0; k < lines.size(); k++) check(lines[k], atoms[2 * k], atoms[2 * k + 1]);
  }

 private:
  std::string name;
  const PairNetwork *pair;
  int groupbit;
  int64_t beyond;    // bonds whose deq is beyond dlim
  std::unique_ptr<FILE, CloseFile> stream;
  std::unique_ptr<EVP::BondReader> reader;

  void check(const EVP::BondLine &line, const AtomDirectory::Entry &a,
             const AtomDirectory::Entry &b)
  {
    const std::string bond = fmt::format("bond {} {}: ", line.id_i, line.id_j);
    if (a.type == 0 || b.type == 0)
      throw EVP::BadInput(fmt::format("{}there is no atom {}: read the data file that was written "
                                      "with the bond file {}",
                                      bond, a.type == 0 ? line.id_i : line.id_j, name));
    if (!(a.mask & b.mask & groupbit))
      throw EVP::BadInput(fmt::format("{}atom {} is not in the fix's group, bond file {}", bond,
                                      a.mask & groupbit ? line.id_j : line.id_i, name));

    // the margin is wider than that of the recording, which has rounded deq since
    const double dlim = pair->alpha_of(a.type, b.type) * (a.radius + b.radius);
    if (line.deq <= dlim * (1.0 + EVP::BOND_MARGIN) || ++beyond <= reader->beyond()) return;
    throw EVP::BadInput(
        fmt::format("{}deq = {} is beyond dlim = alpha (R_i + R_j) = {}, but was not when the file "
                    "{} was written: read it with the alpha and the radii of then, and reduce them "
                    "after 'run 0'",
                    bond, line.deq, dlim, name));
  }
};

}    // namespace

/* ---------------------------------------------------------------------- */

std::vector<EVP::BondStore::Bonds> FixEVPBonds::bonds_in_file(const PairNetwork *pair,
                                                              const AtomDirectory &directory) const
{
  std::unique_ptr<CheckedLines> reader;    // of the first rank
  const auto on_first_rank = [&](auto &&task) {
    std::string complaint;
    try {
      if (comm->me == 0) task();
    } catch (const EVP::BadInput &bad) {
      complaint = bad.what();
    }
    stop_together(complaint);
  };
  on_first_rank([&] {
    reader = std::make_unique<CheckedLines>(file, update->unit_style, pair, groupbit);
  });

  const OwnAtoms own(atom);
  std::vector<EVP::BondStore::Bonds> made(atom->nlocal);
  std::vector<EVP::BondLine> lines;
  for (int more = 1; more;) {
    lines.clear();
    on_first_rank([&] {
      more = reader->read(lines);
    });
    const std::vector<AtomDirectory::Entry> atoms = directory.find(CheckedLines::atoms_of(lines));
    on_first_rank([&] {
      reader->check(lines, atoms);
    });

    MPI_Bcast(&more, 1, MPI_INT, 0, world);
    int count = (int) lines.size();
    MPI_Bcast(&count, 1, MPI_INT, 0, world);
    lines.resize(count);
    MPI_Bcast(lines.data(), count * (int) sizeof(EVP::BondLine), MPI_BYTE, 0, world);
    for (const EVP::BondLine &line : lines)
      for (int side = 0; side < 2; side++) {
        const int i = own.find(side ? line.id_j : line.id_i);
        if (i >= 0) made[i].push_back({side ? line.id_i : line.id_j, line.deq});
      }
  }
  return made;
}

void FixEVPBonds::stop_together(std::string complaint) const
{
  int here = complaint.empty() ? comm->nprocs : comm->me, first;
  MPI_Allreduce(&here, &first, 1, MPI_INT, MPI_MIN, world);
  if (first == comm->nprocs) return;
  int length = (int) complaint.size();
  MPI_Bcast(&length, 1, MPI_INT, first, world);
  complaint.resize(length);
  MPI_Bcast(&complaint[0], length, MPI_CHAR, first, world);
  error->all(FLERR, "Fix {} evp/bonds: {}", id, complaint);
}
