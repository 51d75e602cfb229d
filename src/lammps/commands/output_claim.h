// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <string>

namespace EVP {

/// Claims all files that begin with a prefix for this process, until it ends or claims another prefix. False where another
/// process has them. The claim is a lock on PREFIX.lock, which goes with it; a process that was killed has none. Where no
/// file can be locked nothing is claimed, and it returns true.
bool claim_output(const std::string &prefix);

}    // namespace EVP
