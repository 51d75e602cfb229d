// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/// evp_quietly COMMAND ...: another command, of whose output only warnings and errors go to the screen; the log file takes all.
class EVPQuietly : public Command {
 public:
  EVPQuietly(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
