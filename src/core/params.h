// SPDX-License-Identifier: GPL-2.0-only
//
// From words to a checked Row: the arguments of pair_coeff and the lines of a potential file.
// Pure C++17. Every refusal is a BadInput whose text names key, value, rule and remedy.

#ifndef EVP_CORE_PARAMS_H
#define EVP_CORE_PARAMS_H

#include "core/law.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace EVP {

/// What the user gave cannot be used; what() says why and what to do.
struct BadInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The words of a row, in the order of the paper's tables.
inline const std::vector<std::string> &row_keys()
{
  static const std::vector<std::string> keys = {"e1", "m1",   "n1",    "e2",   "m2",
                                                "n2", "xi_s", "gamma", "alpha"};
  return keys;
}

/// A word of the user's as a message can carry it: at most 40 characters, printable ones.
inline std::string shown(const std::string &word)
{
  constexpr size_t MOST = 40;
  std::string text = word.substr(0, MOST);
  for (char &c : text)
    if (c < ' ' || c > '~') c = '?';
  return word.size() > MOST ? text + "..." : text;
}

/// Whether a text starts with the mark that some editors put before UTF-8.
inline bool has_byte_order_mark(const std::string &text)
{
  return text.compare(0, 3, "\xEF\xBB\xBF") == 0;
}

/// A decimal number that fills the whole word and is finite; hexadecimal, nan and inf are refused.
inline double parse_number(const std::string &key, const std::string &word)
{
  char *end = nullptr;
  errno = 0;
  const double value = std::strtod(word.c_str(), &end);
  const bool decimal = word.find_first_not_of("0123456789+-.eE") == std::string::npos;
  if (word.empty() || !decimal || *end != '\0' || !std::isfinite(value))
    throw BadInput(key + " must be a finite decimal number, got '" + shown(word) + "'");
  return value;
}

/// m - n must be at least this, and this share of m: the force is a difference of s^m and s^n, which
/// round-off then changes by less than 1e-8 of itself at a strain of 1e-3.
constexpr double EXPONENTS_APART = 1e-4;

/// Throws BadInput unless the law of this row exists (rules in the texts).
inline void check_row(const Row &row)
{
  const auto text = [](double x) {
    std::ostringstream out;
    out << x;
    return out.str();
  };
  const auto not_negative = [&](const char *key, double x) {
    if (!(x >= 0.0)) throw BadInput(std::string(key) + " must be zero or positive, got " + text(x));
  };
  const auto exponents = [&](const char *m_key, const char *n_key, double m, double n) {
    if (!(m > n && n > 0.0))
      throw BadInput(std::string("exponents must satisfy ") + m_key + " > " + n_key + " > 0, got " +
                     m_key + " = " + text(m) + " and " + n_key + " = " + text(n));
    const double least = EXPONENTS_APART * std::max(m, 1.0);
    if (m - n < least)
      throw BadInput(std::string("exponents too close: ") + m_key + " - " + n_key + " = " +
                     text(m - n) + ", must be at least " + text(least) +
                     " (0.0001, and 0.0001 of " + m_key + "): the force would be round-off");
    if (m > 200.0)
      throw BadInput(std::string("exponent ") + m_key + " must not exceed 200, got " + text(m) +
                     ": steeper laws overflow; the paper uses 2 to 8");
  };
  not_negative("e1", row.e1);
  exponents("m1", "n1", row.m1, row.n1);
  not_negative("e2", row.e2);
  exponents("m2", "n2", row.m2, row.n2);
  if (!(row.xi_s > 0.0 && row.xi_s < 1.0))
    throw BadInput("xi_s must lie between 0 and 1 (a strain of the pair; the paper takes 0.005), "
                   "got " +
                   text(row.xi_s));
  not_negative("gamma", row.gamma);
  if (!(row.alpha > 1.0))
    throw BadInput("alpha must be greater than 1 (dlim = alpha (R_i + R_j); the paper takes 1.5), "
                   "got " +
                   text(row.alpha));
  if (!(row.alpha <= 100.0))
    throw BadInput("alpha must not exceed 100 (dlim = alpha (R_i + R_j); the paper takes 1.5), "
                   "got " +
                   text(row.alpha));

  // room for distances far from 1 and for what is made of forces
  constexpr double LARGEST = 1e200;
  const Law law(row);
  const double widest[] = {law.force(1.0 + row.xi_s, 1.0),
                           law.force(1.0 - row.xi_s, 1.0),
                           law.force(0.5, 1.0),
                           law.stiffness(0.5, 1.0),
                           law.stiffness_ahead(1.0, 1.0),
                           law.energy(1.0, 1.0, row.alpha),
                           law.energy(0.5, 1.0, row.alpha),
                           row.gamma};
  for (const double value : widest)
    if (!(std::fabs(value) <= LARGEST))
      throw BadInput(
          "these parameters overflow double precision: check e1, e2, gamma and the exponents");
}

/// Nine words e1 m1 n1 e2 m2 n2 xi_s gamma alpha, checked; throws BadInput.
inline Row parse_row(const std::vector<std::string> &words)
{
  const auto &keys = row_keys();
  if (words.size() != keys.size())
    throw BadInput("a row has the 9 numbers e1 m1 n1 e2 m2 n2 xi_s gamma alpha, got " +
                   std::to_string(words.size()));
  double value[9];
  for (size_t k = 0; k < keys.size(); k++) value[k] = parse_number(keys[k], words[k]);
  const Row row = {value[0], value[1], value[2], value[3], value[4],
                   value[5], value[6], value[7], value[8]};
  check_row(row);
  return row;
}

/// The words of one line up to a '#'.
inline std::vector<std::string> split_words(const std::string &line)
{
  std::istringstream in(line.substr(0, line.find('#')));
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

/// The row called name of a potential file's text.
///
/// The first line is a comment that holds `UNITS: style`; every other line that is not empty or a
/// comment is `NAME` and the nine numbers. All lines are checked, so that a damaged file is noticed
/// whichever row is asked for. file is for messages, units the unit style in force.
inline Row row_from_text(const std::string &text, const std::string &file, const std::string &name,
                         const std::string &units)
{
  if (text.find('\0') != std::string::npos)
    throw BadInput("file " + file + " is not a text file (it holds a NUL byte)");
  if (has_byte_order_mark(text))
    throw BadInput("file " + file +
                   " starts with a byte-order mark: save it without (plain ASCII or UTF-8)");

  std::istringstream in(text);
  std::string line, known;
  Row found{};
  bool is_found = false;
  constexpr int MOST_NAMED = 20;
  int rows = 0;
  for (int number = 1; std::getline(in, line); number++) {
    const std::string where = "file " + file + " line " + std::to_string(number) + ": ";
    if (number == 1) {
      const std::string tag = "UNITS:";
      const size_t at = line.find(tag);
      std::string declared;
      if (line[0] == '#' && at != std::string::npos)
        std::istringstream(line.substr(at + tag.size())) >> declared;
      if (declared.empty())
        throw BadInput(where + "the first line must be a comment with 'UNITS: " + units +
                       "' (or the unit style that the numbers are in)");
      if (declared != units)
        throw BadInput("file " + file + " is in UNITS: " + shown(declared) + ", but 'units " +
                       units + "' is in force: convert the file or change the units command");
    }
    std::vector<std::string> words = split_words(line);
    if (words.empty()) continue;
    const std::string row_name = words.front();
    words.erase(words.begin());
    Row row;
    try {
      row = parse_row(words);
    } catch (const BadInput &bad) {
      throw BadInput(where + bad.what());
    }
    if (row_name == name) {
      if (is_found) throw BadInput(where + "row '" + shown(name) + "' is given twice");
      found = row;
      is_found = true;
    }
    if (++rows <= MOST_NAMED) known += (known.empty() ? "" : ", ") + shown(row_name);
    if (rows == MOST_NAMED + 1) known += ", ...";
  }
  if (!is_found)
    throw BadInput("file " + file + " has no row '" + shown(name) +
                   "'; its rows: " + (known.empty() ? "none" : known));
  return found;
}

}    // namespace EVP

#endif
