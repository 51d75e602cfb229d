// SPDX-License-Identifier: GPL-2.0-only
//
// The text files: rows of coefficients, and recorded bonds.
#pragma once

#include "core/base/text.h"
#include "core/bonds/bond_store.h"
#include "core/law/law.h"
#include "core/pairs/contacts.h"
#include "core/pairs/pairs.h"

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
    const auto *const given =
        std::find_if(std::begin(SWITCHES), std::end(SWITCHES), [&](const Switch &one) {
          return words[at] == one.key;
        });
    if (given != std::end(SWITCHES)) {
      if (at + 1 == words.size() || words[at + 1] != given->word)
        throw BadInput(std::string("keyword ") + given->key + " of a row takes the word " +
                       given->word + ": " + given->meaning);
      row.*given->value = 1.0;
      at += 2;
      continue;
    }
    const Member *const member = find_member(words[at]);
    if (!member || member < MEMBERS + NREQUIRED || member->place != Member::HEAD)
      throw BadInput("unknown keyword '" + shown(words[at]) + "' of a row: after its " +
                     std::to_string(NREQUIRED) + " values it may have " +
                     keys_of(MEMBERS + NREQUIRED, std::end(MEMBERS), ", ") +
                     ", flow, limit, bonds");
    at = parse_keyword(words, at, *member, row);
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
      if (&member >= MEMBERS + NREQUIRED && member.place == Member::HEAD)
        text += std::string(" ") + member.key;
      text += (text.empty() ? "" : " ") + shortest_text(row.*member.value);
    }
  for (const Switch &one : SWITCHES)
    if (row.*one.value != 0.0) text += std::string(" ") + one.key + " " + one.word;
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

// The text file of recorded bonds: one header line, then `id_i id_j deq` a line. Where bonds flow or end there may follow
// lines `contact id_i id_j deq`, `apart ...` and `inside ...` of pairs that are no bonds but remember (see Remembered), and
// `sphere id p work slip bonds recorded rho0 G gap torn lost batch strain [given]` of what spheres keep (see Sphere and VolumeRecord),
// and of a plastic strain that waits. A bond that began with the volume energy is a line `joined id_i id_j deq`.
//
//     # EVP bonds COUNT: 2975 UNITS: si
//     1 17 0.0101234
//
// Words of the header with a number or name each, those that are not needed left out: WITHIN and ZONE as given to fix
// evp/bonds, CONTACTS for the number of lines of pairs that are no bonds, ENDED for that of bonds that have ended, FAILED
// for that of those of them that failed at a strain, JOINED for that of bonds that have begun, JOIN, or JOIN_ALL, for the
// distance over R_i + R_j by which pairs are inside, SPHERES.
// Reads in pieces, whatever the size; every refusal is a BadInput that names the line.

/// What the header says beside the units.
struct BondHeader {
  int64_t bonds = 0;
  BodyRule within = BodyRule::ALL;    ///< which atoms were one body when the file was written
  double zone = 0.0;    ///< up to zone (R_i + R_j) pairs were recorded; 0: up to alpha
  int64_t contacts = 0, spheres = 0;
  BondCounts counts = {};
  JoinRule joins_by = {};               ///< see BondStore
  std::vector<double> measures = {};    ///< BondMeasures::words(), empty without
};

/// One pair: IDs of its atoms, equilibrium distance [length]; its kind, or BOND.
struct BondLine {
  static constexpr int64_t BOND = -1;
  int64_t id_i, id_j;
  double deq;
  int64_t kind = BOND;    ///< else a Remembered::Kind

  bool is_bond() const { return kind == BOND || kind == Remembered::JOINED; }
};

/// What a sphere keeps, for fix evp/bonds and for fix evp/volume.
struct SphereLine {
  enum { P, WORK, SLIP, BONDS, RECORDED, RHO, SLOPE, GAP, TORN, LOST, BATCH, STRAIN, NVALUES };
  int64_t id;
  double values[NVALUES];
  double given = BondStore::NOT_GIVEN;    ///< a plastic strain that waits
};

inline std::string sphere_text(const SphereLine &sphere)
{
  std::string text = "sphere " + std::to_string(sphere.id);
  for (const double value : sphere.values) text += " " + shortest_text(value);
  if (sphere.given >= 0.0) text += " " + shortest_text(sphere.given);
  return text + "\n";
}

/// The header line, without its end.
inline std::string bond_header(const BondHeader &header, const std::string &units)
{
  std::string text = "# EVP bonds COUNT: " + std::to_string(header.bonds);
  if (header.within != BodyRule::ALL)
    text += std::string(" WITHIN: ") + BODY_RULES[(int) header.within];
  if (header.zone > 0.0) text += " ZONE: " + shortest_text(header.zone);
  if (header.contacts > 0) text += " CONTACTS: " + std::to_string(header.contacts);
  const BondCounts &counts = header.counts;
  if (counts.ended > 0) text += " ENDED: " + std::to_string(counts.ended);
  if (counts.failed > 0) text += " FAILED: " + std::to_string(counts.failed);
  if (counts.begun > 0) text += " JOINED: " + std::to_string(counts.begun);
  if (header.joins_by.within > 0.0)
    text +=
        (header.joins_by.all ? " JOIN_ALL: " : " JOIN: ") + shortest_text(header.joins_by.within);
  if (header.spheres > 0) text += " SPHERES: " + std::to_string(header.spheres);
  for (size_t k = 0; k < header.measures.size(); k++)
    text += (k ? "," : " MEASURED: ") + shortest_text(header.measures[k]);
  return text + " UNITS: " + units;
}

/// One line of the file with its end; 17 digits bring deq back to the last bit.
inline std::string bond_text(const BondLine &bond)
{
  const std::string kind = bond.kind == BondLine::BOND ? ""
                                                       : std::string(REMEMBERED[bond.kind]) + " ";
  return kind + std::to_string(bond.id_i) + " " + std::to_string(bond.id_j) + " " +
      rounded(bond.deq, 17) + "\n";
}

/// Reads a bond file from an open stream, which stays the caller's.
class BondReader {
 public:
  /// Reads the header; throws BadInput unless it is one in these units.
  BondReader(std::istream &stream, const std::string &file_in, const std::string &units) :
      in(stream), file(file_in)
  {
    at_next_line([&](const std::string &line) {
      std::vector<std::string> words = split_words(line.substr(line.find('#') + 1));
      while (words.size() > 6 && add_keyword(words[4], words[5]))
        words.erase(words.begin() + 4, words.begin() + 6);
      if (line[0] != '#' || words.size() != 6 || words[0] != "EVP" || words[1] != "bonds" ||
          words[2] != "COUNT:" || words[4] != "UNITS:")
        throw BadInput("expected the header '" + bond_header({}, units) +
                       "' with the number of bonds, as write_evp_bonds writes it");
      if (words[5] != units)
        throw BadInput("the bonds are in UNITS: " + shown(words[5]) + ", but 'units " + units +
                       "' is in force");
      header.bonds = parse_whole("COUNT", words[3], 0);
      if (header.counts.failed > header.counts.ended)
        throw BadInput(
            "FAILED is a part of ENDED, got FAILED: " + std::to_string(header.counts.failed) +
            " of ENDED: " + std::to_string(header.counts.ended));
    });
    if (line_number == 0)
      throw BadInput("the bond file is empty or cannot be read (file '" + file + "')");
  }

  BondHeader header;

  /// Appends what up to most lines say; false at the end of the file, where the counts must be met.
  bool read(std::vector<BondLine> &pairs, std::vector<SphereLine> &spheres, size_t most)
  {
    const size_t before = pairs.size(), spheres_before = spheres.size();
    const size_t full = before + spheres_before + most;
    bool more = true;
    while (more && pairs.size() + spheres.size() < full)
      more = at_next_line([&](const std::string &line) {
        const std::vector<std::string> words = split_words(line);
        if (!words.empty() && words[0] == "sphere")
          spheres.push_back(parse_sphere(words));
        else if (!words.empty())
          pairs.push_back(parse_pair(words));
      });
    for (size_t k = before; k < pairs.size(); k++) (pairs[k].is_bond() ? bonds : contacts)++;
    nspheres += (int64_t) (spheres.size() - spheres_before);
    if (more) return true;
    demand("bonds", bonds, header.bonds);
    demand("contacts", contacts, header.contacts);
    demand("spheres", nspheres, header.spheres);
    return false;
  }

 private:
  std::istream &in;
  std::string file;
  int64_t bonds = 0, contacts = 0, nspheres = 0, line_number = 0;

  /// Takes a word of the header and its value, false if it is none of those that may be left out.
  bool add_keyword(const std::string &word, const std::string &value)
  {
    if (word == "WITHIN:")
      header.within = parse_body_rule(value);
    else if (word == "ZONE:")
      header.zone = parse_number("ZONE", value);
    else if (word == "CONTACTS:")
      header.contacts = parse_whole("CONTACTS", value, 0);
    else if (word == "ENDED:")
      header.counts.ended = parse_whole("ENDED", value, 0);
    else if (word == "FAILED:")
      header.counts.failed = parse_whole("FAILED", value, 0);
    else if (word == "JOINED:")
      header.counts.begun = parse_whole("JOINED", value, 0);
    else if (word == "JOIN:" || word == "JOIN_ALL:")
      header.joins_by = {parse_number("JOIN", value), word == "JOIN_ALL:"};
    else if (word == "SPHERES:")
      header.spheres = parse_whole("SPHERES", value, 0);
    else if (word == "MEASURED:")
      header.measures = parse_measures(value);
    else
      return false;
    return true;
  }

  /// See BondMeasures::words().
  static std::vector<double> parse_measures(const std::string &value)
  {
    std::vector<double> measures;
    std::string one;
    for (std::istringstream all(value); std::getline(all, one, ',');)
      measures.push_back(parse_number("MEASURED", one));
    bool fits = measures.size() % 2 == 1 && measures[0] == 1.0;
    for (size_t k = 1; fits && k < measures.size(); k += 2)
      fits = measures[k] >= 0.0 && measures[k + 1] >= 0.0 &&
          (measures[k] > 0.0) == (measures[k + 1] > 0.0);
    if (!fits)
      throw BadInput("MEASURED must be 1 and for each pair of types spacing and coordination, both "
                     "positive or both zero, got " +
                     shown(value));
    return measures;
  }

  void demand(const std::string &what, int64_t found, int64_t declared) const
  {
    if (found != declared)
      throw BadInput("the bond file holds " + std::to_string(found) + " " + what +
                     ", its header says " + std::to_string(declared) +
                     ": it is incomplete or was changed (file '" + file + "')");
  }

  /// Calls f(line); false at the end of the file. The cause stands first in messages: a path may be longer than what
  /// a host program shows.
  template <class F> bool at_next_line(F &&f)
  {
    std::string line;
    if (!std::getline(in, line)) return false;
    line_number++;
    try {
      // half a number may be a number too
      if (in.eof())
        throw BadInput(
            "the last line has no line end: the file is incomplete, or add the line end");
      f(line);
    } catch (const BadInput &bad) {
      throw BadInput("bond file line " + std::to_string(line_number) + ": " + bad.what() +
                     " (file '" + file + "')");
    }
    return true;
  }

  static int64_t parse_whole(const std::string &key, const std::string &word, int64_t least)
  {
    const bool is_whole = !word.empty() && word.size() <= 18 &&
        word.find_first_not_of("0123456789") == std::string::npos;
    if (!is_whole || std::stoll(word) < least)
      throw BadInput(key + " must be a whole number of at most 18 digits, at least " +
                     std::to_string(least) + ", got '" + shown(word) + "'");
    return std::stoll(word);
  }

  static SphereLine parse_sphere(const std::vector<std::string> &words)
  {
    constexpr size_t WORDS = 2 + SphereLine::NVALUES;
    if (words.size() != WORDS && words.size() != WORDS + 1)
      throw BadInput(
          "expected 'sphere id p work slip bonds recorded rho0 G gap torn lost batch strain', and "
          "maybe a plastic strain that was given, got " +
          std::to_string(words.size()) + " words");
    SphereLine sphere = {parse_whole("id", words[1], 1), {}};
    for (int k = 0; k < SphereLine::NVALUES; k++) {
      sphere.values[k] = parse_number("a value of a sphere", words[2 + k]);
      if (!(sphere.values[k] >= 0.0) && k != SphereLine::RHO && k != SphereLine::GAP &&
          k != SphereLine::LOST && k != SphereLine::STRAIN)
        throw BadInput(
            "values of a sphere but rho0, gap, lost and strain must be zero or positive, got " +
            shown(words[2 + k]));
    }
    for (const int k : {SphereLine::BONDS, SphereLine::RECORDED})
      (void) parse_whole("a number of bonds", words[2 + k], 0);
    for (const int k : {SphereLine::TORN, SphereLine::BATCH})
      (void) parse_whole("torn or batch", words[2 + k], 0);
    if (words.size() > WORDS) {
      sphere.given = parse_number("a plastic strain that was given", words[WORDS]);
      if (!(sphere.given >= 0.0))
        throw BadInput("a plastic strain that was given must be zero or positive, got " +
                       shown(words[WORDS]));
    }
    return sphere;
  }

  static BondLine parse_pair(std::vector<std::string> words)
  {
    BondLine pair{};
    pair.kind = BondLine::BOND;
    for (const int64_t kind :
         {Remembered::CONTACT, Remembered::APART, Remembered::INSIDE, Remembered::JOINED})
      if (words[0] == REMEMBERED[kind]) pair.kind = kind;
    if (pair.kind != BondLine::BOND) words.erase(words.begin());
    if (words.size() != 3)
      throw BadInput("expected 'id_i id_j deq', got " + std::to_string(words.size()) +
                     " values; contact, apart, inside or joined may stand before them");
    pair.id_i = parse_whole("id_i", words[0], 1);
    pair.id_j = parse_whole("id_j", words[1], 1);
    pair.deq = parse_number("deq", words[2]);
    if (!(pair.deq > 0.0)) throw BadInput("deq must be positive, got " + shown(words[2]));
    return pair;
  }
};

}    // namespace EVP
