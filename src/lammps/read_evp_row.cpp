// SPDX-License-Identifier: GPL-2.0-only

#include "read_evp_row.h"

#include "core/potential_file.h"
#include "keywords.h"
#include "row_reader.h"

#include "input.h"
#include "variable.h"

#include <algorithm>
#include <cctype>

using namespace LAMMPS_NS;

void ReadEVPRow::command(int narg, char **arg)
{
  if (narg != 2)
    error->all(FLERR,
               "read_evp_row: expected two arguments, FILE:ROW and the prefix of the variables, "
               "got {}",
               narg);
  const std::string prefix = arg[1];
  const bool is_word = std::all_of(prefix.begin(), prefix.end(), [](unsigned char c) {
    return isalnum(c) || c == '_';
  });
  if (prefix.empty() || !is_word)
    error->all(FLERR,
               "read_evp_row: the prefix must consist of letters, digits and underscores, as names "
               "of variables do, got '{}'",
               EVP::shown(prefix));

  EVP::GivenRow given;
  EVP::stop_at_bad_input(error, "read_evp_row", [&] {
    const auto [file, name] = EVP::split_file_and_row(arg[0]);
    given = read_row(lmp, file, name);
  });
  for (const EVP::Member &member : EVP::MEMBERS)
    set_variable(prefix + "_" + member.key, given.row.*member.value);
  for (const EVP::KeywordMember &member : EVP::KEYWORDS)
    set_variable(prefix + "_" + member.key, given.keywords.*member.value);
}

// of style string, which keeps all digits where it is put in place of ${name}
void ReadEVPRow::set_variable(const std::string &name, double value) const
{
  Variable *const variable = input->variable;
  const std::string text = EVP::shortest_text(value);
  if (variable->find(name.c_str()) < 0)
    variable->set(name + " string " + text);
  else if (variable->set_string(name.c_str(), text.c_str()) < 0)
    error->all(FLERR,
               "read_evp_row: there is a variable {} of another style: delete it, or choose "
               "another prefix",
               name);
}
