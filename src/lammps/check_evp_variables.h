// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "command.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

/// check_evp_variables [path NAME ...] [include NAME ...]: stops where -var set a variable that the input script does not know, or a
/// path with a blank.
class CheckEVPVariables : public Command {
 public:
  CheckEVPVariables(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  std::string path_of(const std::string &name) const;
  std::vector<std::string> given_by_var() const;
  std::string first_with_plus() const;
  std::string first_unknown(const std::string &mentioned) const;
};

}    // namespace LAMMPS_NS
