// SPDX-License-Identifier: GPL-2.0-only

#include "user_input.h"

#include "collective.h"
#include "core/potential_file.h"

#include "comm.h"
#include "lammps.h"
#include "update.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <sstream>

namespace EVP {

Reading read_text(const std::string &path, int most, std::string &text, MPI_Comm world)
{
  int me;
  MPI_Comm_rank(world, &me);
  Reading reading = Reading::DONE;
  text.clear();
  if (me == 0) {
    FILE *const fp = fopen(path.c_str(), "rb");
    if (fp) {
      text.resize((size_t) most + 1);
      text.resize(fread(&text[0], 1, text.size(), fp));
      if (ferror(fp)) reading = Reading::FAILED;
      fclose(fp);
    } else
      reading = errno == ENOENT || errno == ENOTDIR ? Reading::MISSING : Reading::FAILED;
    if (reading == Reading::DONE && text.size() > (size_t) most) reading = Reading::TOO_LARGE;
    if (reading != Reading::DONE) text.clear();
  }
  std::array<int, 2> outcome = {(int) reading, (int) text.size()};
  MPI_Bcast(outcome.data(), 2, MPI_INT, 0, world);
  text.resize(outcome[1]);
  MPI_Bcast(&text[0], outcome[1], MPI_CHAR, 0, world);
  return (Reading) outcome[0];
}

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
