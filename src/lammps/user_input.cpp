// SPDX-License-Identifier: GPL-2.0-only

#include "user_input.h"

#include "core/potential_file.h"

#include "comm.h"
#include "lammps.h"
#include "update.h"

#include <array>
#include <cerrno>
#include <cstdio>

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

static constexpr int MOST_BYTES = 1 << 20;

// file, name: a word each, or both one word
static Row read_file(LAMMPS *lmp, const std::string &file, const std::string &name, bool apart)
{
  const std::string path = lmp->comm->me == 0 ? utils::get_potential_file_path(file) : "";
  std::string text;
  const Reading reading = read_text(path, MOST_BYTES, text, lmp->world);
  if (reading == Reading::TOO_LARGE)
    throw BadInput("file " + file + " is larger than 1 MiB: not a potential file");
  if (reading != Reading::DONE && apart && file.find(':') != std::string::npos)
    throw BadInput("unexpected argument '" + shown(name) + "' after '" + shown(file) +
                   "', which is no file but FILE:ROW: a row of a file takes no further arguments, "
                   "its keywords are in the file");
  if (reading != Reading::DONE)
    throw BadInput("cannot read the potential file '" + file +
                   "': give its path, or put its folder into LAMMPS_POTENTIALS" +
                   (looks_like_number(file) ? "; a row of numbers has " + row_keys() : ""));
  bool is_last = false;
  const Row row = row_from_text(text, file, name, lmp->update->unit_style, &is_last);
  if (is_last && lmp->comm->me == 0)
    lmp->error->warning(FLERR,
                        "file {}: the line of row '{}', the last one, has no line end: if the file "
                        "was cut, its last number is incomplete; add a line end",
                        file, name);
  return row;
}

Row read_row(LAMMPS *lmp, const std::vector<std::string> &words)
{
  const auto found = find_file_and_row(words);
  return found ? read_file(lmp, (*found)[0], (*found)[1], words.size() > 1) : parse_row(words);
}

}    // namespace EVP
