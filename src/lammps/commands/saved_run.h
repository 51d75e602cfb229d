// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <string>

namespace EVP {

/// What a run has left to be resumed from.
struct SavedRun {
  std::string choices;    ///< first line of PREFIX.resume, without "# "; empty if there is none
  int state =
      -1;    ///< K of the newest of PREFIX.0.restart and PREFIX.1.restart that is whole; -1 if there is none
};

SavedRun read_saved_run(const std::string &prefix);

}    // namespace EVP
