// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/// read_evp_row ROW PREFIX: the numbers of a row, given as in pair_coeff, as variables of the input script.
class ReadEVPRow : public Command {
 public:
  ReadEVPRow(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
