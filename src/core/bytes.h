// SPDX-License-Identifier: GPL-2.0-only
//
// Pure C++17.

#ifndef EVP_CORE_BYTES_H
#define EVP_CORE_BYTES_H

namespace EVP {

/// Memory that the vectors hold [bytes].
template <class... Vectors> double bytes_of(const Vectors &...vectors)
{
  return (0.0 + ... + ((double) vectors.capacity() * sizeof(typename Vectors::value_type)));
}

}    // namespace EVP

#endif
