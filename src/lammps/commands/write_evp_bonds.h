// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_file.h"
#include "core/bonds/bond_store.h"

#include "command.h"

#include <string>

namespace LAMMPS_NS {

/// write_evp_bonds FILE: the records of fix evp/bonds as text, beside a data file.
class WriteEVPBonds : public Command {
 public:
  WriteEVPBonds(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  const EVP::BondStore &find_records() const;
  std::string lines_of_pairs(const EVP::BondStore &, EVP::BondHeader &) const;
  std::string lines_of_spheres(const EVP::BondStore &, EVP::BondHeader &) const;
  bool write_in_order_of_ranks(const std::string &text, FILE *) const;
};

}    // namespace LAMMPS_NS
