// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_EVP_SCALING_REPORT_H
#define LMP_EVP_SCALING_REPORT_H

#include "core/coefficients.h"
#include "cut_offs.h"

#include <string>

namespace LAMMPS_NS {

/// Lines for users: what the rows that name the bodies they hold for are multiplied by in this body. Empty
/// where no pair of types that is handled has such a row.
std::string describe_scaling(const EVP::Coefficients &, const CutOffs &, int ntypes);

}    // namespace LAMMPS_NS

#endif
