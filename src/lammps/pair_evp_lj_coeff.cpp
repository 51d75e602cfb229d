// SPDX-License-Identifier: GPL-2.0-only
//
// Pair style evp/lj: the commands pair_style and pair_coeff.

#include "pair_evp_lj.h"

#include "core/potential_file.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cstring>
#include <iterator>

using namespace LAMMPS_NS;

static constexpr int MAX_FILE_SIZE = 1 << 20;

PairEVPLJ::PairEVPLJ(LAMMPS *lmp) :
    Pair(lmp), settings_now{Contact::LITERAL, 0.3}, any_gamma(false), scene_checked(false),
    implicit_groupbit(0), bonds(nullptr), overlap_warned(false), velocities_sent(false),
    explicit_damping(false), packed_call(-1), packed_step(-1), packed_atoms(0), built_comm(nullptr),
    built_skin(0.0), lammps_notes(false), sends_positions(false), updated_ghosts(0), repack(true),
    radii_vary(false)
{
  writedata = 1;
  comm_forward = 3;    // velocities
  single_extra = NVALUES;
  svector = new double[NVALUES];
  packed.nlocal = packed.nall = -1;
}

PairEVPLJ::~PairEVPLJ()
{
  delete[] svector;
  memory->destroy(setflag);
  memory->destroy(cutsq);
}

void PairEVPLJ::allocate()
{
  allocated = 1;
  const int n = atom->ntypes + 1;
  memory->create(setflag, n, n, "pair:setflag");
  memory->create(cutsq, n, n, "pair:cutsq");
  std::fill_n(&setflag[0][0], n * n, 0);
  std::fill_n(&cutsq[0][0], n * n, 0.0);
  max_radius.assign(n, 0.0);
  min_radius.assign(n, 0.0);
  coefficients.resize(atom->ntypes);
}

// pair_style evp/lj [contact literal|repulsive|none] [overlap 0.3]
void PairEVPLJ::settings(int narg, char **arg)
{
  const char *const contacts[] = {"literal", "repulsive", "none"};
  Settings chosen = {Contact::LITERAL, 0.3};
  for (int iarg = 0; iarg < narg; iarg += 2) {
    const std::string key = arg[iarg];
    if (key != "contact" && key != "overlap")
      error->all(FLERR, "Pair style evp/lj: unknown keyword '{}'; it takes contact and overlap",
                 key);
    if (iarg + 1 == narg) error->all(FLERR, "Pair style evp/lj: keyword {} needs a value", key);
    const std::string value = arg[iarg + 1];
    if (key == "contact") {
      const auto found = std::find(std::begin(contacts), std::end(contacts), value);
      if (found == std::end(contacts))
        error->all(FLERR, "Pair style evp/lj: contact must be literal, repulsive or none, got '{}'",
                   value);
      chosen.contact = (Contact) (found - contacts);
    } else {
      try {
        chosen.overlap = EVP::parse_number("overlap", value);
      } catch (const EVP::BadInput &bad) {
        error->all(FLERR, "Pair style evp/lj: {}", bad.what());
      }
      if (!(chosen.overlap > 0.0 && chosen.overlap <= 1.0))
        error->all(FLERR,
                   "Pair style evp/lj: overlap must lie in (0, 1] (a share of R_i + R_j that is "
                   "warned of), got {}",
                   value);
    }
  }
  settings_now = chosen;
  repack = true;
  offer_pair_values();
}

// p1 p2 p3 of compute pair/local. Before 2026 LAMMPS copies those of a sub-style of
// pair_style hybrid without end, and crashes; there, asking for them is an error instead
void PairEVPLJ::offer_pair_values()
{
  single_extra = strcmp(force->pair_style, "hybrid") == 0 ? 0 : NVALUES;
}

// pair_coeff I J e1 m1 n1 e2 m2 n2 xi_s gamma alpha, or pair_coeff I J FILE NAME
void PairEVPLJ::coeff(int narg, char **arg)
{
  if (narg < 4)
    error->all(FLERR,
               "Pair evp/lj: pair_coeff needs two atom types and a row: the {} numbers {}, or FILE "
               "NAME with the name of a row in the file",
               EVP::NMEMBERS, EVP::row_keys());
  if (!allocated) allocate();

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);

  EVP::Row row;
  try {
    row = narg == 4 ? row_from_file(arg[2], arg[3]) : EVP::parse_row({arg + 2, arg + narg});
  } catch (const EVP::BadInput &bad) {
    error->all(FLERR, "Pair evp/lj: {}", bad.what());
  }

  bool any = false;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      coefficients.set(i, j, row);
      setflag[i][j] = 1;
      any = true;
    }
  repack = true;
  if (!any)
    error->all(FLERR, "Pair evp/lj: pair_coeff {} {} names no pair of types I <= J", arg[0],
               arg[1]);
}

// the first process reads the file, all check it and stop together
EVP::Row PairEVPLJ::row_from_file(const char *file, const char *name) const
{
  std::string text;
  int size = -1;
  if (comm->me == 0) {
    const std::string path = utils::get_potential_file_path(file);
    FILE *fp = path.empty() ? nullptr : fopen(path.c_str(), "rb");
    if (fp) {
      text.resize(MAX_FILE_SIZE + 1);
      text.resize(fread(&text[0], 1, text.size(), fp));
      size = ferror(fp) ? -1 : (int) text.size();
      fclose(fp);
    }
  }
  MPI_Bcast(&size, 1, MPI_INT, 0, world);
  if (size < 0)
    throw EVP::BadInput(std::string("cannot read the potential file '") + file +
                        "': give its path, or put its folder into LAMMPS_POTENTIALS");
  if (size > MAX_FILE_SIZE)
    throw EVP::BadInput(std::string("file ") + file + " is larger than 1 MiB: no potential file");
  text.resize(size);
  MPI_Bcast(&text[0], size, MPI_CHAR, 0, world);
  return EVP::row_from_text(text, file, name, update->unit_style);
}

double PairEVPLJ::alpha_given(int itype, int jtype) const
{
  const int low = std::min(itype, jtype), high = std::max(itype, jtype);
  return allocated && setflag[low][high] ? coefficients.row(low, high).alpha : 0.0;
}

double PairEVPLJ::alpha_of(int itype, int jtype) const
{
  return serves(itype, jtype) ? coefficients.row(itype, jtype).alpha : 0.0;
}
