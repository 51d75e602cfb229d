// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/body_measures.h"

#include "command.h"

namespace LAMMPS_NS {

/// read_evp_body FILE PREFIX [length L] [radius R] [area A]: the measures of the body that a data file holds, checked
/// against its atoms, as variables of the input script.
class ReadEVPBody : public Command {
 public:
  ReadEVPBody(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 private:
  EVP::BodyMeasures read_description(EVP::MeasureSource &source) const;
  EVP::Centres find_centres() const;
  EVP::FilledVolume sum_spheres(double length) const;
  void report(const EVP::BodyMeasures &body, const EVP::MeasureSource &source) const;
};

}    // namespace LAMMPS_NS
