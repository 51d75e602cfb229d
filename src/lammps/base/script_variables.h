// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps/base/lammps_names.h"

#include <string>

namespace EVP {

/// Is there a variable of the input script with this name that set_script_variable() has not set, or has been changed since?
bool is_variable_of_user(LAMMPS *, const std::string &name);

/// Sets a string-style variable of the input script. Collective: stops, naming `who` and the remedy, where that would overwrite
/// one of the user's.
void set_script_variable(LAMMPS *, const std::string &who, const std::string &name,
                         const std::string &value, const std::string &remedy);

}    // namespace EVP
