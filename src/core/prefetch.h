// SPDX-License-Identifier: GPL-2.0-only
//
// Asks for memory before it is needed. Pure C++17; does nothing with compilers other than g++ and clang++.

#ifndef EVP_CORE_PREFETCH_H
#define EVP_CORE_PREFETCH_H

#include <cstddef>

namespace EVP {

/// Brings [begin, begin + bytes) nearer. Never faults, wherever it points.
inline void prefetch(const void *begin, size_t bytes)
{
#if defined(__GNUC__)
  const char *const at = static_cast<const char *>(begin);
  for (size_t k = 0; k < bytes; k += 64) {
    __builtin_prefetch(at + k);
    __asm__ volatile("");    // g++ drops a loop that does nothing else
  }
#else
  (void) begin;
  (void) bytes;
#endif
}

}    // namespace EVP

#endif
