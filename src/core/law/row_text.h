// SPDX-License-Identifier: GPL-2.0-only
//
// Rows of coefficients as text: of commands, and of potential files.
#pragma once

#include "core/base/text.h"
#include "core/law/law.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <istream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace EVP {

/// Reads the points of keyword flow from words[at] on; returns the index behind them. Throws BadInput.
inline size_t parse_flow(const std::vector<std::string> &words, size_t at, FlowTable &flow)
{
  std::vector<double> values;
  for (double value; at < words.size() && is_number(words[at], value); at++)
    values.push_back(value);
  if (values.empty() || values.size() % 2 || values.size() > 2 * FlowTable::MOST)
    throw BadInput("flow needs 1 to " + std::to_string(FlowTable::MOST) +
                   " points of two numbers, plastic strain and limit over xi_s, got " +
                   std::to_string(values.size()) + " numbers");
  flow.n = (int64_t) values.size() / 2;
  for (int k = 0; k < flow.n; k++) {
    flow.p[k] = values[2 * k];
    flow.y[k] = values[2 * k + 1];
  }
  return at;
}

/// The points of a table, as keyword flow has them.
inline std::string flow_text(const FlowTable &flow)
{
  std::string text;
  for (int k = 0; k < flow.n; k++)
    text += (k ? " " : "") + shortest_text(flow.p[k]) + " " + shortest_text(flow.y[k]);
  return text;
}

/// Reads the numbers of the keyword words[at], whose first one is that member; returns the index behind them. Throws BadInput.
inline size_t parse_keyword(const std::vector<std::string> &words, size_t at, const Member &first,
                            Row &row)
{
  const Member *member = &first;
  at++;
  do {
    double number;
    const bool is_there = at < words.size();
    if (member->place == Member::OPTIONAL && !(is_there && is_number(words[at], number))) break;
    if (!is_there)
      throw BadInput(std::string("keyword ") + first.key + " needs a value" +
                     (member == &first ? "" : std::string(" more: ") + member->key));
    row.*member->value = parse_number(member->key, words[at++]);
    member->check(row, member);    // 0 may be what stands for a keyword that is not given
  } while (++member != std::end(MEMBERS) && member->place != Member::HEAD);
  return at;
}

/// The numbers and keywords of a row, checked; throws BadInput.
inline Row parse_row(const std::vector<std::string> &words)
{
  const bool has_keywords = words.size() > NREQUIRED &&
      std::string("+-.0123456789").find(words[NREQUIRED][0]) == std::string::npos;
  if (words.size() < NREQUIRED || (words.size() > NREQUIRED && !has_keywords))
    throw BadInput("expected " + std::to_string(NREQUIRED) + " values, got " +
                   std::to_string(words.size()) + " (a row has " + row_keys() + ")");
  Row row{};
  for (int k = 0; k < NREQUIRED; k++)
    row.*MEMBERS[k].value = parse_number(MEMBERS[k].key, words[k]);

  std::set<std::string> given_keys;
  for (size_t at = NREQUIRED; at < words.size();) {
    if (!given_keys.insert(words[at]).second)
      throw BadInput("keyword " + shown(words[at]) + " of a row is given twice: leave one out");
    if (words[at] == "flow") {
      at = parse_flow(words, at + 1, row.flow);
      continue;
    }
    if (words[at] == "limit") {
      if (at + 1 == words.size() || words[at + 1] != "own")
        throw BadInput("keyword limit of a row takes the word own: its pairs hold by its xi_s, "
                       "whatever their spheres have gone through");
      row.limit_own = 1.0;
      at += 2;
      continue;
    }
    std::string key = words[at];
    if (key == "rupture" && at + 1 < words.size() && words[at + 1] == "energy")
      key += " " + words[++at];
    const Member *const member = find_member(key);
    if (!member || member < MEMBERS + NREQUIRED || member->place != Member::HEAD)
      throw BadInput("unknown keyword '" + shown(words[at]) + "' of a row: after its " +
                     std::to_string(NREQUIRED) + " values it may have " +
                     keys_of(MEMBERS + NREQUIRED, std::end(MEMBERS), ", ") + ", flow, limit");
    at = parse_keyword(words, at, *member, row);
  }
  if (row.yield > 0.0 && !(row.density > 0.0 && row.coordination > 0.0))
    throw BadInput("yield needs density, which says what stress a force of spheres is, and spacing "
                   "and coordination of the body that the row was found on");
  if ((row.damage_d1 >= 0.0) != (row.rupture >= 0.0 || row.rupture_energy >= 0.0))
    throw BadInput(
        "damage and rupture are given together: damage says at which plastic strain a sphere "
        "begins to fail, rupture UF or rupture energy GF how far from there it parts");
  if (row.damage_d1 >= 0.0 && !(row.density > 0.0))
    throw BadInput("damage needs density, which says what stress a force of spheres is");
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
      if (&member >= MEMBERS + NREQUIRED && member.place == Member::HEAD)
        text += std::string(" ") + member.key;
      text += (text.empty() ? "" : " ") + shortest_text(row.*member.value);
    }
  if (row.limit_own != 0.0) text += " limit own";
  return row.flow.n > 0 ? text + " flow " + flow_text(row.flow) : text;
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
  double number;
  if (words.empty() || is_number(words[0], number)) return std::nullopt;
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
