// SPDX-License-Identifier: GPL-2.0-only
// The text file of recorded bonds: one header line, then `id_i id_j deq` a line, or, where bonds flow
// or break, `id_i id_j deq q work broken` with broken 0 of a bond, 1 of one that broke for good, 2 of a
// contact that was no bond and has flowed.
//
//     # EVP bonds COUNT: 2975 UNITS: si
//     1 17 0.0101234
//
// With `within` of fix evp/bonds the header has WITHIN: and its word before UNITS:, so that versions that do
// not know it refuse the file.
// Reads in pieces, whatever the size; every refusal is a BadInput that names the line.
#pragma once

#include "core/pair_list.h"
#include "core/text.h"
#include "core/within.h"

#include <cstdint>
#include <cstdio>

namespace EVP {

/// One recorded pair: IDs of its atoms, equilibrium distance [length], and what of it has changed.
struct BondLine {
  int64_t id_i, id_j;
  double deq;
  PairHistory history = {};
  bool is_contact = false;    ///< no bond, but a contact that has flowed
};

/// The header line, without its end. beyond: bonds whose deq exceeds dlim, since alpha or radii have
/// shrunk; a reader that meets more of them has another alpha or other radii.
inline std::string bond_header(int64_t count, const std::string &units, int64_t beyond = 0,
                               Within within = Within::ALL)
{
  std::string header = "# EVP bonds COUNT: " + std::to_string(count);
  if (within != Within::ALL) header += std::string(" WITHIN: ") + WITHINS[(int) within];
  header += " UNITS: " + units;
  return beyond ? header + " BEYOND: " + std::to_string(beyond) : header;
}

/// One line of the file with its end; 17 digits bring deq back to the last bit.
inline std::string bond_text(const BondLine &bond, bool with_history = false)
{
  char text[192];
  int n = snprintf(text, sizeof(text), "%lld %lld %.17g", (long long) bond.id_i,
                   (long long) bond.id_j, bond.deq);
  if (with_history)
    snprintf(text + n, sizeof(text) - n, " %.17g %.17g %d", bond.history.offset * bond.deq,
             bond.history.work, bond.is_contact ? 2 : (int) bond.history.broken);
  return text + std::string("\n");
}

/// Reads a bond file from an open stream, which stays the caller's.
class BondReader {
 public:
  /// Reads the header; throws BadInput unless it is one in these units.
  BondReader(FILE *stream, const std::string &file_in, const std::string &units) :
      in(stream), file(file_in)
  {
    std::string line;
    const std::string expected = "expected the header '" + bond_header(0, units) +
        "' with the number of bonds, as write_evp_bonds writes it";
    if (!next_line(line)) refuse_file("is empty: " + expected);
    if (has_byte_order_mark(line))
      refuse("the file starts with a byte-order mark: save it without (plain ASCII or UTF-8)");
    std::istringstream words(line);
    std::string word[9];    // # EVP bonds COUNT: 2975 [WITHIN: type] UNITS: si BEYOND: 12
    for (int k = 0; k < 9; k++) {
      words >> word[k];
      if (k != 5 || word[k] != "WITHIN:") continue;
      words >> word[k];
      declared_within = parse_within_here(word[k]);
      words >> word[k];
    }
    if (word[0] != "#" || word[1] != "EVP" || word[2] != "bonds" || word[3] != "COUNT:" ||
        word[5] != "UNITS:")
      refuse(expected);
    if (word[6] != units)
      refuse("the bonds are in UNITS: " + shown(word[6]) + ", but 'units " + units +
             "' is in force");
    declared = parse_integer("COUNT", word[4], 0);
    if (word[7] == "BEYOND:") declared_beyond = parse_integer("BEYOND", word[8], 0);
  }

  /// Bonds that the header announces.
  int64_t count() const { return declared; }

  /// Which atoms were one body when the file was written.
  Within within() const { return declared_within; }

  /// Of these, bonds whose deq exceeded dlim when the file was written.
  int64_t beyond() const { return declared_beyond; }

  /// Appends up to most bonds; false at the end of the file, where the count must be met.
  bool read(std::vector<BondLine> &bonds, size_t most)
  {
    std::string line;
    for (size_t k = 0; k < most; k++) {
      std::vector<std::string> words;
      while (words.empty()) {
        if (!next_line(line)) {
          if (seen == declared) return false;
          refuse_file("holds " + std::to_string(seen) + " bonds, its header says " +
                      std::to_string(declared) + ": the file is incomplete or was changed");
        }
        words = split_words(line);
      }
      if (columns == 0) columns = words.size() == 6 ? 6 : 3;
      if (words.size() != columns)
        refuse("expected " + std::to_string(columns) + " values, got " +
               std::to_string(words.size()) +
               " (a bond is id_i id_j deq, or id_i id_j deq q work broken)");
      BondLine bond = {parse_integer("id_i", words[0], 1), parse_integer("id_j", words[1], 1),
                       parse_deq(words[2])};
      if (columns == 6) parse_history(bond, words);
      if (bond.id_i == bond.id_j) refuse("atom " + shown(words[0]) + " is bonded to itself");
      if (++seen > declared)
        refuse("more bonds than the " + std::to_string(declared) + " that the header says");
      bonds.push_back(bond);
    }
    return true;
  }

 private:
  static constexpr size_t LONGEST_LINE = 256;

  FILE *in;
  std::string file;
  int64_t declared = 0, declared_beyond = 0, seen = 0, line_number = 0;
  Within declared_within = Within::ALL;
  size_t columns = 0;    // of all lines

  // the cause stands first: a path may be longer than what a host program shows of a message
  [[noreturn]] void refuse(const std::string &why) const
  {
    throw BadInput("bond file line " + std::to_string(line_number) + ": " + why + " (file '" +
                   file + "')");
  }
  [[noreturn]] void refuse_file(const std::string &why) const
  {
    throw BadInput("the bond file " + why + " (file '" + file + "')");
  }

  bool next_line(std::string &line)
  {
    line.clear();
    line_number++;
    for (int c; (c = getc(in)) != EOF;) {
      if (c == '\n') return true;
      if (c == '\0') refuse("not a text file (a NUL byte)");
      if (line.size() == LONGEST_LINE)
        refuse("longer than " + std::to_string(LONGEST_LINE) + " characters");
      line += (char) c;
    }
    if (ferror(in)) refuse_file("cannot be read: is it a file of text?");
    // half a number may be a number too, so a last line without its end is refused
    if (!line.empty())
      refuse("the last line has no line end: the file is incomplete, or add the line end");
    return false;
  }

  int64_t parse_integer(const std::string &key, const std::string &word, int64_t least) const
  {
    const bool digits = word.find_first_not_of("0123456789") == std::string::npos;
    if (!digits || word.empty() || word.size() > 18)
      refuse(key + " must be a positive integer of at most 18 digits, got '" + shown(word) + "'");
    const int64_t value = std::stoll(word);
    if (value < least) refuse(key + " must be a positive integer, got 0");
    return value;
  }

  double parse(const std::string &key, const std::string &word) const
  {
    try {
      return parse_number(key, word);
    } catch (const BadInput &bad) {
      refuse(bad.what());
    }
  }

  Within parse_within_here(const std::string &word) const
  {
    try {
      return parse_within(word);
    } catch (const BadInput &bad) {
      refuse(bad.what());
    }
  }

  void parse_history(BondLine &bond, const std::vector<std::string> &words) const
  {
    const double q = parse("q", words[3]), work = parse("work", words[4]);
    if (!(q > -bond.deq && q < 1e3 * bond.deq))
      refuse("q must be above -deq and below 1000 deq, got " + shown(words[3]));
    if (words[5] != "0" && words[5] != "1" && words[5] != "2")
      refuse("broken must be 0 (a bond), 1 (a broken bond) or 2 (a new pair), got " +
             shown(words[5]));
    if (words[5] != "0" && q > 0.0)
      refuse("q must not be above 0 where there is no bond: new pairs flow in compression only");
    bond.history = {q / bond.deq, work, words[5] == "1" ? 1.0 : 0.0};
    bond.is_contact = words[5] == "2";
  }

  double parse_deq(const std::string &word) const
  {
    const double deq = parse("deq", word);
    if (!(deq > 0.0)) refuse("deq must be positive, got " + shown(word));
    if (!std::isfinite(1.0 / (deq * deq)))
      refuse("deq is too small to be a distance, got " + shown(word));
    return deq;
  }
};

}    // namespace EVP
