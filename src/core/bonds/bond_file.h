// SPDX-License-Identifier: GPL-2.0-only
//
// The text file of recorded bonds: one header line, then `id_i id_j deq` a line. Where bonds flow or end there may follow
// lines `contact id_i id_j deq`, `apart ...` and `inside ...` of pairs that are no bonds but remember (see Remembered), and
// `sphere id value ...` of what spheres keep, the values being those behind COLUMNS in the header. A bond that began with
// the volume energy is a line `joined id_i id_j deq`.
//
//     # EVP bonds COUNT: 2975 UNITS: si
//     1 17 0.0101234
//
// Words of the header with a number or name each, those that are not needed left out: WITHIN and ZONE as given to fix
// evp/bonds, CONTACTS for the number of lines of pairs that are no bonds, ENDED for that of bonds that have ended, FAILED
// for that of those of them that failed at a strain, JOINED for that of bonds that have begun, JOIN, or JOIN_ALL, for the
// distance over R_i + R_j by which pairs are inside, SPHERES for the number of their lines, COLUMNS for the names of their
// values, BOND_COLUMNS for those of bonds where these have more than deq.
// Reads in pieces, whatever the size; every refusal is a BadInput that names the line.
#pragma once

#include "core/base/text.h"
#include "core/bonds/bond_store.h"
#include "core/pairs/contacts.h"

#include <algorithm>
#include <cstdint>
#include <istream>
#include <sstream>
#include <string>
#include <vector>

namespace EVP {

/// What the header says beside the units.
struct BondHeader {
  int64_t bonds = 0;
  BodyRule within = BodyRule::ALL;    ///< which atoms were one body when the file was written
  double zone = 0.0;    ///< up to zone (R_i + R_j) pairs were recorded; 0: up to alpha
  int64_t contacts = 0, spheres = 0;
  BondCounts counts = {};
  JoinRule joins_by = {};               ///< see BondStore
  std::vector<double> measures = {};    ///< BondMeasures::words(), empty without
  std::string columns = {};             ///< names of the values of spheres, by commas
};

/// One pair: the ID of an atom, and what it keeps of the other one; its kind, or BOND.
struct BondLine {
  static constexpr int64_t BOND = -1;
  int64_t id;
  BondRecord bond;        ///< of what remembers and is no bond: partner and deq
  int64_t kind = BOND;    ///< else a Remembered::Kind

  bool is_bond() const { return kind == BOND || kind == Remembered::JOINED; }
};

/// What a sphere keeps, in the order of BondHeader::columns.
struct SphereLine {
  int64_t id;
  std::vector<double> values;
};

inline std::string sphere_text(const SphereLine &sphere)
{
  std::string text = "sphere " + std::to_string(sphere.id);
  for (const double value : sphere.values) text += " " + shortest_text(value);
  return text + "\n";
}

/// The names in a word of the header.
inline std::vector<std::string> split_columns(const std::string &word)
{
  std::vector<std::string> names;
  std::istringstream all(word);
  for (std::string name; std::getline(all, name, ',');) names.push_back(name);
  return names;
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
  if (header.spheres > 0)
    text += " SPHERES: " + std::to_string(header.spheres) + " COLUMNS: " + header.columns;
  if (std::size(BOND_VALUES) > 1) text += " BOND_COLUMNS: " + names_of(BOND_VALUES, ",");
  for (size_t k = 0; k < header.measures.size(); k++)
    text += (k ? "," : " MEASURED: ") + shortest_text(header.measures[k]);
  return text + " UNITS: " + units;
}

/// One line of the file with its end; 17 digits bring deq back to the last bit.
inline std::string bond_text(const BondLine &line)
{
  std::string text = line.kind == BondLine::BOND ? "" : std::string(REMEMBERED[line.kind]) + " ";
  text += std::to_string(line.id) + " " + std::to_string(line.bond.partner);
  if (!line.is_bond()) return text + " " + rounded(line.bond.deq, 17) + "\n";
  for (const BondValue &value : BOND_VALUES) text += " " + rounded(line.bond.*value.value, 17);
  return text + "\n";
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
  std::vector<const SphereValue *> columns;
  static constexpr const BondValue *DEQ = &BOND_VALUES[0];
  std::vector<const BondValue *> bond_columns = {DEQ};

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
    else if (word == "COLUMNS:")
      take_columns(value);
    else if (word == "BOND_COLUMNS:")
      take_bond_columns(value);
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

  void take_columns(const std::string &word)
  {
    std::string known;
    for (const auto &[group, table] : sphere_tables())
      known += (known.empty() ? "" : ", ") + names_of(table, ", ", is_in_files);
    columns = find_all<SphereValue>("COLUMNS", word, "spheres do not keep; they keep " + known,
                                    [](const std::string &name) {
                                      const SphereValue *const value = find_sphere_value(name);
                                      return value && is_in_files(*value) ? value : nullptr;
                                    });
    header.columns = word;
  }
  static bool is_in_files(const SphereValue &value) { return value.range != Range::NOT_IN_FILES; }

  void take_bond_columns(const std::string &word)
  {
    const std::string rule = "bonds do not keep; they keep " + names_of(BOND_VALUES, ", ");
    bond_columns = find_all<BondValue>("BOND_COLUMNS", word, rule, [](const std::string &name) {
      const auto *const end = std::end(BOND_VALUES),
                        *const at =
                            std::find_if(std::begin(BOND_VALUES), end, [&](const BondValue &one) {
                              return name == one.name;
                            });
      return at == end ? nullptr : at;
    });
    if (std::count(bond_columns.begin(), bond_columns.end(), DEQ) == 0)
      throw BadInput("BOND_COLUMNS lacks deq");
  }

  // Those of these names. One that nobody knows may be a slip. Throws BadInput
  template <class Value, class F>
  static std::vector<const Value *> find_all(const std::string &key, const std::string &word,
                                             const std::string &rule, F &&find)
  {
    std::vector<const Value *> found;
    for (const std::string &name : split_columns(word)) {
      found.push_back(find(name));
      if (!found.back()) throw BadInput(key + " has '" + shown(name) + "', which " + rule);
      if (std::count(found.begin(), found.end(), found.back()) > 1)
        throw BadInput(key + " has " + name + " twice");
    }
    return found;
  }

  SphereLine parse_sphere(const std::vector<std::string> &words) const
  {
    if (words.size() != 2 + columns.size() || columns.empty())
      throw BadInput("expected 'sphere id' and the " + std::to_string(columns.size()) +
                     " values that COLUMNS in the header names, got " +
                     std::to_string(words.size()) + " words");
    SphereLine sphere = {parse_whole("id", words[1], 1), {}};
    for (size_t k = 0; k < columns.size(); k++) {
      const SphereValue &column = *columns[k];
      const double value = parse_number(column.name, words[2 + k]);
      if (value != column.at_recording) check_range(column.name, column.range, value);
      sphere.values.push_back(value);
    }
    return sphere;
  }

  BondLine parse_pair(std::vector<std::string> words) const
  {
    BondLine pair{};
    pair.kind = BondLine::BOND;
    for (const int64_t kind :
         {Remembered::CONTACT, Remembered::APART, Remembered::INSIDE, Remembered::JOINED})
      if (words[0] == REMEMBERED[kind]) pair.kind = kind;
    if (pair.kind != BondLine::BOND) words.erase(words.begin());
    static const std::vector deq_alone = {DEQ};
    const auto &columns = pair.is_bond() ? bond_columns : deq_alone;
    if (words.size() != 2 + columns.size()) {
      std::string expected = "id_i id_j";
      for (const BondValue *const value : columns) expected += std::string(" ") + value->name;
      throw BadInput("expected '" + expected + "', got " + std::to_string(words.size()) +
                     " values; contact, apart, inside or joined may stand before them");
    }
    pair.id = parse_whole("id_i", words[0], 1);
    pair.bond.partner = parse_whole("id_j", words[1], 1);
    for (size_t k = 0; k < columns.size(); k++) {
      const BondValue &column = *columns[k];
      double &value = pair.bond.*column.value;
      value = parse_number(column.name, words[2 + k]);
      check_range(column.name, column.range, value);
    }
    return pair;
  }
};

}    // namespace EVP
