// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/row.h"
#include "lammps_names.h"

#include <string>
#include <vector>

namespace EVP {

/// Collective. The row that the words of a command give: FILE:ROW, or FILE and ROW, of a potential file, which is
/// looked for as LAMMPS does; or its numbers and keywords. Throws BadInput on all MPI ranks.
Row read_row(LAMMPS *, const std::vector<std::string> &words);

}    // namespace EVP
