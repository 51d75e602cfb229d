/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: the commands pair_style and pair_coeff. */

#include "pair_evp_lj.h"

#include "core/params.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cstring>

using namespace LAMMPS_NS;

static constexpr long MAX_FILE_SIZE = 1 << 20;

/* ---------------------------------------------------------------------- */

PairEVPLJ::PairEVPLJ(LAMMPS *lmp) :
    Pair(lmp), settings_now{Contact::LITERAL, 0.3}, coefficients{}, any_gamma(false),
    scene_checked(false), implicit_groupbit(0), bonds(nullptr), overlap_warned(false),
    velocities_sent(false), explicit_damping(false), packed_call(-1), packed_step(-1),
    packed_atoms(0), built_comm(nullptr), built_skin(0.0), lammps_notes(false),
    sends_positions(false), updated_ghosts(0), repack(true), radii_vary(false)
{
  writedata = 1;
  comm_forward = 3;    // velocities
  single_extra = NVALUES;
  svector = new double[NVALUES];
  packed.nlocal = packed.nall = -1;
}

/* ---------------------------------------------------------------------- */

PairEVPLJ::~PairEVPLJ()
{
  delete[] svector;
  if (!allocated) return;
  memory->destroy(setflag);
  memory->destroy(cutsq);
  for (auto &coefficient : coefficients) memory->destroy(coefficient);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::allocate()
{
  allocated = 1;
  const int n = atom->ntypes + 1;
  memory->create(setflag, n, n, "pair:setflag");
  memory->create(cutsq, n, n, "pair:cutsq");
  for (auto &coefficient : coefficients) memory->create(coefficient, n, n, "pair:coefficient");
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      setflag[i][j] = 0;
      cutsq[i][j] = 0.0;
      for (auto &coefficient : coefficients) coefficient[i][j] = 0.0;
    }
  max_radius.assign(n, 0.0);
  min_radius.assign(n, 0.0);
  laws.assign((size_t) 2 * n * n, EVP::Law());
}

/* ----------------------------------------------------------------------
   pair_style evp/lj [contact literal|repulsive|none] [overlap 0.3]
------------------------------------------------------------------------- */

void PairEVPLJ::settings(int narg, char **arg)
{
  Settings chosen = {Contact::LITERAL, 0.3};
  for (int iarg = 0; iarg < narg; iarg += 2) {
    const std::string key = arg[iarg];
    if (key != "contact" && key != "overlap")
      error->all(FLERR, "Pair style evp/lj: unknown keyword '{}'; it takes contact and overlap",
                 key);
    if (iarg + 1 == narg) error->all(FLERR, "Pair style evp/lj: keyword {} needs a value", key);
    const std::string value = arg[iarg + 1];
    if (key == "contact") {
      if (value == "literal")
        chosen.contact = Contact::LITERAL;
      else if (value == "repulsive")
        chosen.contact = Contact::REPULSIVE;
      else if (value == "none")
        chosen.contact = Contact::NONE;
      else
        error->all(FLERR, "Pair style evp/lj: contact must be literal, repulsive or none, got '{}'",
                   value);
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

/* ----------------------------------------------------------------------
   p1 p2 p3 of compute pair/local. Before 2026 LAMMPS copies those of a sub-style of
   pair_style hybrid without end, and crashes; there, asking for them is an error instead
------------------------------------------------------------------------- */

void PairEVPLJ::offer_pair_values()
{
  single_extra = strcmp(force->pair_style, "hybrid") == 0 ? 0 : NVALUES;
}

/* ----------------------------------------------------------------------
   pair_coeff I J e1 m1 n1 e2 m2 n2 xi_s gamma alpha
   pair_coeff I J FILE NAME
------------------------------------------------------------------------- */

void PairEVPLJ::coeff(int narg, char **arg)
{
  if (narg < 3)
    error->all(FLERR,
               "Pair evp/lj: pair_coeff needs two atom types and a row: the 9 numbers e1 m1 n1 e2 "
               "m2 n2 xi_s gamma alpha, or FILE NAME");
  if (!allocated) allocate();

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);

  EVP::Row row{};
  try {
    if (narg == 3)
      throw EVP::BadInput("pair_coeff I J needs a row: the 9 numbers e1 m1 n1 e2 m2 n2 xi_s gamma "
                          "alpha, or FILE NAME with the name of a row in the file");
    if (narg == 4)
      row = row_from_file(arg[2], arg[3]);
    else
      row = EVP::parse_row({arg + 2, arg + narg});
  } catch (const EVP::BadInput &bad) {
    error->all(FLERR, "Pair evp/lj: {}", bad.what());
  }

  const double value[NCOEFF] = {row.e1, row.m1,   row.n1,    row.e2,   row.m2,
                                row.n2, row.xi_s, row.gamma, row.alpha};
  bool any = false;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      for (int k = 0; k < NCOEFF; k++) coefficients[k][i][j] = coefficients[k][j][i] = value[k];
      setflag[i][j] = 1;
      any = true;
    }
  repack = true;
  if (!any)
    error->all(FLERR, "Pair evp/lj: pair_coeff {} {} names no pair of types I <= J", arg[0],
               arg[1]);
}

/* ----------------------------------------------------------------------
   the first process reads the file, all check it and stop together
------------------------------------------------------------------------- */

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

/* ---------------------------------------------------------------------- */

EVP::Row PairEVPLJ::row_of(int i, int j) const
{
  double c[NCOEFF];
  for (int k = 0; k < NCOEFF; k++) c[k] = coefficients[k][i][j];
  return {c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]};
}

/* ---------------------------------------------------------------------- */

double PairEVPLJ::alpha_given(int itype, int jtype) const
{
  const int low = std::min(itype, jtype), high = std::max(itype, jtype);
  return allocated && setflag[low][high] ? coefficients[NCOEFF - 1][low][high] : 0.0;
}

/* ---------------------------------------------------------------------- */

double PairEVPLJ::alpha_of(int itype, int jtype) const
{
  return serves(itype, jtype) ? coefficients[NCOEFF - 1][itype][jtype] : 0.0;
}
