// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <mpi.h>
#include <string>

namespace EVP {

enum class Reading : int { DONE, MISSING, FAILED, TOO_LARGE };

/// Collective. Rank 0 reads a file of at most `most` bytes, whose path matters there only; all MPI ranks get its text,
/// and the same outcome.
Reading read_text(const std::string &path, int most, std::string &text, MPI_Comm world);

}    // namespace EVP
