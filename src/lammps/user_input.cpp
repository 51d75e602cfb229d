// SPDX-License-Identifier: GPL-2.0-only

#include "user_input.h"

#include "collective.h"
#include "core/potential_file.h"

#include "comm.h"
#include "lammps.h"
#include "update.h"

#include <fstream>
#include <sstream>

namespace EVP {

// Collective. name: of the row
static Row read_file(LAMMPS *lmp, const std::string &file, const std::string &name)
{
  std::string text, complaint;
  if (lmp->comm->me == 0) {
    std::ifstream in(utils::get_potential_file_path(file), std::ios::binary);
    std::ostringstream read;
    read << in.rdbuf();
    text = read.str();
    if (text.empty())
      complaint = "cannot read the potential file '" + shown(file) +
          "': give its path, or put its folder into LAMMPS_POTENTIALS; a row of numbers has " +
          row_keys();
  }
  throw_together(complaint, lmp->world);
  int size = (int) text.size();
  MPI_Bcast(&size, 1, MPI_INT, 0, lmp->world);
  text.resize(size);
  MPI_Bcast(text.data(), size, MPI_CHAR, 0, lmp->world);
  return row_from_text(text, file, name, lmp->update->unit_style);
}

Row read_row(LAMMPS *lmp, const std::vector<std::string> &words)
{
  const auto found = find_file_and_row(words);
  return found ? read_file(lmp, (*found)[0], (*found)[1]) : parse_row(words);
}

}    // namespace EVP
