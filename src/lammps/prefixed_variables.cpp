// SPDX-License-Identifier: GPL-2.0-only

#include "prefixed_variables.h"

#include "core/text.h"

#include "error.h"
#include "input.h"
#include "variable.h"

#include <algorithm>
#include <cctype>

namespace EVP {

PrefixedVariables::PrefixedVariables(LAMMPS *lmp, const std::string &command_in,
                                     const std::string &prefix_in) :
    Pointers(lmp),
    command(command_in), prefix(prefix_in)
{
  const bool is_word = std::all_of(prefix.begin(), prefix.end(), [](unsigned char c) {
    return isalnum(c) || c == '_';
  });
  if (prefix.empty() || !is_word)
    error->all(FLERR,
               "{}: the prefix must consist of letters, digits and underscores, as names of "
               "variables do, got '{}'",
               command, shown(prefix));
}

void PrefixedVariables::set(const std::string &name, double value) const
{
  const std::string full = prefix + "_" + name, text = shortest_text(value);
  Variable *const variable = input->variable;
  if (variable->find(full.c_str()) < 0)
    variable->set(full + " string " + text);
  else if (variable->set_string(full.c_str(), text.c_str()) < 0)
    error->all(FLERR,
               "{}: there is a variable {} of another style: delete it, or choose another prefix",
               command, full);
}

}    // namespace EVP
