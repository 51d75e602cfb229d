// SPDX-License-Identifier: GPL-2.0-only
//
// The text file of recorded bonds: one header line, then `id_i id_j deq` a line.
//
//     # EVP bonds COUNT: 2975 UNITS: si
//     1 17 0.0101234
//
// Pure C++17. Reads in pieces, whatever the size; every refusal is a BadInput that names the line.

#ifndef EVP_CORE_BOND_FILE_H
#define EVP_CORE_BOND_FILE_H

#include "core/text.h"

#include <cstdint>
#include <cstdio>

namespace EVP {

/// One recorded pair: IDs of its atoms and equilibrium distance [length].
struct BondLine {
  int64_t id_i, id_j;
  double deq;
};

/// The header line, without its end. beyond: bonds whose deq exceeds dlim, since alpha or radii have
/// shrunk; a reader that meets more of them has another alpha or other radii.
inline std::string bond_header(int64_t count, const std::string &units, int64_t beyond = 0)
{
  const std::string header = "# EVP bonds COUNT: " + std::to_string(count) + " UNITS: " + units;
  return beyond ? header + " BEYOND: " + std::to_string(beyond) : header;
}

/// One line of the file with its end; 17 digits bring deq back to the last bit.
inline std::string bond_text(const BondLine &bond)
{
  char text[96];
  snprintf(text, sizeof(text), "%lld %lld %.17g\n", (long long) bond.id_i, (long long) bond.id_j,
           bond.deq);
  return text;
}

/// Reads a bond file from an open stream, which stays the caller's.
class BondReader {
 public:
  /// Reads the header; throws BadInput unless it is one in these units.
  BondReader(FILE *stream, const std::string &file_in, const std::string &units) :
      in(stream), file(file_in), declared(0), declared_beyond(0), seen(0), line_number(0)
  {
    std::string line;
    const std::string expected = "expected the header '" + bond_header(0, units) +
        "' with the number of bonds, as write_evp_bonds writes it";
    if (!next_line(line)) refuse_file("is empty: " + expected);
    std::istringstream words(line);
    if (has_byte_order_mark(line))
      refuse("the file starts with a byte-order mark: save it without (plain ASCII or UTF-8)");
    std::string hash, evp, bonds, count_tag, count, units_tag, found, beyond_tag, beyond_count;
    words >> hash >> evp >> bonds >> count_tag >> count >> units_tag >> found >> beyond_tag >>
        beyond_count;
    if (hash != "#" || evp != "EVP" || bonds != "bonds" || count_tag != "COUNT:" ||
        units_tag != "UNITS:")
      refuse(expected);
    if (found != units)
      refuse("the bonds are in UNITS: " + shown(found) + ", but 'units " + units + "' is in force");
    declared = parse_id("COUNT", count);
    if (beyond_tag == "BEYOND:") declared_beyond = parse_id("BEYOND", beyond_count);
  }

  /// Bonds that the header announces.
  int64_t count() const { return declared; }

  /// Of these, bonds whose deq exceeded dlim when the file was written.
  int64_t beyond() const { return declared_beyond; }

  /// Appends up to most bonds; false at the end of the file, where the count must be met.
  bool read(std::vector<BondLine> &bonds, size_t most)
  {
    std::string line;
    for (size_t k = 0; k < most;) {
      if (!next_line(line)) {
        if (seen != declared)
          refuse_file("holds " + std::to_string(seen) + " bonds, its header says " +
                      std::to_string(declared) + ": the file is incomplete or was changed");
        return false;
      }
      const std::vector<std::string> words = split_words(line);
      if (words.empty()) continue;
      if (words.size() != 3)
        refuse("a bond is `id_i id_j deq`, got " + std::to_string(words.size()) + " words");
      const BondLine bond = {parse_id("id_i", words[0]), parse_id("id_j", words[1]),
                             parse_deq(words[2])};
      if (bond.id_i == bond.id_j) refuse("atom " + shown(words[0]) + " is bonded to itself");
      if (++seen > declared)
        refuse("more bonds than the " + std::to_string(declared) + " that the header says");
      bonds.push_back(bond);
      k++;
    }
    return true;
  }

 private:
  static constexpr size_t LONGEST_LINE = 256;

  FILE *in;
  std::string file;
  int64_t declared, declared_beyond, seen;
  long line_number;

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
    // half a number may be a number too, so a last line without its end is not believed
    if (!line.empty())
      refuse("the last line has no line end: the file is incomplete, or add the line end");
    return false;
  }

  int64_t parse_id(const std::string &key, const std::string &word) const
  {
    const bool digits = !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
    if (!digits || word.size() > 18)
      refuse(key + " must be a positive integer of at most 18 digits, got '" + shown(word) + "'");
    const int64_t id = std::stoll(word);
    if (id == 0 && key != "COUNT" && key != "BEYOND")
      refuse(key + " must be a positive integer, got 0");
    return id;
  }

  double parse_deq(const std::string &word) const
  {
    double deq = 0.0;
    try {
      deq = parse_number("deq", word);
    } catch (const BadInput &bad) {
      refuse(bad.what());
    }
    if (!(deq > 0.0)) refuse("deq must be positive, got " + shown(word));
    if (!std::isfinite(1.0 / (deq * deq)))
      refuse("deq is too small to be a distance, got " + shown(word));
    return deq;
  }
};

}    // namespace EVP

#endif
