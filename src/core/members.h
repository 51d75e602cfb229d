// SPDX-License-Identifier: GPL-2.0-only
//
// Tables of the members of a struct, each with its key and a pointer to the value: what all such tables share.
#pragma once

#include "core/bytes.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <string>

namespace EVP {

/// The keys, for messages.
template <class Members> std::string keys_of(const Members &members, const char *between)
{
  std::string keys;
  for (const auto &member : members)
    keys += (keys.empty() ? "" : between) + std::string(member.key);
  return keys;
}

/// The member with that key, nullptr if there is none.
template <class Member, size_t N>
const Member *find_member(const Member (&members)[N], const std::string &key)
{
  const Member *const found =
      std::find_if(std::begin(members), std::end(members), [&](const Member &member) {
        return key == member.key;
      });
  return found == std::end(members) ? nullptr : found;
}

/// Are all values of two structs the same?
template <class Members, class Struct>
bool are_same(const Members &members, const Struct &a, const Struct &b)
{
  return std::all_of(std::begin(members), std::end(members), [&](const auto &member) {
    return a.*member.value == b.*member.value;
  });
}

/// The values and their checksum, for restart files.
template <class Member, size_t N, class Struct>
std::array<double, N + 1> words_of(const Member (&members)[N], const Struct &values)
{
  std::array<double, N + 1> words;
  for (size_t k = 0; k < N; k++) words[k] = values.*members[k].value;
  words[N] = checksum(words.data(), N);
  return words;
}

/// The values from their words; false where these are damaged.
template <class Member, size_t N, class Struct>
bool take_words(const Member (&members)[N], const std::array<double, N + 1> &words, Struct &values)
{
  if (words[N] != checksum(words.data(), N)) return false;
  for (size_t k = 0; k < N; k++) values.*members[k].value = words[k];
  return true;
}

}    // namespace EVP
