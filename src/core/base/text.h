// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace EVP {

/// What the user gave cannot be used; what() names key, value, rule and remedy.
struct BadInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A word of the user's as a message can carry it: at most 40 characters, printable ones.
inline std::string shown(const std::string &word)
{
  constexpr size_t MOST = 40;
  std::string text = word.substr(0, MOST);
  for (char &c : text)
    if (c < ' ' || c > '~') c = '?';
  return word.size() > MOST ? text + "..." : text;
}

/// Takes a decimal number that fills the whole word and is finite; hexadecimal, nan and inf are refused.
inline bool is_number(const std::string &word, double &value)
{
  char *end = nullptr;
  value = std::strtod(word.c_str(), &end);
  const bool decimal = word.find_first_not_of("0123456789+-.eE") == std::string::npos;
  return !word.empty() && decimal && *end == '\0' && std::isfinite(value);
}

/// The number that is_number() takes; throws BadInput.
inline double parse_number(const std::string &key, const std::string &word)
{
  double value;
  if (!is_number(word, value))
    throw BadInput(key + " must be a finite decimal number, got '" + shown(word) + "'");
  return value;
}

/// A number with that many significant digits; with 17 it reads back to the same number.
inline std::string rounded(double value, int digits = 6)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%.*g", digits, value);
  return text;
}

/// 15 digits, or as many more as it takes to read back to the same number.
inline std::string shortest_text(double value)
{
  int digits = 15;
  while (digits < 17 && std::strtod(rounded(value, digits).c_str(), nullptr) != value) digits++;
  return rounded(value, digits);
}

/// The words of one line up to a '#'.
inline std::vector<std::string> split_words(const std::string &line)
{
  std::istringstream in(line.substr(0, line.find('#')));
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

}    // namespace EVP
