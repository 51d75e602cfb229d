// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_CORE_POTENTIAL_FILE_H
#define EVP_CORE_POTENTIAL_FILE_H

#include "core/law.h"

#include <sstream>
#include <string>
#include <vector>

namespace EVP {

/// The numbers of a row, checked; throws BadInput.
inline Row parse_row(const std::vector<std::string> &words)
{
  if (words.size() != NMEMBERS)
    throw BadInput("expected " + std::to_string(NMEMBERS) + " values, got " +
                   std::to_string(words.size()) + " (a row has " + row_keys() + ")");
  Row row{};
  for (int k = 0; k < NMEMBERS; k++) row.*MEMBERS[k].value = parse_number(MEMBERS[k].key, words[k]);
  return Law(row).parameters();
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
  if (std::getline(in, line)) {
    const std::string tag = "UNITS:";
    std::string declared;
    const size_t at = line.find(tag);
    if (line[0] == '#' && at != std::string::npos)
      std::istringstream(line.substr(at + tag.size())) >> declared;
    if (declared.empty())
      throw BadInput("file " + file + " line 1: the first line must be a comment with 'UNITS: " +
                     units + "' (or the unit style that the numbers are in)");
    if (declared != units)
      throw BadInput("file " + file + " is in UNITS: " + shown(declared) + ", but 'units " + units +
                     "' is in force: convert the file or change the units command");
  }

  Row found{};
  bool is_found = false;
  constexpr int MOST_NAMED = 20;
  int rows = 0;
  for (int number = 2; std::getline(in, line); number++) {
    std::vector<std::string> words = split_words(line);
    if (words.empty()) continue;
    const std::string row_name = words.front();
    words.erase(words.begin());
    try {
      const Row row = parse_row(words);
      if (row_name == name) {
        if (is_found) throw BadInput("row '" + shown(name) + "' is given twice");
        found = row;
        is_found = true;
      }
    } catch (const BadInput &bad) {
      throw BadInput("file " + file + " line " + std::to_string(number) + ": " + bad.what());
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
