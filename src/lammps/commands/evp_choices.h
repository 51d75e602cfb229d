// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "command.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

/// evp_choices SCRIPT CHOICE ...: prints the choices of an input script, stops where one breaks its rules.
class EVPChoices : public Command {
 public:
  EVPChoices(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  void set_implied(int, char **) const;
  void claim(const char *script, const std::string &name, const std::string &value) const;
  void set_here() const;
  void find_saved_run(const std::string &script, const std::vector<std::string> &texts,
                      const std::string &prefix) const;
  void write_as_integer(const std::string &name, const std::string &value) const;
};

}    // namespace LAMMPS_NS
