// SPDX-License-Identifier: GPL-2.0-only
//
// The text files: rows of coefficients, and recorded bonds.
#pragma once

#include "core/contacts.h"
#include "core/law.h"
#include "core/pairs.h"
#include "core/text.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <istream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace EVP {

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

  for (size_t at = NREQUIRED; at < words.size(); at += 2) {
    const Member *const member = find_member(words[at]);
    if (!member || member < MEMBERS + NREQUIRED)
      throw BadInput("unknown keyword '" + shown(words[at]) + "' of a row: after its " +
                     std::to_string(NREQUIRED) + " values it may have " +
                     keys_of(MEMBERS + NREQUIRED, std::end(MEMBERS), ", "));
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
  double number;
  if (words.empty() || take_number(words[0], number)) return std::nullopt;
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

// The text file of recorded bonds: one header line, then `id_i id_j deq` a line, or, with plasticity or `break`,
// `id_i id_j deq q k work broken` with broken 0 of a bond, 1 of one that broke for good, 2 of a contact
// that was no bond and has flowed.
//
//     # EVP bonds COUNT: 2975 UNITS: si
//     1 17 0.0101234
//
// With `within` or `zone` of fix evp/bonds the header has WITHIN: or ZONE: and its word before UNITS:. With fix evp/volume
// there may be lines `sphere id rho0 gap` of spheres where bonds have broken, and their number behind SPHERES:.
// Reads in pieces, whatever the size; every refusal is a BadInput that names the line.
/// One recorded pair: IDs of its atoms, equilibrium distance [length], and what of it has changed.
struct BondLine {
  int64_t id_i, id_j;
  double deq;
  PairHistory history = {};
  bool is_contact = false;    ///< no bond, but a contact that has flowed

  bool has_changed() const { return is_contact || !(history == PairHistory{}); }
};

/// A sphere whose density at rest is not that of its bonds: its ID, that density and the gap (see VolumeReference).
struct SphereLine {
  int64_t id;
  double rho, gap;
};

inline std::string sphere_text(const SphereLine &sphere)
{
  char text[96];
  snprintf(text, sizeof(text), "sphere %lld %.17g %.17g\n", (long long) sphere.id, sphere.rho,
           sphere.gap);
  return text;
}

/// The header line, without its end.
inline std::string bond_header(int64_t count, const std::string &units,
                               BodyRule within = BodyRule::ALL, double zone = 0.0,
                               int64_t spheres = 0)
{
  std::string header = "# EVP bonds COUNT: " + std::to_string(count);
  if (within != BodyRule::ALL) header += std::string(" WITHIN: ") + BODY_RULES[(int) within];
  if (zone > 0.0) header += " ZONE: " + shortest_text(zone);
  if (spheres > 0) header += " SPHERES: " + std::to_string(spheres);
  return header + " UNITS: " + units;
}

/// One line of the file with its end; 17 digits bring deq back to the last bit.
inline std::string bond_text(const BondLine &bond, bool with_history = false)
{
  const PairHistory &h = bond.history;
  char text[192];
  int n = snprintf(text, sizeof(text), "%lld %lld %.17g", (long long) bond.id_i,
                   (long long) bond.id_j, bond.deq);
  if (with_history)
    snprintf(text + n, sizeof(text) - n, " %.17g %.17g %.17g %d", h.q * bond.deq, h.k, h.work,
             bond.is_contact ? 2 : (int) h.broken);
  return text + std::string("\n");
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
      while (words.size() > 6 &&
             (words[4] == "WITHIN:" || words[4] == "ZONE:" || words[4] == "SPHERES:")) {
        if (words[4] == "WITHIN:")
          within = parse_body_rule(words[5]);
        else if (words[4] == "ZONE:")
          zone = parse_number("ZONE", words[5]);
        else
          declared_spheres = parse_whole("SPHERES", words[5], 0);
        words.erase(words.begin() + 4, words.begin() + 6);
      }
      if (line[0] != '#' || words.size() != 6 || words[0] != "EVP" || words[1] != "bonds" ||
          words[2] != "COUNT:" || words[4] != "UNITS:")
        throw BadInput("expected the header '" + bond_header(0, units) +
                       "' with the number of bonds, as write_evp_bonds writes it");
      if (words[5] != units)
        throw BadInput("the bonds are in UNITS: " + shown(words[5]) + ", but 'units " + units +
                       "' is in force");
      declared = parse_whole("COUNT", words[3], 0);
    });
    if (line_number == 0)
      throw BadInput("the bond file is empty or cannot be read (file '" + file + "')");
  }

  BodyRule within = BodyRule::ALL;    ///< which atoms were one body when the file was written
  double zone = 0.0;    ///< up to zone (R_i + R_j) pairs were recorded; 0: up to alpha
  std::vector<SphereLine> spheres;    ///< those read so far

  /// Appends up to most bonds; false at the end of the file, where the count must be met.
  bool read(std::vector<BondLine> &bonds, size_t most)
  {
    const size_t before = bonds.size();
    bool more = true;
    while (more && bonds.size() < before + most)
      more = at_next_line([&](const std::string &line) {
        const std::vector<std::string> words = split_words(line);
        if (!words.empty() && words[0] == "sphere")
          spheres.push_back(parse_sphere(words));
        else if (!words.empty())
          bonds.push_back(parse_bond(words));
      });
    seen += bonds.size() - before;
    if (!more && seen != declared)
      throw BadInput("the bond file holds " + std::to_string(seen) + " bonds, its header says " +
                     std::to_string(declared) + ": it is incomplete or was changed (file '" + file +
                     "')");
    if (!more && (int64_t) spheres.size() != declared_spheres)
      throw BadInput("the bond file holds " + std::to_string(spheres.size()) +
                     " spheres, its header says " + std::to_string(declared_spheres) +
                     ": it is incomplete or was changed (file '" + file + "')");
    return more;
  }

 private:
  std::istream &in;
  std::string file;
  int64_t declared = 0, declared_spheres = 0, seen = 0, line_number = 0;

  /// Calls take(line); false at the end of the file. The cause stands first in messages: a path may be longer than what
  /// a host program shows.
  template <class F> bool at_next_line(F &&take)
  {
    std::string line;
    if (!std::getline(in, line)) return false;
    line_number++;
    try {
      // half a number may be a number too
      if (in.eof())
        throw BadInput(
            "the last line has no line end: the file is incomplete, or add the line end");
      take(line);
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
    if (words.size() != 4)
      throw BadInput("expected 'sphere id rho0 gap', got " + std::to_string(words.size()) +
                     " words");
    const SphereLine sphere = {parse_whole("id", words[1], 1), parse_number("rho0", words[2]),
                               parse_number("gap", words[3])};
    if (!(sphere.gap >= 0.0))
      throw BadInput("gap must be zero or positive, got " + shown(words[3]));
    return sphere;
  }

  static BondLine parse_bond(const std::vector<std::string> &words)
  {
    if (words.size() != 3 && words.size() != 7)
      throw BadInput("expected 3 or 7 values, got " + std::to_string(words.size()) +
                     " (a bond is id_i id_j deq, or id_i id_j deq q k work broken)");
    BondLine bond = {parse_whole("id_i", words[0], 1), parse_whole("id_j", words[1], 1),
                     parse_number("deq", words[2])};
    if (!(bond.deq > 0.0)) throw BadInput("deq must be positive, got " + shown(words[2]));
    if (words.size() == 3) return bond;
    const int64_t broken = parse_whole("broken", words[6], 0);
    bond.history = {parse_number("q", words[3]) / bond.deq, parse_number("k", words[4]),
                    parse_number("work", words[5]), broken == 1 ? 1.0 : 0.0};
    if (!(bond.history.k >= 0.0))
      throw BadInput("k must be zero or positive, got " + shown(words[4]));
    if (broken > 2)
      throw BadInput("broken must be 0 (a bond), 1 (a broken bond) or 2 (a new pair), got " +
                     shown(words[6]));
    bond.is_contact = broken == 2;
    return bond;
  }
};

}    // namespace EVP
