/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: restart files, data files, fix adapt. */

#include "pair_evp_lj.h"

#include "core/checksum.h"
#include "core/params.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "utils.h"

#include <vector>

using namespace LAMMPS_NS;

static constexpr double FORMAT = 1003.0;    // of the words of the settings
static constexpr int NSETTINGS = 4;         // format, contact, overlap, length of the fix's ID
static constexpr double LONGEST_ID = 1000;

/* ----------------------------------------------------------------------
   restart files hold settings, the fix that recorded, and one Row per pair of types
------------------------------------------------------------------------- */

void PairEVPLJ::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fwrite(&setflag[i][j], sizeof(int), 1, fp);
      if (!setflag[i][j]) continue;
      double value[NCOEFF + 1];
      for (int k = 0; k < NCOEFF; k++) value[k] = coefficients[k][i][j];
      value[NCOEFF] = EVP::checksum(value, NCOEFF);
      fwrite(value, sizeof(value), 1, fp);
    }
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      double value[NCOEFF + 1];
      if (comm->me == 0) {
        utils::sfread(FLERR, &setflag[i][j], sizeof(int), 1, fp, nullptr, error);
        if (setflag[i][j]) utils::sfread(FLERR, value, sizeof(value), 1, fp, nullptr, error);
        if (setflag[i][j] && value[NCOEFF] != EVP::checksum(value, NCOEFF))
          error->one(FLERR,
                     "Pair evp/lj: the restart file is damaged in the row of types {} and {}", i,
                     j);
      }
      MPI_Bcast(&setflag[i][j], 1, MPI_INT, 0, world);
      if (!setflag[i][j]) continue;
      MPI_Bcast(value, NCOEFF, MPI_DOUBLE, 0, world);
      for (int k = 0; k < NCOEFF; k++) coefficients[k][i][j] = coefficients[k][j][i] = value[k];
    }
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::write_restart_settings(FILE *fp)
{
  std::vector<double> words = {FORMAT, (double) (int) settings_now.contact, settings_now.overlap,
                               (double) bonds_id.size()};
  for (const char letter : bonds_id) words.push_back((double) letter);
  words.push_back(EVP::checksum(words.data(), (int) words.size()));
  fwrite(words.data(), sizeof(double), words.size(), fp);
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::read_restart_settings(FILE *fp)
{
  const auto damaged = [this] {
    error->one(FLERR,
               "Pair evp/lj: the restart file is damaged in the settings, or from a version of "
               "this package that wrote another format");
  };
  std::vector<double> words(NSETTINGS);
  int size = 0;
  if (comm->me == 0) {
    utils::sfread(FLERR, words.data(), sizeof(double), NSETTINGS, fp, nullptr, error);
    if (words[0] != FORMAT || !(words[3] >= 0.0 && words[3] <= LONGEST_ID)) damaged();
    size = NSETTINGS + (int) words[3] + 1;
    words.resize(size);
    utils::sfread(FLERR, &words[NSETTINGS], sizeof(double), size - NSETTINGS, fp, nullptr, error);
    if (words[size - 1] != EVP::checksum(words.data(), size - 1)) damaged();
  }
  MPI_Bcast(&size, 1, MPI_INT, 0, world);
  words.resize(size);
  MPI_Bcast(words.data(), size, MPI_DOUBLE, 0, world);
  settings_now = {(Contact) (int) words[1], words[2]};
  bonds_id.clear();
  for (int k = NSETTINGS; k < size - 1; k++) bonds_id += (char) words[k];
  offer_pair_values();
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) {
    fprintf(fp, "%d", i);
    for (auto &coefficient : coefficients) fprintf(fp, " %.17g", coefficient[i][i]);
    fprintf(fp, "\n");
  }
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fprintf(fp, "%d %d", i, j);
      for (auto &coefficient : coefficients) fprintf(fp, " %.17g", coefficient[i][j]);
      fprintf(fp, "\n");
    }
}

/* ----------------------------------------------------------------------
   the nine coefficients by their names in the table, for fix adapt
------------------------------------------------------------------------- */

void *PairEVPLJ::extract(const char *name, int &dim)
{
  dim = 2;
  const auto &keys = EVP::row_keys();
  for (int k = 0; k < NCOEFF; k++)
    if (keys[k] == name) return (void *) coefficients[k];
  return nullptr;
}
