// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_READ_EVP_ROW_H
#define LMP_READ_EVP_ROW_H

#include "command.h"

#include <string>

namespace LAMMPS_NS {

/// read_evp_row FILE:ROW PREFIX: the numbers of a row as variables of the input script.
class ReadEVPRow : public Command {
 public:
  ReadEVPRow(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  void set_variable(const std::string &name, double value) const;
};

}    // namespace LAMMPS_NS

#endif
