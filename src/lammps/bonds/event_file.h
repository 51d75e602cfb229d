// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps/base/lammps_names.h"

#include <cstdio>
#include <string>
#include <vector>

namespace EVP {

/// The end or the beginning of a bond, as an MPI rank has met it.
struct BondEvent {
  enum Why : int64_t { JOINED, AT_DLIM, FAILED };
  static constexpr const char *NAMES[] = {"joined", "dlim", "failed"};    ///< in the file

  bigint step;
  int64_t why;
  tagint i, j;        ///< IDs, i < j
  double place[3];    ///< half way between both spheres, in the box [length]
};

/// A text file of events, one per line: step i j what x y z.
class EventFile : protected Pointers {
 public:
  /// Stops where it cannot be written.
  EventFile(LAMMPS *, const std::string &who_in, const std::string &name_in);
  ~EventFile() override;

  /// At the first set-up: keeps the lines up to this step, which come before the restart file that the run goes on from.
  /// Those of later steps will come again. last_step < 0: begins it anew.
  void begin(bigint last_step);

  /// Collective. Appends those of all MPI ranks since the last call, in order, and clears them.
  void write(std::vector<BondEvent> &);

 private:
  const std::string who, name;
  bool begun = false;
  FILE *file = nullptr;    // on the first rank
};

}    // namespace EVP
