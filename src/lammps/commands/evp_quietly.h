// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/// evp_quietly COMMAND ...: another command, of whose output only warnings, errors and the lines of EVP go to the screen; the
/// log file has all.
class EVPQuietly : public Command {
 public:
  EVPQuietly(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
