// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law/row_text.h"

#include "command.h"

#include <string>

namespace LAMMPS_NS {

/// read_evp_row ROW PREFIX: the numbers of a row, given as in pair_coeff, as variables of the input script.
class ReadEVPRow : public Command {
 public:
  ReadEVPRow(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  struct Spheres {
    double number_density, diameter;
  };
  Spheres spheres_of(char **words) const;
  static void set_number(EVP::Row &, const std::string &key, const std::string &number);
};

}    // namespace LAMMPS_NS
