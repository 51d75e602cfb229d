// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law.h"
#include "core/row_keywords.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace EVP {

/// The numbers of a row and its keywords, checked; throws BadInput.
inline GivenRow parse_row(const std::vector<std::string> &words)
{
  const bool has_keywords = words.size() > NMEMBERS && !looks_like_number(words[NMEMBERS]);
  if (words.size() < NMEMBERS || (words.size() > NMEMBERS && !has_keywords))
    throw BadInput("expected " + std::to_string(NMEMBERS) + " values, got " +
                   std::to_string(words.size()) + " (a row has " + row_keys() + ")");
  GivenRow given{};
  for (int k = 0; k < NMEMBERS; k++)
    given.row.*MEMBERS[k].value = parse_number(MEMBERS[k].key, words[k]);
  given.row = Law(given.row).parameters();

  std::array<bool, NKEYWORDS> taken{};
  for (size_t at = NMEMBERS; at < words.size(); at += 2) {
    const KeywordMember *const member = find_member(KEYWORDS, words[at]);
    if (!member)
      throw BadInput("unknown keyword '" + shown(words[at]) + "' of a row: after its " +
                     std::to_string(NMEMBERS) + " values it may have " + row_keywords());
    const std::string key = member->key;
    if (at + 1 == words.size()) throw BadInput("keyword " + key + " needs a value");
    if (std::exchange(taken[member - KEYWORDS], true))
      throw BadInput("keyword " + key + " is given twice");
    const double value = parse_number(key, words[at + 1]);
    if (!member->holds(value))
      throw BadInput(key + " " + member->rule + ", got " + shown(words[at + 1]));
    given.keywords.*member->value = value;
  }
  if ((given.keywords.spacing > 0.0) != (given.keywords.coordination > 0.0))
    throw BadInput("spacing and coordination are given together or not at all: both say which "
                   "bodies the row holds for");
  return given;
}

/// The words that parse_row() reads: of a plain row its very bits, else numbers as short as they can be.
inline std::string row_text(const GivenRow &given)
{
  const bool is_plain = !has_any(given.keywords);
  std::string text;
  for (const Member &member : MEMBERS) {
    const double value = given.row.*member.value;
    text += (text.empty() ? "" : " ") + (is_plain ? rounded(value, 17) : shortest_text(value));
  }
  for (const KeywordMember &member : KEYWORDS)
    if (const double value = given.keywords.*member.value; value != 0.0)
      text += std::string(" ") + member.key + " " + shortest_text(value);
  return text;
}

/// FILE and ROW of the word FILE:ROW; throws BadInput. The last colon counts, as a path may have some.
inline std::array<std::string, 2> split_file_and_row(const std::string &word)
{
  const size_t colon = word.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == word.size())
    throw BadInput("expected FILE:ROW, a potential file and the name of a row, got '" +
                   shown(word) + "'");
  return {word.substr(0, colon), word.substr(colon + 1)};
}

/// FILE and ROW of the words of a command, FILE:ROW or both apart; nothing where they are the numbers and keywords of a
/// row, be they too few. Throws BadInput.
inline std::optional<std::array<std::string, 2>>
find_file_and_row(const std::vector<std::string> &words)
{
  if (words.empty() || is_number(words[0])) return std::nullopt;
  if (words.size() == 1) return split_file_and_row(words[0]);
  if (words.size() == 2) return std::array{words[0], words[1]};
  if (words.size() != NMEMBERS && !looks_like_number(words[0]))
    throw BadInput("expected the " + std::to_string(NMEMBERS) + " numbers " + row_keys() +
                   " and keywords, or FILE ROW or FILE:ROW without further arguments, got " +
                   std::to_string(words.size()) + " words, the first '" + shown(words[0]) + "'");
  return std::nullopt;
}

/// The row called name of a potential file's text.
///
/// The first line is a comment that holds `UNITS: style`; every other line that is not empty or a
/// comment is `NAME`, the nine numbers and keywords. All lines are checked, so that a damaged file is
/// noticed whichever row is asked for. file is for messages, units the unit style in force. is_last: whether the row
/// stands in a last line without a line end, whose last number is incomplete if the file was cut there.
inline GivenRow row_from_text(const std::string &text, const std::string &file,
                              const std::string &name, const std::string &units,
                              bool *is_last = nullptr)
{
  demand_plain_text(text, file);
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

  GivenRow found{};
  bool is_found = false;
  constexpr int MOST_NAMED = 20;
  int rows = 0;
  for (int number = 2; std::getline(in, line); number++) {
    std::vector<std::string> words = split_words(line);
    if (words.empty()) continue;
    const std::string row_name = words.front();
    words.erase(words.begin());
    try {
      const GivenRow row = parse_row(words);
      if (row_name == name) {
        if (is_found) throw BadInput("row '" + shown(name) + "' is given twice");
        found = row;
        is_found = true;
        if (is_last) *is_last = in.eof();
      }
    } catch (const BadInput &bad) {
      throw BadInput("file " + file + " line " + std::to_string(number) + ": " + bad.what() +
                     (in.eof() ? "; this last line has no line end: the file may be cut" : ""));
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
