// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "command.h"

#include <array>
#include <string>

namespace LAMMPS_NS {

/// write_evp_bonds FILE: the records of fix evp/bonds as text, beside a data file.
class WriteEVPBonds : public Command {
 public:
  WriteEVPBonds(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  const class FixEVPBonds *find_recorded() const;
  std::string own_lines(std::array<bigint, 2> &counts) const;
  bool write_in_order_of_ranks(const std::string &text, FILE *) const;
};

}    // namespace LAMMPS_NS
