// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps_names.h"

#include <string>

namespace EVP {

/// Variables PREFIX_NAME of the input script that a command sets. They are of style string, which keeps all digits
/// where ${PREFIX_NAME} is replaced. Stops where the prefix is no name, or a variable has another style.
class PrefixedVariables : protected Pointers {
 public:
  PrefixedVariables(LAMMPS *, const std::string &command, const std::string &prefix);
  void set(const std::string &name, double value) const;

 private:
  std::string command, prefix;
};

}    // namespace EVP
