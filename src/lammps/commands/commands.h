// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_file.h"
#include "core/bonds/bond_store.h"
#include "core/law/row_text.h"

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

/// evp_quietly COMMAND ...: another command, of whose output only warnings, errors and the lines of EVP go to the screen; the
/// log file has all.
class EVPQuietly : public Command {
 public:
  EVPQuietly(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
