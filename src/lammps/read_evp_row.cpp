// SPDX-License-Identifier: GPL-2.0-only

#include "read_evp_row.h"

#include "user_input.h"

#include "input.h"
#include "variable.h"

using namespace LAMMPS_NS;

// read_evp_row FILE:ROW PREFIX, or FILE ROW PREFIX, or e1 m1 ... alpha [keyword value ...] PREFIX, where the numbers
// may be one quoted word
void ReadEVPRow::command(int narg, char **arg)
{
  if (narg < 2)
    error->all(FLERR,
               "read_evp_row: expected at least two arguments, a row (FILE:ROW or its numbers) "
               "and the prefix of the variables, got {}",
               narg);
  std::vector<std::string> words = {arg, arg + narg - 1};
  if (words.size() == 1 && words[0].find(':') == std::string::npos)
    words = EVP::split_words(words[0]);

  EVP::Row row;
  EVP::stop_at_bad_input(error, "read_evp_row", [&] {
    row = EVP::read_row(lmp, words);
  });
  for (const EVP::Member &member : EVP::MEMBERS)
    input->variable->set(fmt::format("{}_{} string {}", arg[narg - 1], member.key,
                                     EVP::shortest_text(row.*member.value)));
}
