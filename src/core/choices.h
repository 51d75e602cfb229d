// SPDX-License-Identifier: GPL-2.0-only
//
// Names of variables that an input script defines, and which of them a misspelled name may mean.

#pragma once

#include "core/text.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <utility>
#include <vector>

namespace EVP {

/// NAME of each line `variable NAME index ...` of an input script, in their order, each once.
inline std::vector<std::string> index_variables(const std::string &script)
{
  std::vector<std::string> names;
  std::istringstream in(script);
  for (std::string line; std::getline(in, line);) {
    const std::vector<std::string> words = split_words(line);
    if (words.size() > 2 && words[0] == "variable" && words[2] == "index" &&
        std::find(names.begin(), names.end(), words[1]) == names.end())
      names.push_back(words[1]);
  }
  return names;
}

inline bool in_name(char c)
{
  return std::isalnum((unsigned char) c) || c == '_';
}

/// Whether a name stands in a text with no letter, digit or underscore beside it, where `v_` may be in front.
inline bool mentions(const std::string &text, const std::string &name)
{
  for (size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
    const size_t end = at + name.size();
    size_t start = at;
    if (start >= 2 && text.compare(start - 2, 2, "v_") == 0) start -= 2;
    if ((start == 0 || !in_name(text[start - 1])) && (end == text.size() || !in_name(text[end])))
      return true;
  }
  return false;
}

/// Whether an input script defines or reads a variable: variable NAME, (variable,NAME), ${NAME}, $N or v_NAME. A word of
/// another kind, as in a comment, does not count: it may be what a misspelled name is like.
inline bool uses_variable(const std::string &script, const std::string &name)
{
  const auto ends_with = [](const std::string &text, const std::string &end) {
    return text.size() >= end.size() &&
        text.compare(text.size() - end.size(), end.size(), end) == 0;
  };
  for (size_t at = script.find(name); at != std::string::npos; at = script.find(name, at + 1)) {
    std::string before = script.substr(at < 32 ? 0 : at - 32, at < 32 ? at : 32);
    const char after = at + name.size() < script.size() ? script[at + name.size()] : '\n';
    if (name.size() == 1 && ends_with(before, "$")) return true;
    if (in_name(after)) continue;
    if ((ends_with(before, "${") && after == '}') || ends_with(before, "v_")) return true;
    const size_t length = before.find_last_not_of(", \t&\n\r") + 1;
    if (length < before.size() && ends_with(before.substr(0, length), "variable")) return true;
  }
  return false;
}

/// Characters to insert, delete, replace or swap with the next, so that one word becomes the other.
inline int edit_distance(const std::string &a, const std::string &b)
{
  std::vector<int> before, last, now(b.size() + 1);
  for (size_t j = 0; j <= b.size(); j++) now[j] = (int) j;
  for (size_t i = 1; i <= a.size(); i++) {
    before = std::exchange(last, now);
    now[0] = (int) i;
    for (size_t j = 1; j <= b.size(); j++) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        now[j] = std::min(now[j], before[j - 2] + 1);
    }
  }
  return now[b.size()];
}

/// The name that is meant by a misspelled one: the nearest, empty where more than a third of its letters differ.
inline std::string nearest_name(const std::string &name, const std::vector<std::string> &names)
{
  std::string nearest;
  int least = 1 + std::max(1, (int) name.size() / 3);
  for (const std::string &other : names) {
    const int distance = edit_distance(name, other);
    if (distance < least) {
      least = distance;
      nearest = other;
    }
  }
  return nearest;
}

}    // namespace EVP
