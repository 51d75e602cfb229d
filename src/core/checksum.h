// SPDX-License-Identifier: GPL-2.0-only
//
// A number that tells whether words of a restart file are those that were written. Pure C++17.

#ifndef EVP_CORE_CHECKSUM_H
#define EVP_CORE_CHECKSUM_H

#include <cstddef>
#include <cstdint>

namespace EVP {

/// FNV-1a of the bytes of n words, as a whole number that a double holds exactly.
inline double checksum(const double *words, int n)
{
  uint64_t sum = 14695981039346656037ULL;
  const auto *bytes = reinterpret_cast<const unsigned char *>(words);
  for (size_t k = 0; k < n * sizeof(double); k++) sum = (sum ^ bytes[k]) * 1099511628211ULL;
  return (double) (sum >> 11);
}

}    // namespace EVP

#endif
