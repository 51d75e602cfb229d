// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_ROW_READER_H
#define LMP_EVP_ROW_READER_H

#include "core/row_keywords.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Collective. The row that the words of a command give: FILE:ROW, or FILE and ROW, of a potential file, which is
/// looked for as LAMMPS does; or its numbers and keywords. Throws BadInput on all MPI ranks.
EVP::GivenRow read_row(class LAMMPS *, const std::vector<std::string> &words);

}    // namespace LAMMPS_NS

#endif
