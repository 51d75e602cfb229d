// SPDX-License-Identifier: GPL-2.0-only
//
// Pair style evp/lj: restart files, data files, fix adapt.

#include "pair_evp_lj.h"

#include "core/checksum.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "utils.h"

#include <vector>

using namespace LAMMPS_NS;

static constexpr double FORMAT = 1003.0;    // of the words of the settings
static constexpr int NSETTINGS = 4;         // format, contact, overlap, length of the fix's ID
static constexpr double LONGEST_ID = 1000;

// restart files hold settings, the fix that recorded, and one Row per pair of types
void PairEVPLJ::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fwrite(&setflag[i][j], sizeof(int), 1, fp);
      const auto words = coefficients.words(i, j);
      if (setflag[i][j]) fwrite(words.data(), sizeof(words), 1, fp);
    }
}

void PairEVPLJ::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();
  const auto read = [&](void *data, size_t size) {
    if (comm->me == 0) utils::sfread(FLERR, data, size, 1, fp, nullptr, error);
    MPI_Bcast(data, (int) size, MPI_BYTE, 0, world);
  };
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      read(&setflag[i][j], sizeof(int));
      if (!setflag[i][j]) continue;
      EVP::Coefficients::Words words;
      read(words.data(), sizeof(words));
      if (!coefficients.set(i, j, words))
        error->all(FLERR, "Pair evp/lj: the restart file is damaged in the row of types {} and {}",
                   i, j);
    }
}

void PairEVPLJ::write_restart_settings(FILE *fp)
{
  std::vector<double> words = {FORMAT, (double) (int) settings_now.contact, settings_now.overlap,
                               (double) bonds_id.size()};
  words.insert(words.end(), bonds_id.begin(), bonds_id.end());
  words.push_back(EVP::checksum(words.data(), (int) words.size()));
  fwrite(words.data(), sizeof(double), words.size(), fp);
}

void PairEVPLJ::read_restart_settings(FILE *fp)
{
  std::vector<double> words(NSETTINGS);
  const auto read = [&](size_t first) {
    const int n = (int) (words.size() - first);
    if (comm->me == 0) utils::sfread(FLERR, &words[first], sizeof(double), n, fp, nullptr, error);
    MPI_Bcast(&words[first], n, MPI_DOUBLE, 0, world);
  };
  read(0);
  bool whole = words[0] == FORMAT && words[3] >= 0.0 && words[3] <= LONGEST_ID;
  if (whole) {
    words.resize(NSETTINGS + (int) words[3] + 1);
    read(NSETTINGS);
    whole = words.back() == EVP::checksum(words.data(), (int) words.size() - 1);
  }
  if (!whole)
    error->all(FLERR,
               "Pair evp/lj: the restart file is damaged in the settings, or from a version of "
               "this package that wrote another format");
  settings_now = {(Contact) (int) words[1], words[2]};
  bonds_id.assign(words.begin() + NSETTINGS, words.end() - 1);
  offer_pair_values();
}

static void print_row(FILE *fp, const EVP::Row &row)
{
  for (const EVP::Member &member : EVP::MEMBERS) fprintf(fp, " %.17g", row.*member.value);
  fprintf(fp, "\n");
}

void PairEVPLJ::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) {
    fprintf(fp, "%d", i);
    print_row(fp, coefficients.row(i, i));
  }
}

void PairEVPLJ::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fprintf(fp, "%d %d", i, j);
      print_row(fp, coefficients.row(i, j));
    }
}

// a coefficient by its name in the table, for fix adapt
void *PairEVPLJ::extract(const char *name, int &dim)
{
  dim = 2;
  return coefficients.table(name);
}
