// SPDX-License-Identifier: GPL-2.0-only

#include "row_reader.h"

#include "core/potential_file.h"

#include "comm.h"
#include "lammps.h"
#include "update.h"
#include "utils.h"

#include <mpi.h>

using namespace LAMMPS_NS;

static constexpr int MAX_FILE_SIZE = 1 << 20;

// rank 0 reads the file, all MPI ranks check it and stop together
EVP::GivenRow LAMMPS_NS::read_row(LAMMPS *lmp, const std::string &file, const std::string &name)
{
  std::string text;
  int size = -1;
  if (lmp->comm->me == 0) {
    const std::string path = utils::get_potential_file_path(file);
    FILE *fp = path.empty() ? nullptr : fopen(path.c_str(), "rb");
    if (fp) {
      text.resize(MAX_FILE_SIZE + 1);
      text.resize(fread(&text[0], 1, text.size(), fp));
      size = ferror(fp) ? -1 : (int) text.size();
      fclose(fp);
    }
  }
  MPI_Bcast(&size, 1, MPI_INT, 0, lmp->world);
  if (size < 0)
    throw EVP::BadInput("cannot read the potential file '" + file +
                        "': give its path, or put its folder into LAMMPS_POTENTIALS");
  if (size > MAX_FILE_SIZE)
    throw EVP::BadInput("file " + file + " is larger than 1 MiB: not a potential file");
  text.resize(size);
  MPI_Bcast(&text[0], size, MPI_CHAR, 0, lmp->world);
  return EVP::row_from_text(text, file, name, lmp->update->unit_style);
}
