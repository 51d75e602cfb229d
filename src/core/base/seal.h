// SPDX-License-Identifier: GPL-2.0-only
//
// A check of the numbers in restart files, which have none of their own.
#pragma once

#include "core/base/simd.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace EVP {

/// A word that any change of one of these words changes.
inline double seal_of(const double *words, size_t n)
{
  uint64_t sum = n;
  for (size_t k = 0; k < n; k++) {    // each step is invertible in the word and in the sum
    sum = (sum ^ bits_as<uint64_t>(words[k])) * 0x9E3779B97F4A7C15ULL;
    sum ^= sum >> 32;
  }
  return bits_as<double>(sum);
}

/// Appends it.
inline void seal(std::vector<double> &words)
{
  words.push_back(seal_of(words.data(), words.size()));
}

/// Is the last one of n words that of the others?
inline bool is_sealed(const double *words, size_t n)
{
  return n > 0 && bits_as<uint64_t>(words[n - 1]) == bits_as<uint64_t>(seal_of(words, n - 1));
}

/// Appends a text: its length, its characters.
inline void put_text(std::vector<double> &words, const std::string &text)
{
  words.push_back((double) text.size());
  const size_t first = words.size();
  words.resize(first + (text.size() + sizeof(double) - 1) / sizeof(double), 0.0);
  if (!text.empty()) std::memcpy(&words[first], text.data(), text.size());
}

/// Takes it from words, and moves on behind it.
inline std::string take_text(const double *&words)
{
  const auto size = (size_t) *words++;
  const std::string text(reinterpret_cast<const char *>(words), size);
  words += (size + sizeof(double) - 1) / sizeof(double);
  return text;
}

}    // namespace EVP
