// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_CORE_BOND_H
#define EVP_CORE_BOND_H

#include <cstdint>

namespace EVP {

/// A recorded pair as one of its atoms keeps it.
struct Bond {
  int64_t partner;    ///< ID of the other atom
  double deq;         ///< distance at recording [length]
};

}    // namespace EVP

#endif
