// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace EVP {

/// Memory that the vectors hold [bytes].
template <class... Vectors> double bytes_of(const Vectors &...vectors)
{
  return (0.0 + ... + ((double) vectors.capacity() * sizeof(typename Vectors::value_type)));
}

/// The bits of a number as one of another type, of the same size.
template <class To, class From> To bits_as(const From &from)
{
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &from, sizeof(to));
  return to;
}

/// Brings [begin, begin + bytes) nearer before it is needed. Never faults, wherever it points; does
/// nothing with compilers other than g++ and clang++.
inline void prefetch([[maybe_unused]] const void *begin, [[maybe_unused]] size_t bytes)
{
#if defined(__GNUC__)
  const char *const at = static_cast<const char *>(begin);
  for (size_t k = 0; k < bytes; k += 64) {
    __builtin_prefetch(at + k);
    __asm__ volatile("");    // g++ drops a loop that does nothing else
  }
#endif
}

}    // namespace EVP
