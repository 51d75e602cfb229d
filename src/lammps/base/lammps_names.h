// SPDX-License-Identifier: GPL-2.0-only
//
// LAMMPS' names in EVP, the namespace of all that is not a style.
#pragma once

#include "pointers.h"

namespace LAMMPS_NS {
class Fix;
class NeighList;
class Pair;
}    // namespace LAMMPS_NS

namespace EVP {
using namespace LAMMPS_NS;
}    // namespace EVP
