// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law.h"

#include <array>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace EVP {

/// The numbers and keywords of a row, checked; throws BadInput.
inline Row parse_row(const std::vector<std::string> &words)
{
  const bool has_keywords = words.size() > NREQUIRED && !looks_like_number(words[NREQUIRED]);
  if (words.size() < NREQUIRED || (words.size() > NREQUIRED && !has_keywords))
    throw BadInput("expected " + std::to_string(NREQUIRED) + " values, got " +
                   std::to_string(words.size()) + " (a row has " + row_keys() + ")");
  Row row{};
  for (int k = 0; k < NREQUIRED; k++)
    row.*MEMBERS[k].value = parse_number(MEMBERS[k].key, words[k]);

  for (size_t at = NREQUIRED; at < words.size(); at += 2) {
    const Member *const member = find_entry(MEMBERS, words[at]);
    if (!member || member < MEMBERS + NREQUIRED)
      throw BadInput("unknown keyword '" + shown(words[at]) + "' of a row: after its " +
                     std::to_string(NREQUIRED) + " values it may have " + row_keywords());
    const std::string key = member->key;
    if (at + 1 == words.size()) throw BadInput("keyword " + key + " needs a value");
    row.*member->value = parse_number(key, words[at + 1]);
    member->check(row, member);    // 0 may be what stands for a keyword that is not given
  }
  if ((row.spacing > 0.0) != (row.coordination > 0.0))
    throw BadInput("spacing and coordination are given together or not at all: both say which "
                   "bodies the row holds for");
  (void) PairLaw(row);
  return row;
}

/// The words that parse_row() reads, each number as short as reads back to the same bits.
inline std::string row_text(const Row &row)
{
  std::string text;
  for (const Member &member : MEMBERS)
    if (is_given(row, member)) {
      if (&member >= MEMBERS + NREQUIRED) text += std::string(" ") + member.key;
      text += (text.empty() ? "" : " ") + shortest_text(row.*member.value);
    }
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
  return std::nullopt;
}

/// The row called name of a potential file's text.
///
/// The first line is a comment that holds `UNITS: style`; every other line that is not empty or a comment is `NAME`, the
/// nine numbers and keywords. file is for messages, units the unit style in force.
inline Row row_from_text(const std::string &text, const std::string &file, const std::string &name,
                         const std::string &units)
{
  std::istringstream in(text);
  std::string line, declared, known;
  std::getline(in, line);
  const size_t at = line.find("UNITS:");
  if (line[0] == '#' && at != std::string::npos)
    std::istringstream(line.substr(at + 6)) >> declared;
  if (declared != units)
    throw BadInput("file " + file + ": the first line must be a comment with 'UNITS: " + units +
                   "', the units in force, got '" + shown(declared) + "'");

  std::optional<Row> found;
  for (int number = 2; std::getline(in, line); number++) {
    std::vector<std::string> words = split_words(line);
    if (words.empty()) continue;
    known += (known.empty() ? "" : ", ") + shown(words.front());
    const bool is_wanted = words.front() == name;
    words.erase(words.begin());
    try {
      if (is_wanted && found) throw BadInput("row '" + shown(name) + "' is given twice");
      const Row row = parse_row(words);
      if (is_wanted) found = row;
    } catch (const BadInput &bad) {
      throw BadInput("file " + file + " line " + std::to_string(number) + ": " + bad.what());
    }
  }
  if (!found)
    throw BadInput("file " + file + " has no row '" + shown(name) +
                   "'; its rows: " + (known.empty() ? "none" : known.substr(0, 400)));
  return *found;
}

}    // namespace EVP
