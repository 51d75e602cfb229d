// SPDX-License-Identifier: GPL-2.0-only
//
// From words to a checked row, and the text file of bonds: what is taken, what is written reads back
// to the last bit, and the text that each refusal must give. What rows are multiplied by, of the bonds.

#include "core/base/seal.h"
#include "core/bonds/bond_file.h"
#include "core/law/coefficients.h"
#include "core/law/row_text.h"

#include <cmath>
#include <cstdlib>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

using EVP::BadInput;
using EVP::BondLine;
using EVP::BondMeasures;
using EVP::Coefficients;
using EVP::Row;

namespace {

const std::string TABLE1 = "80 8 4 3 8 4 0.005 0 1.5";

/// Expects that action() throws BadInput, and that what() holds every part of the text; returns it.
template <class F> std::string expect_refusal(F action, const std::vector<std::string> &parts)
{
  try {
    action();
    ADD_FAILURE() << "taken without a word; expected: " << parts.front();
  } catch (const BadInput &bad) {
    for (const auto &part : parts)
      EXPECT_NE(std::string(bad.what()).find(part), std::string::npos)
          << "message: " << bad.what() << "\nlacks:   " << part;
    return bad.what();
  }
  return "";
}

Row row_of(const std::string &line)
{
  return EVP::parse_row(EVP::split_words(line));
}

void expect_bad_row(const std::string &line, const std::vector<std::string> &parts)
{
  SCOPED_TRACE(line);
  expect_refusal(std::bind(row_of, line), parts);
}

const std::string HEADER = "# DATE: 2017-05-15 UNITS: si CITATION: hal-01899324\n";
const std::string FILE_TEXT = HEADER +
    "\n# name e1 m1 n1 e2 m2 n2 xi_s gamma alpha\n"
    "table1 80 8 4 3 8 4 0.005 0 1.5\n"
    "   table2\t80 8 4 3 8 4 0.005 1000 1.5   # with damping\n";

Row from_file(const std::string &text, const std::string &name = "table1",
              const std::string &units = "si")
{
  return EVP::row_from_text(text, "gado.evp", name, units);
}

void expect_bad_file(const std::string &text, const std::vector<std::string> &parts,
                     const std::string &name = "table1", const std::string &units = "si")
{
  SCOPED_TRACE(text);
  expect_refusal(std::bind(from_file, text, name, units), parts);
}

/// All bonds of a text.
std::vector<BondLine> read_all(const std::string &text, const std::string &file = "body.bonds")
{
  std::istringstream stream(text);
  EVP::BondReader reader(stream, file, "si");
  std::vector<BondLine> bonds;
  std::vector<EVP::SphereLine> spheres;
  while (reader.read(bonds, spheres, 3)) {}
  return bonds;
}

std::string header(int64_t count)
{
  EVP::BondHeader header;
  header.bonds = count;
  return EVP::bond_header(header, "si") + "\n";
}

/// Values of an effect, as bond files may have them.
struct Example {
  double level, share, factor, batch, inner;

  static constexpr const char *NAME = "example";
  static constexpr unsigned NEEDS = EVP::NOTHING_ELSE;
  static constexpr EVP::SphereValue TABLE[] = {
      {"level", "1", EVP::BY_BONDS, EVP::Range::ANY, false},
      {"share", "1", 0.0, EVP::Range::NOT_NEGATIVE, false},
      {"factor", "1", 1.0, EVP::Range::POSITIVE, true},
      {"batch_of_it", "1", 0.0, EVP::Range::BATCH, false},
      {"inner", "energy", 0.0, EVP::Range::NOT_IN_FILES, false}};
};
const bool has_example = EVP::add_table<Example>();

const std::string SPHERE_COLUMNS =
    "plastic_strain,plastic_work,slip,bonds,recorded,level,share,factor,batch_of_it";

/// Of a file without bonds, with so many spheres that have these values.
std::string header_of_spheres(int64_t spheres, const std::string &columns = SPHERE_COLUMNS)
{
  EVP::BondHeader header;
  header.spheres = spheres;
  header.columns = columns;
  return EVP::bond_header(header, "si") + "\n";
}

}    // namespace

TEST(ParseRow, TakesTheNumbersInThePapersOrder)
{
  const Row row = row_of("80 8 4 3 7.5 3.2 5e-3 1000 1.5");
  const double found[] = {row.e1, row.m1,   row.n1,    row.e2,   row.m2,
                          row.n2, row.xi_s, row.gamma, row.alpha};
  const double expected[] = {80, 8, 4, 3, 7.5, 3.2, 0.005, 1000, 1.5};
  for (int k = 0; k < EVP::NREQUIRED; k++) EXPECT_EQ(found[k], expected[k]) << k;
}

TEST(ParseRow, TakesTheEndsOfEachRange)
{
  for (const char *line :
       {"0 8 4 3 8 4 0.005 0 1.5", "80 8 4 0 8 4 0.005 0 1.5", "+80 8 .5 3. 8 4 0.005 0 1.0000001",
        "80 200 1 3 8 4 0.005 0 1.5", "80 8 4 3 8 4 0.9 0 100", "8E1 8 4 3 8 4 1e-9 0 1.5",
        "80 4.0005 4 3 8 4 0.005 0 1.5", "80 8 4 3 190.02 190 0.005 0 1.5",
        "80 8 4 3 0.00021 0.0001 0.005 0 1.5", "80 0.0102 0.01 3 8 4 0.005 0 1.5"})
    EXPECT_NO_THROW(row_of(line)) << line;
}

// {line, parts of its message}
TEST(ParseRow, RefusesWhatIsNoRow)
{
  const std::string rule = "(a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)";
  const std::string number = "finite decimal number", both = " spacing 1 coordination 2";
  std::string many;
  for (int k = 0; k < 33; k++) many += " " + std::to_string(k) + " 1";
  const std::string together = "spacing and coordination are given together";
  const std::vector<std::vector<std::string>> cases = {
      {"", rule, "expected 9 values, got 0"},
      {"80 8 4 3 8 4 0.005 0", rule, "got 8"},
      {TABLE1 + " 7", rule, "got 10"},
      {"eighty 8 4 3 8 4 0.005 0 1.5", "e1", number, "'eighty'"},
      {"80 nan 4 3 8 4 0.005 0 1.5", "m1", number, "'nan'"},
      {"80 8 4 inf 8 4 0.005 0 1.5", "e2", number, "'inf'"},
      {"80 8 4 3 8 4 0.005 1e400 1.5", "gamma", number, "'1e400'"},
      {"0x50 8 4 3 8 4 0.005 0 1.5", "e1", number, "'0x50'"},
      {"80 8 4 3 8 4 0,005 0 1.5", "xi_s", number, "'0,005'"},
      {"80 8 4 3 8 4 0.005 0 1.5m", "alpha", number, "'1.5m'"},
      {"80 8 4-1 3 8 4 0.005 0 1.5", "n1", number, "'4-1'"},
      {"80 4 8 3 8 4 0.005 0 1.5", "m1 > n1 > 0", "m1 = 4 and n1 = 8"},
      {"80 8 8 3 8 4 0.005 0 1.5", "m1 > n1 > 0", "m1 = 8 and n1 = 8"},
      {"80 8 0 3 8 4 0.005 0 1.5", "m1 > n1 > 0", "n1 = 0"},
      {"80 8 4 3 -4 -8 0.005 0 1.5", "m2 > n2 > 0", "m2 = -4 and n2 = -8"},
      {"80 8 4 3 201 4 0.005 0 1.5", "m2", "must not exceed 200", "201"},
      {"-80 8 4 3 8 4 0.005 0 1.5", "e1 must be zero or positive", "-80"},
      {"80 8 4 -3 8 4 0.005 0 1.5", "e2 must be zero or positive", "-3"},
      {"80 8 4 3 8 4 0.005 -1 1.5", "gamma must be zero or positive", "-1"},
      {"80 8 4 3 8 4 0 0 1.5", "xi_s must lie between 0 and 1", "got 0"},
      {"80 8 4 3 8 4 1 0 1.5", "xi_s must lie between 0 and 1", "got 1"},
      {"80 8 4 3 8 4 0.005 0 1", "alpha must be greater than 1", "got 1"},
      {"80 8 4 3 8 4 0.005 0 101", "alpha must not exceed 100", "got 101"},
      {"80 4.000000000000007 4 3 8 4 0.005 0 1.5",
       "exponents too close: m1 - n1 = 7.10543e-15, must be at least 0.0004", "of m1"},
      {"80 4.0003 4 3 8 4 0.005 0 1.5", "m1 - n1 = 0.0003, must be at least 0.00040003"},
      {"80 8 4 3 190.01 190 0.005 0 1.5", "m2 - n2 = 0.01, must be at least 0.019001", "of m2"},
      {"80 8 4 3 0.00019 0.0001 0.005 0 1.5", "m2 - n2 = 9e-05, must be at least 0.0001"},
      {"80 200 4 3 8 4 0.999 0 1.5", "overflow"},    // (1 - xi_s)^-(m+1) = 1e603 when compressed
      {"1e308 8 4 3 8 4 0.005 0 1.5", "overflow"},
      {TABLE1 + " pitch 1", "unknown keyword 'pitch'", "after its 9 values",
       "spacing, coordination, kv, density, yield, conductivity, capacity, soften, melt, rate, "
       "expansion, damage, rupture, rupture energy, flow, limit"},
      {TABLE1 + " limit", "keyword limit of a row takes the word own"},
      {TABLE1 + " limit 3", "keyword limit of a row takes the word own"},
      {"80 8 4 3 8 4 0.19 0 1.5 limit own", "limit own needs xi_s below 0.189207"},
      {TABLE1 + " e1 1", "unknown keyword 'e1'"},
      {TABLE1 + " Spacing 1 coordination 2", "unknown keyword 'Spacing'"},
      {TABLE1 + both + " 3", "unknown keyword '3'"},
      {TABLE1 + both + " kv", "keyword kv needs a value"},
      {TABLE1 + " spacing 1", together},
      {TABLE1 + " coordination 1 kv 4", together},
      {TABLE1 + " kv -1", "kv must lie between 0 and 1e100", "got -1"},
      {TABLE1 + " flow", "flow needs 1 to 32 points", "got 0 numbers"},
      {TABLE1 + " flow 0 1 0.1", "got 3 numbers"},
      {TABLE1 + " flow" + many, "got 66 numbers"},
      {TABLE1 + " flow 0.1 1", "flow must begin with 0 1", "got 0.1 1"},
      {TABLE1 + " flow 0 1.1", "flow must begin with 0 1", "got 0 1.1"},
      {TABLE1 + " flow 0 1 0.1 2 0.1 3", "plastic strains of flow must ascend",
       "got 0.1 after 0.1"},
      {TABLE1 + " flow 0 1 0.1 0", "limits of flow must be positive and below 37.8414", "got 0"},
      {TABLE1 + " flow 0 1 0.1 37.9", "limits of flow", "got 37.9"},
      {TABLE1 + " soften 293", "keyword soften needs a value more: soften_tmelt"},
      {TABLE1 + " soften 293 775 kv 1", "soften_m must be a finite decimal number, got 'kv'"},
      {TABLE1 + " soften 293 293 1", "soften_tmelt must lie above TREF = 293", "got 293"},
      {TABLE1 + " soften -1 775 1", "soften must be a temperature of 0 or more", "got -1"},
      {TABLE1 + " soften 293 775 0", "soften_m must be positive", "got 0"},
      {TABLE1 + " soften 293 775 1 1", "soften_floor must lie between 0 and 1", "got 1"},
      {TABLE1 + " soften_m 1", "unknown keyword 'soften_m'"},
      {TABLE1 + " rate 0.015", "keyword rate needs a value more: rate_rate0"},
      {TABLE1 + " rate 0.015 0", "rate_rate0 must be positive", "got 0"},
      {TABLE1 + " expansion 2e-5", "keyword expansion needs a value more: expansion_tref"},
      {TABLE1 + " expansion -2e-5 293", "expansion must be positive", "got -2e-05"},
      {TABLE1 + " expansion 0 293", "expansion must be positive", "got 0"},
      {TABLE1 + " expansion 2e-5 -1", "expansion_tref must be a temperature of 0 or more",
       "got -1"},
      {TABLE1 + " melt 4e5", "melt needs soften TREF TMELT M in front of it"},
      {TABLE1 + " kv 1e101", "kv must lie between 0 and 1e100", "got 1e+101"}};
  for (const auto &one : cases) expect_bad_row(one[0], {one.begin() + 1, one.end()});
  for (const std::string value : {"0", "-1", "-0"})
    for (const std::string key : {"spacing", "coordination", "density", "conductivity", "capacity"})
      expect_bad_row(TABLE1 + " " + key + " " + value, {key + " must be positive", "got " + value});
  for (int k = EVP::NREQUIRED; k < EVP::NMEMBERS; k++)
    if (EVP::MEMBERS[k].place == EVP::Member::HEAD)
      expect_bad_row(TABLE1 + " " + EVP::MEMBERS[k].key + " nan", {EVP::MEMBERS[k].key, number});
}

TEST(ParseRow, RefusesAKeywordThatIsGivenTwice)
{
  const std::string every = " spacing 0.01 coordination 12 kv 1 density 2700 conductivity 1 "
                            "capacity 1 soften 293 775 1 0.1 melt 1 rate 0.01 1 expansion 1e-5 293 "
                            "flow 0 1 limit own";
  EXPECT_NO_THROW(row_of(TABLE1 + every));
  const std::vector<std::string> again = {"spacing 0.01",     "coordination 12", "kv 1",
                                          "density 2700",     "conductivity 1",  "capacity 1",
                                          "soften 0 1 1",     "melt 1",          "rate 1 1",
                                          "expansion 1e-5 0", "flow 0 1 1 2",    "limit own"};
  for (const std::string &words : again)
    expect_bad_row(TABLE1 + every + " " + words,
                   {"keyword " + words.substr(0, words.find(' ')) + " of a row is given twice"});
}

TEST(ParseRow, TakesKeywordsInAnyOrder)
{
  Row row = row_of(TABLE1);
  EXPECT_EQ(row, (Row{80, 8, 4, 3, 8, 4, 0.005, 0, 1.5}));
  EXPECT_FALSE(row_of(TABLE1 + " kv 3 density 2700 flow 0 1").is_scaled());
  row.spacing = 0.00442;
  row.coordination = 11.9;
  EXPECT_EQ(row_of(TABLE1 + " coordination 11.9 spacing 4.42e-3"), row);
  EXPECT_TRUE(row.is_scaled());
  row.kv = 1000.0;
  row.density = 2700.0;
  row.flow = {2, {0.0, 0.2}, {1.0, 1.5}};
  EXPECT_EQ(
      row_of(TABLE1 + " spacing 0.00442 coordination 11.9 kv 1e3 density 2700 flow 0 1 .2 1.5"),
      row);
  EXPECT_EQ(
      row_of(TABLE1 + " flow 0 1 .2 1.5 density 2700 coordination 11.9 kv 1000 spacing 4.42e-3"),
      row);
  row.conductivity = 120.0;
  row.capacity = 875.0;
  row.soften_tref = 0.0;
  row.soften_tmelt = 775.0;
  const std::string rest = " spacing 0.00442 coordination 11.9 kv 1e3 density 2700 flow 0 1 .2 1.5";
  EXPECT_EQ(row_of(TABLE1 + " capacity 875 soften 0 775 1 conductivity 120" + rest), row);
  row.soften_m = 1.7;
  row.soften_floor = 0.1;
  row.melt = 4e5;
  EXPECT_EQ(row_of(TABLE1 + rest + " capacity 875 conductivity 120 soften 0 775 1.7 0.1 melt 4e5"),
            row);
  EXPECT_EQ(row_of(TABLE1 + " kv 0"), row_of(TABLE1));
  EXPECT_EQ(row_of(TABLE1 + " kv 1e100").kv, 1e100);
}

// a data file holds row_text(), of which read_data makes pair_coeff again
TEST(RowText, IsReadAsTheSameRow)
{
  for (const std::string words : {"", " kv 0.1", " kv 0.1 limit own", " rate 0.015 1",
                                  " conductivity 120 capacity 875 soften 0 775 1 0.02 melt 400000",
                                  " rate 0.015 1 expansion 2.3e-05 293", " expansion 2.3e-05 0",
                                  " spacing 0.00442 coordination 11.9 density 2700 flow 0 1 0.1 "
                                  "1.5 0.30000000000000004 0.5"}) {
    const std::string text = "0.1 8 4 0.30000000000000004 8 4 0.005 0 1.5" + words;
    EXPECT_EQ(row_text(row_of(text)), text);
  }
}

TEST(SplitFileAndRow, TakesTheLastColon)
{
  using Pair = std::array<std::string, 2>;
  EXPECT_EQ(EVP::split_file_and_row("metals.evp:copper"), (Pair{"metals.evp", "copper"}));
  EXPECT_EQ(EVP::split_file_and_row("/a:b/m.evp:c"), (Pair{"/a:b/m.evp", "c"}));
  for (const std::string word : {"", ":", "metals.evp", "metals.evp:", ":copper"})
    expect_refusal(std::bind(EVP::split_file_and_row, word),
                   {"expected FILE:ROW", "'" + word + "'"});
}

TEST(FindFileAndRow, TellsThemFromNumbers)
{
  using Pair = std::array<std::string, 2>;
  const Pair both = {"metals.evp", "304"};
  EXPECT_EQ(EVP::find_file_and_row({"metals.evp", "304"}), both);
  EXPECT_EQ(EVP::find_file_and_row({"metals.evp:304"}), both);
  EXPECT_EQ(EVP::find_file_and_row({"3d.evp", "a"}), (Pair{"3d.evp", "a"}));
  EXPECT_EQ(EVP::find_file_and_row({"./80", "8"}), (Pair{"./80", "8"}));
  for (const char *numbers : {"", "80", "80 8", "-1e3 a", "80 8 4 3 8 4 0.005 0 1.5 kv 3",
                              "nan 8 4 3 8 4 0.005 0 1.5", "8x 8 4"})
    EXPECT_FALSE(EVP::find_file_and_row(EVP::split_words(numbers))) << numbers;
}

TEST(Words, OfANumberReadBackToIt)
{
  EXPECT_EQ(EVP::shortest_text(0.005), "0.005");
  EXPECT_EQ(EVP::shortest_text(80.0), "80");
  EXPECT_EQ(EVP::shortest_text(0.0), "0");
  for (const double value : {1.0 / 3.0, 4.9406564584124654e-324, 1.7976931348623157e308, -0.1})
    EXPECT_EQ(std::strtod(EVP::shortest_text(value).c_str(), nullptr), value);

  // words end at a comment
  EXPECT_EQ(EVP::split_words("  a\tb c # d e"), (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_TRUE(EVP::split_words("# only a comment").empty());
  EXPECT_TRUE(EVP::split_words("").empty());
}

TEST(RowFromText, FindsTheRowByItsName)
{
  EXPECT_EQ(from_file(FILE_TEXT, "table1").gamma, 0.0);
  EXPECT_EQ(from_file(FILE_TEXT, "table2"), row_of("80 8 4 3 8 4 0.005 1000 1.5"));
  // keywords are those of its row only; lines may end as elsewhere
  const std::string text =
      FILE_TEXT + "metal " + TABLE1 + " kv 7 spacing 1e-3 coordination 12 # c\n";
  EXPECT_EQ(from_file(text, "metal"), row_of(TABLE1 + " spacing 1e-3 coordination 12 kv 7"));
  EXPECT_EQ(from_file(text, "table1"), row_of(TABLE1));
  expect_bad_file(HEADER + ("table1 " + TABLE1) + " spacing 2\n",
                  {"gado.evp line 2", "spacing and coordination are given together"});
  std::string dos;
  for (const char c : FILE_TEXT) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(from_file(dos, "table2").alpha, 1.5);
  EXPECT_EQ(from_file(FILE_TEXT.substr(0, FILE_TEXT.size() - 1), "table2").alpha, 1.5);
}

TEST(RowFromText, RefusesBadFilesWithNameAndLine)
{
  const std::string rule = "first line must be a comment with 'UNITS: si'",
                    bad = " 80 4 8 3 8 4 0.005 0 1.5\n";
  expect_bad_file(FILE_TEXT, {"gado.evp", "no row 'table3'", "table1, table2"}, "table3");
  expect_bad_file(HEADER, {"no row 'table1'", "none"});
  expect_bad_file(FILE_TEXT, {"gado.evp", "'UNITS: lj', the units in force, got 'si'"}, "table1",
                  "lj");
  EXPECT_NO_THROW(from_file("# UNITS: lj\nsoft 1 8 4 1 8 4 0.005 0 1.5\n", "soft", "lj"));
  for (const std::string &text :
       {"table1 " + TABLE1 + "\n", "# no units here\ntable1 " + TABLE1 + "\n", "\n" + FILE_TEXT,
        std::string("# UNITS:\n")})
    expect_bad_file(text, {"gado.evp", rule});
  expect_bad_file(HEADER + "table1 80 8 4 3 8 4 0.005 0\n",
                  {"gado.evp line 2", "expected 9 values, got 8"});
  expect_bad_file(FILE_TEXT + "another" + bad, {"gado.evp line 6", "m1 > n1 > 0"});
  expect_bad_file(FILE_TEXT + "table1 " + TABLE1 + "\n",
                  {"gado.evp line 6", "'table1' is given twice"});
}

TEST(BondText, ReadsBackToTheLastBit)
{
  using EVP::Remembered;
  const double third = 1.0 / 3.0, eps = std::numeric_limits<double>::epsilon();
  const std::vector<BondLine> bonds = {{1, 2, third},
                                       {2, 3, 1.0 + eps, Remembered::APART},
                                       {3, 4, 1.0 - eps / 2.0, Remembered::CONTACT},
                                       {7, 999999999999999999, 6.02e23},
                                       {4, 5, 1e-100 * third},
                                       {5, 6, 0.1 + 0.2}};
  EVP::BondHeader header;
  header.bonds = 4;
  header.contacts = 2;
  std::string text = EVP::bond_header(header, "si") + "\n";
  for (const auto &bond : bonds) text += EVP::bond_text(bond);
  const std::vector<BondLine> again = read_all(text);
  ASSERT_EQ(again.size(), bonds.size());
  for (size_t k = 0; k < bonds.size(); k++) {
    EXPECT_EQ(again[k].id, bonds[k].id);
    EXPECT_EQ(again[k].bond.partner, bonds[k].bond.partner);
    EXPECT_EQ(again[k].bond.deq, bonds[k].bond.deq) << "17 digits are enough for every double";
    EXPECT_EQ(again[k].kind, bonds[k].kind);
  }
}

TEST(BondReader, ReadsHeaderAndSpheresBackToTheLastBit)
{
  const EVP::SphereLine one = {7, {1.0 / 3.0, 0.1 + 0.2, 1e-9, 12, 13, -1.0 / 3.0, 0.7, 0.125, 2}};
  EVP::SphereLine other = one;
  other.id = 9;
  std::istringstream stream(
      EVP::bond_header({1, EVP::BodyRule::TYPE, 1.3, 0, 2, {5, 3}, {}, {}, SPHERE_COLUMNS}, "si") +
      "\n" + EVP::sphere_text(one) + EVP::bond_text({1, 2, 0.01}) + EVP::sphere_text(other));
  EVP::BondReader reader(stream, "body.bonds", "si");
  std::vector<BondLine> bonds;
  std::vector<EVP::SphereLine> spheres;
  while (reader.read(bonds, spheres, 1)) {}
  ASSERT_EQ(spheres.size(), 2u);
  EXPECT_EQ(bonds.size(), 1u);
  EXPECT_EQ(reader.header.zone, 1.3);
  EXPECT_EQ(reader.header.counts.ended, 5);
  EXPECT_EQ(reader.header.counts.failed, 3);
  EXPECT_TRUE(reader.header.within == EVP::BodyRule::TYPE);
  EXPECT_EQ(spheres[1].id, 9);
  EXPECT_EQ(reader.header.columns, SPHERE_COLUMNS);
  EXPECT_EQ(spheres[0].values, one.values);
}

TEST(BondReader, SkipsCommentsEmptyLinesAndDosLineEnds)
{
  const auto bonds = read_all("# EVP bonds COUNT: 2 UNITS: si\r\n"
                              "\r\n# a comment\n  1\t2  0.01  # the first\r\n\n2 3 +1E-2\n");
  ASSERT_EQ(bonds.size(), 2u);
  EXPECT_EQ(bonds[0].bond.deq, 0.01);
  EXPECT_EQ(bonds[1].bond.deq, 0.01);
  EXPECT_TRUE(read_all(header(0)).empty()) << "no bonds are as good as any number";
}

// A host program may show the first 99 characters of a message, and a path can be longer: the cause stands first.
TEST(BondReader, NamesLineCauseAndFileOfEachDamage)
{
  const std::string expected = "expected the header '# EVP bonds COUNT: 0 UNITS: si'";
  const std::string path = std::string(300, 'p') + "/body.bonds";
  const std::string SPHERE = "sphere 1 0 0 0 12 12 -0.5 0.7 2 1\n";
  const std::vector<std::vector<std::string>> cases = {
      {"", "the bond file is empty"},
      {"1 2 0.01\n", "line 1: " + expected},
      {"# EVP bonds UNITS: si COUNT: 0\n", "line 1: " + expected},
      {"# EVP bonds COUNT: 0 UNITS: lj\n", "line 1: ", "in UNITS: lj, but 'units si' is in force"},
      {"# EVP bonds COUNT: 0 WITHIN: all UNITS: si\n", "line 1: within must be type or molecule"},
      {"# EVP bonds COUNT: 1.5 UNITS: si\n", "line 1: COUNT must be", "got '1.5'"},
      {header(3) + "1 2 0.01\n2 3 0.01\n", "holds 2 bonds, its header says 3", "incomplete"},
      {header(1) + "1 2 0.01\n2 3 0.01\n", "holds 2 bonds, its header says 1"},
      {header(1) + "1 2 0.01", "line 2: the last line has no line end"},    // maybe 0.0101234
      {header(1) + "1 2\n", "line 2: expected 'id_i id_j deq', got 2 values"},
      {header(1) + "1 2 0.0\r1\n", "line 2: expected 'id_i id_j deq', got 4"},    // never 0.01
      {header(1) + "contact 1 2\n", "line 2: expected 'id_i id_j deq', got 2"},
      {header(1) + "broken 1 2 0.01\n", "line 2: expected 'id_i id_j deq', got 4"},
      {header(1) + "0 2 0.01\n", "line 2: id_i must be", "at least 1, got '0'"},
      {header(1) + "1 2.0 0.01\n", "line 2: id_j must be", "got '2.0'"},
      {header(1) + "1 99999999999999999999 0.01\n", "line 2: id_j must be", "at most 18 digits"},
      {header(1) + "1 2 0\n", "line 2: deq must be positive, got 0"},
      {header(1) + "1 2 nan\n", "line 2: deq must be a finite decimal number, got 'nan'"},
      {header(1) + std::string("1 2 0.\0\n", 8), "line 2: deq must be a finite decimal number"},
      {header(0) + "contact 1 2 0.01\n", "holds 1 contacts, its header says 0", "incomplete"},
      {"# EVP bonds COUNT: 0 COLUMNS: " + SPHERE_COLUMNS + " UNITS: si\n" + SPHERE,
       "holds 1 spheres, its header says 0", "incomplete"},
      {header(0) + SPHERE, "line 2: expected 'sphere id' and the 0 values that COLUMNS"},
      {header_of_spheres(1, "plastic_strian"),
       "line 1: COLUMNS has 'plastic_strian', which spheres do not keep; they keep ",
       "level, share, factor, batch_of_it, given_strain, plastic_strain, plastic_work, slip"},
      {header_of_spheres(1, "inner"), "COLUMNS has 'inner', which spheres do not keep"},
      {header_of_spheres(1, "slip,slip"), "line 1: COLUMNS has slip twice"},
      {"# EVP bonds COUNT: 0 BOND_COLUMNS: deq,dqe UNITS: si\n",
       "line 1: BOND_COLUMNS has 'dqe', which bonds do not keep; they keep deq"},
      {EVP::bond_header({0, EVP::BodyRule::ALL, 0.0, 0, 0, {1, 2}}, "si") + "\n",
       "FAILED is a part of ENDED, got FAILED: 2 of ENDED: 1"},
      {header_of_spheres(2) + SPHERE, "holds 1 spheres, its header says 2"},
      {header_of_spheres(1) + "sphere 1 0.5\n", "line 2: expected 'sphere id' and the 9 values",
       "got 3 words"},
      {header_of_spheres(1) + "sphere 0 0 0 0 0 0 0 0 1 1\n", "line 2: id must be",
       "at least 1, got '0'"},
      {header_of_spheres(1) + "sphere 1 nan 0 0 0 0 0 0 1 1\n",
       "line 2: plastic_strain must be a finite"},
      {header_of_spheres(1) + "sphere 1 0 0 0 3.7 0 0 0 1 1\n", "bonds must be a whole number",
       "got 3.7"},
      {header_of_spheres(1) + "sphere 1 0 0 0 0 0 0 -1 1 1\n",
       "share must be zero or positive, got -1"},
      {header_of_spheres(1) + "sphere 1 0 0 0 0 0 0 0 1 0.5\n",
       "batch_of_it must be a whole number", "got 0.5"},
      {header_of_spheres(1, "given_strain,factor") + "sphere 1 -1 0\n",
       "line 2: factor must be positive, got 0"},
      {header_of_spheres(1, "given_strain") + "sphere 1 -0.5\n",
       "line 2: given_strain must be zero or positive, got -0.5"}};
  for (const auto &parts : cases) {
    SCOPED_TRACE(parts[0]);
    const std::string what =
        expect_refusal(std::bind(read_all, parts[0], path), {parts.begin() + 1, parts.end()});
    EXPECT_NE(what.find(path), std::string::npos) << what;
    EXPECT_LT(what.find(parts[1]), what.find(path)) << what;
  }
}

namespace {

const Row PLAIN = {80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 50.0, 1.5};
const Row METAL = {80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 50.0, 1.5, 0.004, 12.0, 700.0};

BondMeasures measures_of(int ntypes, const std::vector<std::vector<EVP::BondMeasure>> &table)
{
  BondMeasures measures(ntypes);
  for (int i = 1; i <= ntypes; i++)
    for (int j = i; j <= ntypes; j++) measures.of(i, j) = table[i - 1][j - i];
  return measures;
}

void expect_factors(const EVP::Factors &found, double energies, double gamma, double kv)
{
  constexpr double EPSILON = std::numeric_limits<double>::epsilon();
  EXPECT_NEAR(found.energies, energies, 8 * EPSILON * energies);
  EXPECT_NEAR(found.gamma, gamma, 8 * EPSILON * gamma);
  EXPECT_NEAR(found.kv, kv, 8 * EPSILON * kv);
}

TEST(Seal, ShowsEachChangedBitOfARowAndItComesBack)
{
  EVP::Row row;
  row.e1 = 80.0;
  row.limit_own = 1.0;
  row.rate_rate0 = 1e-3;
  row.flow.n = 2;
  row.flow.p[1] = 0.25;
  row.flow.y[0] = row.flow.y[1] = 1.0;
  std::vector<double> words = EVP::words_of(row);
  ASSERT_EQ(words.size(), (size_t) EVP::ROW_WORDS);
  EXPECT_TRUE(EVP::row_of_words(words.data()) == row);
  EVP::seal(words);
  ASSERT_TRUE(EVP::is_sealed(words.data(), words.size()));
  EXPECT_FALSE(EVP::is_sealed(words.data(), words.size() - 1));
  EXPECT_FALSE(EVP::is_sealed(nullptr, 0));
  for (double &word : words)
    for (int bit = 0; bit < 64; bit++) {
      const double before = word;
      word = EVP::bits_as<double>(EVP::bits_as<uint64_t>(word) ^ uint64_t{1} << bit);
      EXPECT_FALSE(EVP::is_sealed(words.data(), words.size()));
      word = before;
    }
}

}    // namespace

// Rules hold for the numbers as given, and for what becomes of them.
TEST(Scaling, IsOfTheLawsAndNotOfTheRows)
{
  Coefficients coefficients;
  coefficients.resize(1);
  coefficients.set(1, 1, METAL);
  EXPECT_EQ(coefficients.make_law(1, 1), METAL);    // nothing is measured yet
  EXPECT_TRUE(coefficients.set_measures(measures_of(1, {{{0.002, 6.0}}})));
  EXPECT_FALSE(coefficients.set_measures(measures_of(1, {{{0.002, 6.0}}})));
  EXPECT_EQ(coefficients.law(coefficients.index(1, 1)).row, METAL);
  EXPECT_EQ(coefficients.make_law(1, 1).e2, 0.75);
  EXPECT_EQ(coefficients.gamma_elsewhere(coefficients.undamped(coefficients.index(1, 1))), 50.0);
  coefficients.table("e1")[1][1] = -1.0;    // as fix adapt does
  EXPECT_THROW(coefficients.make_law(1, 1), BadInput);
  coefficients.table("e1")[1][1] = 1e150;
  EXPECT_NO_THROW(coefficients.make_law(1, 1));
  coefficients.set_measures(measures_of(1, {{{4e57, 12.0}}}));
  EXPECT_THROW(coefficients.make_law(1, 1), BadInput);
}

TEST(Scaling, OfTypesWithoutBondsIsThatOfTheLikeTypes)
{
  using Source = Coefficients::Source;
  Coefficients coefficients;
  coefficients.resize(3);
  for (int i = 1; i <= 3; i++)
    for (int j = i; j <= 3; j++) coefficients.set(i, j, METAL);
  coefficients.set_measures(measures_of(
      3, {{{0.002, 12.0}, {0.0, 0.0}, {0.0, 0.0}}, {{0.008, 3.0}, {0.0, 0.0}}, {{0.0, 0.0}}}));
  const auto expect = [&](int i, int j, Source source, double energies, double gamma, double kv) {
    SCOPED_TRACE(std::to_string(i) + " " + std::to_string(j));
    for (const auto &found : {coefficients.scaling(i, j), coefficients.scaling(j, i)}) {
      EXPECT_EQ(found.source, source);
      expect_factors(found.factors, energies, gamma, kv);
    }
  };
  expect(1, 1, Source::OWN_BONDS, 0.125, 0.5, 0.125);
  expect(2, 2, Source::OWN_BONDS, 32.0, 8.0, 8.0);
  expect(1, 2, Source::LIKE_TYPES, 2.0, 2.0, 1.0);
  expect(1, 3, Source::LIKE_TYPES, 0.125, 0.5, 0.125);    // of the one that has bonds
  expect(3, 3, Source::AS_GIVEN, 1.0, 1.0, 1.0);

  coefficients.set(1, 2, PLAIN);
  expect(1, 2, Source::AS_GIVEN, 1.0, 1.0, 1.0);
  coefficients.set(2, 2, PLAIN);
  coefficients.set(1, 2, METAL);
  expect(1, 2, Source::LIKE_TYPES, 0.125, 0.5, 0.125);
}
