/* SPDX-License-Identifier: GPL-2.0-only */

#include "write_evp_bonds.h"

#include "atom_directory.h"
#include "core/bond_file.h"
#include "fix_evp_bonds.h"
#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

using namespace LAMMPS_NS;

static constexpr size_t CHUNK = 1 << 24;    // bytes of text per message

/* ----------------------------------------------------------------------
   the file appears under its name only when it is whole
------------------------------------------------------------------------- */

void WriteEVPBonds::command(int narg, char **arg)
{
  if (narg != 1) error->all(FLERR, "write_evp_bonds takes one word, the FILE to write");
  const FixEVPBonds *bonds = find_recorded();

  bigint counts_here[2] = {0, 0}, counts[2];    // bonds, of these with deq beyond dlim
  const std::string text = own_lines(bonds, counts_here);
  MPI_Allreduce(counts_here, counts, 2, MPI_LMP_BIGINT, MPI_SUM, world);

  std::string name = arg[0];
  const size_t star = name.find('*');
  if (star != std::string::npos) name.replace(star, 1, std::to_string(update->ntimestep));
  const std::string unfinished = name + ".part";
  FILE *fp = nullptr;
  int good = 1;
  if (comm->me == 0) {
    fp = fopen(unfinished.c_str(), "wb");
    const std::string header = EVP::bond_header(counts[0], update->unit_style, counts[1]);
    good = fp && fprintf(fp, "%s\n", header.c_str()) > 0;
  }
  MPI_Bcast(&good, 1, MPI_INT, 0, world);
  if (!good)
    error->all(FLERR, "write_evp_bonds: cannot write '{}': check the folder and the free space",
               name);

  std::string received;
  for (int source = 0; source < comm->nprocs; source++) {
    bigint size = (bigint) text.size();
    if (source != 0 && comm->me == 0)
      MPI_Recv(&size, 1, MPI_LMP_BIGINT, source, 0, world, MPI_STATUS_IGNORE);
    else if (source != 0 && comm->me == source)
      MPI_Send(&size, 1, MPI_LMP_BIGINT, 0, 0, world);
    if (comm->me != 0 && comm->me != source) continue;

    for (size_t done = 0; done < (size_t) size; done += CHUNK) {
      const size_t n = std::min(CHUNK, (size_t) size - done);
      if (source != 0 && comm->me == source)
        MPI_Send(&text[done], (int) n, MPI_CHAR, 0, 1, world);
      else if (source == 0)
        good = good && fwrite(&text[done], 1, n, fp) == n;
      else {
        received.resize(n);
        MPI_Recv(&received[0], (int) n, MPI_CHAR, source, 1, world, MPI_STATUS_IGNORE);
        good = good && fwrite(received.data(), 1, n, fp) == n;
      }
    }
  }

  if (comm->me == 0) {
    good = (fclose(fp) == 0) && good;
    good = good && rename(unfinished.c_str(), name.c_str()) == 0;
    if (!good) remove(unfinished.c_str());
  }
  MPI_Bcast(&good, 1, MPI_INT, 0, world);
  if (!good)
    error->all(FLERR, "write_evp_bonds: cannot write '{}': check the folder and the free space",
               name);
  if (comm->me == 0)
    utils::logmesg(lmp, "write_evp_bonds: {} bonds written to {}\n", counts[0], name);
}

/* ---------------------------------------------------------------------- */

const FixEVPBonds *WriteEVPBonds::find_recorded() const
{
  const auto *bonds = dynamic_cast<FixEVPBonds *>(EVP::scene::find_fix(modify, "evp/bonds"));
  if (!bonds)
    error->all(FLERR, "write_evp_bonds: there is no fix evp/bonds, hence no bonds to write");
  if (!bonds->records().has_recorded())
    error->all(FLERR,
               "write_evp_bonds: fix {} has not recorded yet, it does so at the first set-up: use "
               "'run 0' before",
               bonds->id);
  bonds->check_ids();
  return bonds;
}

/* ----------------------------------------------------------------------
   both atoms of a pair keep it: the one with the lower ID writes, unless its
   partner was deleted, whom a reader could not find
------------------------------------------------------------------------- */

std::string WriteEVPBonds::own_lines(const FixEVPBonds *bonds, bigint (&counts)[2]) const
{
  std::vector<EVP::BondLine> lines;
  std::vector<tagint> partners;
  std::vector<int> owners;
  for (int i = 0; i < atom->nlocal; i++)
    for (const auto &bond : bonds->records().of(i)) {
      if (atom->tag[i] > bond.partner) continue;
      lines.push_back({atom->tag[i], bond.partner, bond.deq});
      partners.push_back((tagint) bond.partner);
      owners.push_back(i);
    }

  const PairNetwork *pair = PairNetwork::find(force);
  const std::vector<AtomDirectory::Entry> found = AtomDirectory(atom, world).find(partners);
  std::string text;
  for (size_t k = 0; k < lines.size(); k++) {
    if (found[k].type == 0) continue;
    text += EVP::bond_text(lines[k]);
    counts[0]++;
    if (!pair) continue;
    const int i = owners[k];
    const double dlim =
        pair->alpha_given(atom->type[i], found[k].type) * (atom->radius[i] + found[k].radius);
    if (lines[k].deq > dlim * (1.0 + EVP::BOND_MARGIN)) counts[1]++;
  }
  return text;
}
