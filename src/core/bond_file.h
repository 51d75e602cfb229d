// SPDX-License-Identifier: GPL-2.0-only
// The text file of recorded bonds: one header line, then `id_i id_j deq` a line, or, with plasticity or `break`,
// `id_i id_j deq q k work broken` with broken 0 of a bond, 1 of one that broke for good, 2 of a contact
// that was no bond and has flowed.
//
//     # EVP bonds COUNT: 2975 UNITS: si
//     1 17 0.0101234
//
// With `within` or `zone` of fix evp/bonds the header has WITHIN: or ZONE: and its word before UNITS:.
// Reads in pieces, whatever the size; every refusal is a BadInput that names the line.
#pragma once

#include "core/contacts.h"
#include "core/pairs.h"
#include "core/text.h"

#include <cstdint>
#include <cstdio>
#include <istream>

namespace EVP {

/// One recorded pair: IDs of its atoms, equilibrium distance [length], and what of it has changed.
struct BondLine {
  int64_t id_i, id_j;
  double deq;
  PairHistory history = {};
  bool is_contact = false;    ///< no bond, but a contact that has flowed

  bool has_changed() const { return is_contact || !(history == PairHistory{}); }
};

/// The header line, without its end.
inline std::string bond_header(int64_t count, const std::string &units,
                               BodyRule within = BodyRule::ALL, double zone = 0.0)
{
  std::string header = "# EVP bonds COUNT: " + std::to_string(count);
  if (within != BodyRule::ALL) header += std::string(" WITHIN: ") + BODY_RULES[(int) within];
  if (zone > 0.0) header += " ZONE: " + shortest_text(zone);
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
      while (words.size() > 6 && (words[4] == "WITHIN:" || words[4] == "ZONE:")) {
        if (words[4] == "WITHIN:")
          body_rule = parse_body_rule(words[5]);
        else
          zone_ = parse_number("ZONE", words[5]);
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

  /// Bonds that the header announces.
  int64_t count() const { return declared; }

  /// Which atoms were one body when the file was written.
  BodyRule within() const { return body_rule; }

  /// Up to zone (R_i + R_j) pairs were recorded; 0: up to the alpha of their types.
  double zone() const { return zone_; }

  /// Appends up to most bonds; false at the end of the file, where the count must be met.
  bool read(std::vector<BondLine> &bonds, size_t most)
  {
    const size_t end = bonds.size() + most;
    while (bonds.size() < end) {
      const bool more = at_next_line([&](const std::string &line) {
        const std::vector<std::string> words = split_words(line);
        if (!words.empty()) bonds.push_back(parse_bond(words));
      });
      if (more) continue;
      seen += bonds.size() - (end - most);
      check_count();
      return false;
    }
    seen += most;
    return true;
  }

 private:
  std::istream &in;
  std::string file;
  int64_t declared = 0, seen = 0, line_number = 0;
  BodyRule body_rule = BodyRule::ALL;
  double zone_ = 0.0;

  void check_count() const
  {
    if (seen != declared)
      throw BadInput("the bond file holds " + std::to_string(seen) + " bonds, its header says " +
                     std::to_string(declared) + ": it is incomplete or was changed (file '" + file +
                     "')");
  }

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
