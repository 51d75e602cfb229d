// SPDX-License-Identifier: GPL-2.0-only

#include "row_reader.h"

#include "core/potential_file.h"
#include "text_reader.h"

#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "update.h"
#include "utils.h"

namespace EVP {

static constexpr int MAX_FILE_SIZE = 1 << 20;

// file, name: a word each, or both one word
static Row read_file(LAMMPS *lmp, const std::string &file, const std::string &name, bool apart)
{
  const std::string path = lmp->comm->me == 0 ? utils::get_potential_file_path(file) : "";
  std::string text;
  const Reading reading = read_text(path, MAX_FILE_SIZE, text, lmp->world);
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
