// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_ROW_READER_H
#define LMP_EVP_ROW_READER_H

#include "core/row_keywords.h"

#include <string>

namespace LAMMPS_NS {

/// Collective. The row of that name in a potential file, which is looked for as LAMMPS does; throws BadInput
/// on all MPI ranks.
EVP::GivenRow read_row(class LAMMPS *, const std::string &file, const std::string &name);

}    // namespace LAMMPS_NS

#endif
