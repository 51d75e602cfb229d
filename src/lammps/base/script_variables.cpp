// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/base/script_variables.h"

#include "error.h"
#include "input.h"
#include "variable.h"

#include <map>
#include <utility>

namespace EVP {

namespace {

  // What each has been set to. `clear` keeps the variables of LAMMPS, and so does this.
  std::map<std::pair<const Variable *, std::string>, std::string> values_set;

}    // namespace

bool is_variable_of_user(LAMMPS *lmp, const std::string &name)
{
  Variable *const variable = lmp->input->variable;
  if (variable->find(name.c_str()) < 0) return false;
  const auto set = values_set.find({variable, name});
  if (set == values_set.end()) return true;
  const char *const value = variable->retrieve(name.c_str());
  return !value || set->second != value;
}

void set_script_variable(LAMMPS *lmp, const std::string &who, const std::string &name,
                         const std::string &value, const std::string &remedy)
{
  if (is_variable_of_user(lmp, name))
    lmp->error->all(FLERR, "{}: there is a variable '{}' already, which would be overwritten: {}",
                    who, name, remedy);
  std::string words[] = {name, "string", value};
  char *args[] = {words[0].data(), words[1].data(), words[2].data()};
  Variable *const variable = lmp->input->variable;
  variable->set(3, args);
  values_set[{variable, name}] = variable->retrieve(name.c_str());
}

}    // namespace EVP
