// SPDX-License-Identifier: GPL-2.0-only

#include "row_reader.h"

#include "core/potential_file.h"
#include "text_reader.h"

#include "comm.h"
#include "lammps.h"
#include "update.h"
#include "utils.h"

namespace EVP {

static constexpr int MAX_FILE_SIZE = 1 << 20;

static GivenRow read_file(LAMMPS *lmp, const std::string &file, const std::string &name)
{
  const std::string path = lmp->comm->me == 0 ? utils::get_potential_file_path(file) : "";
  std::string text;
  const Reading reading = read_text(path, MAX_FILE_SIZE, text, lmp->world);
  if (reading == Reading::TOO_LARGE)
    throw BadInput("file " + file + " is larger than 1 MiB: not a potential file");
  if (reading != Reading::DONE)
    throw BadInput("cannot read the potential file '" + file +
                   "': give its path, or put its folder into LAMMPS_POTENTIALS");
  return row_from_text(text, file, name, lmp->update->unit_style);
}

GivenRow read_row(LAMMPS *lmp, const std::vector<std::string> &words)
{
  if (words.size() == 1) {
    const auto [file, name] = split_file_and_row(words[0]);
    return read_file(lmp, file, name);
  }
  return words.size() == 2 ? read_file(lmp, words[0], words[1]) : parse_row(words);
}

}    // namespace EVP
