/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: commands and checks before a run. */

#include "pair_evp_lj.h"

#include "evp_params.h"
#include "fix_evp_bonds.h"
#include "lammps_compat.h"

#include "atom.h"
#include "atom_vec.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

static constexpr long MAX_FILE_SIZE = 1 << 20;

/* ---------------------------------------------------------------------- */

PairEVPLJ::PairEVPLJ(LAMMPS *lmp) :
    Pair(lmp), settings_now{Contact::LITERAL, 0.3}, coefficients{}, any_gamma(false),
    implicit_groupbit(0), explicit_atoms(true), bonds(nullptr), overlap_warned(false),
    explicit_damping(false), repack(true), radii_vary(false)
{
  writedata = 1;
  finitecutflag = 1;
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
      for (auto &coefficient : coefficients) coefficient[i][j] = 0.0;
    }
  max_radius.assign(n, 0.0);
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

double PairEVPLJ::alpha_of(int itype, int jtype) const
{
  return allocated ? coefficients[NCOEFF - 1][itype][jtype] : 0.0;
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::init_style()
{
  check_host_settings();
  find_max_radii();
  find_bonds();
  find_implicit_group();
  overlap_warned = false;
  radii_vary = !atom->avec->comm_x_only;    // 'atom_style sphere 1': radii are sent at every step
  reach.assign(laws.size(), 0.0);
  any_gamma = false;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j] && row_of(i, j).gamma > 0.0) any_gamma = true;
  report_settings();
  EVP::compat::request_half_list(neighbor, this, instance_me);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::check_host_settings() const
{
  if (!atom->radius_flag)
    error->all(FLERR, "Pair evp/lj needs particles with a radius: use 'atom_style sphere'");
  if (find(force) != this)
    error->all(FLERR,
               "Pair evp/lj can be one sub-style of pair_style hybrid only, as a pair has one deq: "
               "give its types rows of their own instead");
  if (!atom->tag_enable)
    error->all(FLERR, "Pair evp/lj needs atom IDs: remove 'atom_modify id no'");
  if (!compute_flag && update->whichflag != 0)
    error->all(
        FLERR,
        "Pair evp/lj cannot run with 'pair_modify compute no', as fixes and computes read the "
        "pairs that it finds: use 'pair_style none' for a run without forces");
  for (int k = 1; k < 4; k++)
    if (force->special_lj[k] != 0.0 && force->special_lj[k] != 1.0)
      error->all(FLERR,
                 "Pair evp/lj takes special_bonds weights 0 or 1 only, got {}: the force of a pair "
                 "is whole or absent",
                 force->special_lj[k]);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::find_max_radii()
{
  // types that this style does not serve may have any radius
  std::vector<bool> serves(max_radius.size(), false);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j]) serves[i] = serves[j] = true;

  std::vector<double> here(max_radius.size(), 0.0);
  double smallest = HUGE_VAL, smallest_all;
  for (int i = 0; i < atom->nlocal; i++) {
    const int type = atom->type[i];
    here[type] = std::max(here[type], atom->radius[i]);
    if (serves[type])
      smallest = std::min(smallest, std::isfinite(atom->radius[i]) ? atom->radius[i] : -HUGE_VAL);
  }
  MPI_Allreduce(&smallest, &smallest_all, 1, MPI_DOUBLE, MPI_MIN, world);
  if (!(smallest_all > 0.0))
    error->all(
        FLERR,
        "Pair evp/lj needs particles with a radius above zero, and finite, found {}: use 'set ... "
        "diameter'",
        smallest_all);
  MPI_Allreduce(here.data(), max_radius.data(), (int) here.size(), MPI_DOUBLE, MPI_MAX, world);

  // particles to come
  for (int k = 0; k < modify->nfix; k++)
    if (utils::strmatch(modify->fix[k]->style, "^pour") ||
        utils::strmatch(modify->fix[k]->style, "^deposit"))
      for (int type = 1; type <= atom->ntypes; type++) {
        int itype = type;
        const auto *radius = (const double *) modify->fix[k]->extract("radius", itype);
        if (radius) max_radius[type] = std::max(max_radius[type], *radius);
      }

  for (int type = 1; type <= atom->ntypes; type++)
    if (!serves[type]) max_radius[type] = HUGE_VAL;
}

/* ----------------------------------------------------------------------
   the fix that holds deq of the recorded pairs; once there were records,
   going on without them would silently be another material
------------------------------------------------------------------------- */

void PairEVPLJ::find_bonds()
{
  bonds = nullptr;
  for (int k = 0; k < modify->nfix; k++)
    if (strcmp(modify->fix[k]->style, "evp/bonds") == 0)
      bonds = dynamic_cast<FixEVPBonds *>(modify->fix[k]);

  const bool kept = bonds && bonds->has_recorded();
  if (!bonds_id.empty() && (!kept || bonds_id != bonds->id))
    error->all(FLERR,
               "Pair evp/lj: the bonds were recorded by fix {}, whose records are not here: define "
               "'fix {} all evp/bonds' right after read_restart and before the run, or start anew "
               "with 'pair_style none' and 'pair_style evp/lj'",
               bonds_id, bonds_id);
  if (kept) bonds_id = bonds->id;
}

/* ----------------------------------------------------------------------
   fix nve/evp solves the damping of its atoms; the explicit one leaves them out
------------------------------------------------------------------------- */

void PairEVPLJ::find_implicit_group()
{
  implicit_groupbit = 0;
  for (int k = 0; k < modify->nfix; k++)
    if (strcmp(modify->fix[k]->style, "nve/evp") == 0) implicit_groupbit = modify->fix[k]->groupbit;

  int outside = 0, any;
  for (int i = 0; i < atom->nlocal; i++)
    if (!(atom->mask[i] & implicit_groupbit)) outside = 1;
  MPI_Allreduce(&outside, &any, 1, MPI_INT, MPI_MAX, world);
  explicit_atoms = any;
  repack = true;
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::bonds_recorded_by(const std::string &id)
{
  bonds_id = id;
  if (id.empty()) bonds = nullptr;
  repack = true;
}

/* ---------------------------------------------------------------------- */

double PairEVPLJ::init_one(int i, int j)
{
  if (!setflag[i][j])
    error->all(FLERR,
               "Pair evp/lj does not mix unlike types: give 'pair_coeff {} {}' a row of its own", i,
               j);

  for (auto &coefficient : coefficients) coefficient[j][i] = coefficient[i][j];
  const EVP::Row row = row_of(i, j);
  try {
    EVP::check_row(row);
  } catch (const EVP::BadInput &bad) {
    error->all(FLERR, "Pair evp/lj, types {} and {}: {}", i, j, bad.what());
  }
  EVP::Row undamped = row;
  undamped.gamma = 0.0;
  laws[law_index(i, j)] = laws[law_index(j, i)] = EVP::Law(row);
  laws[nlaws() + law_index(i, j)] = laws[nlaws() + law_index(j, i)] = EVP::Law(undamped);
  repack = true;

  if (row.gamma > 0.0) any_gamma = true;    // fix adapt may have switched it on
  if (damping_acts() && update->whichflag == 1 && explicit_atoms && !comm->ghost_velocity)
    error->all(FLERR,
               "Pair evp/lj with gamma > 0 needs ghost velocities: add 'comm_modify vel yes'");

  // called once at set-up, and again by fix adapt while the neighbor list keeps its reach
  const double cut = row.alpha * (max_radius[i] + max_radius[j]);
  double &longest = reach[law_index(i, j)];
  if (longest == 0.0) longest = cut;
  if (cut > longest * (1.0 + 1.0e-12))
    error->all(
        FLERR,
        "Pair evp/lj, types {} and {}: alpha must not grow during a run, as the neighbor list "
        "keeps its reach: start with the largest, or split the run there",
        i, j);
  return cut;
}

/* ----------------------------------------------------------------------
   one line of what this scene calls for, again only when it changes
------------------------------------------------------------------------- */

void PairEVPLJ::report_settings()
{
  const char *contact[] = {"literal", "repulsive", "none"};
  std::string report = "evp/lj: ";
  if (!any_gamma)
    report += "damping off";
  else
    report += !damping_acts() ? "damping off (minimization)"
        : damps_implicitly()  ? "damping by fix nve/evp"
                              : "damping on";
  report += fmt::format(", new contacts {}", contact[(int) settings_now.contact]);
  if (bonds)
    report += fmt::format(", deq of bonds from fix {}", bonds->id);
  else
    report += ", no fix evp/bonds: every pair has deq = R_i + R_j";
  report += fmt::format(", overlap warned of beyond {} (R_i + R_j)\n", settings_now.overlap);

  if (report == last_report) return;
  last_report = report;
  if (comm->me) return;
  utils::logmesg(lmp, report);
  if (!bonds && settings_now.contact == Contact::NONE)
    error->warning(FLERR,
                   "Pair evp/lj with contact none and without fix evp/bonds: nothing acts at all");
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j] && alpha_of(i, j) < 1.4 && settings_now.contact == Contact::LITERAL)
        error->warning(FLERR,
                       "Pair evp/lj, types {} and {}: alpha = {} is below 1.4, where literal new "
                       "contacts can pull the body together; use contact repulsive or none",
                       i, j, alpha_of(i, j));
}
