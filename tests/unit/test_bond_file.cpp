// SPDX-License-Identifier: GPL-2.0-only
//
// The text file of bonds: what is written reads back to the last bit, and what each damage gets.

#include "core/bond_file.h"

#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

using EVP::BadInput;
using EVP::BondLine;
using EVP::BondReader;

namespace {

struct CloseFile {
  void operator()(FILE *stream) const { fclose(stream); }
};
using Stream = std::unique_ptr<FILE, CloseFile>;

Stream stream_of(const std::string &text)
{
  Stream stream(tmpfile());
  EXPECT_EQ(fwrite(text.data(), 1, text.size(), stream.get()), text.size());
  rewind(stream.get());
  return stream;
}

/// All bonds of a text, read in pieces of most.
std::vector<BondLine> read_all(const std::string &text, size_t most = 1000,
                               const std::string &units = "si")
{
  const Stream stream = stream_of(text);
  BondReader reader(stream.get(), "body.bonds", units);
  std::vector<BondLine> bonds;
  while (reader.read(bonds, most)) {}
  return bonds;
}

/// Expects that reading the text throws BadInput, and that what() holds every part.
void expect_refusal(const std::string &text, const std::vector<std::string> &parts,
                    const std::string &units = "si")
{
  SCOPED_TRACE(text.substr(0, 120));
  try {
    read_all(text, 1000, units);
    ADD_FAILURE() << "taken without a word; expected: " << parts.front();
  } catch (const BadInput &bad) {
    for (const auto &part : parts)
      EXPECT_NE(std::string(bad.what()).find(part), std::string::npos)
          << "message: " << bad.what() << "\nlacks:   " << part;
  }
}

std::string header(int64_t count)
{
  return EVP::bond_header(count, "si") + "\n";
}

void expect_bad_line(const std::string &line, const std::vector<std::string> &parts)
{
  std::vector<std::string> all = {"bond file line 2: ", "(file 'body.bonds')"};
  all.insert(all.end(), parts.begin(), parts.end());
  expect_refusal(header(1) + line + "\n", all);
}

}    // namespace

TEST(BondText, ReadsBackToTheLastBit)
{
  const double third = 1.0 / 3.0, eps = std::numeric_limits<double>::epsilon();
  const std::vector<BondLine> bonds = {{1, 2, third},           {2, 3, 1.0 + eps},
                                       {3, 4, 1.0 - eps / 2.0}, {7, 999999999999999999, 6.02e23},
                                       {4, 5, 1e-100 * third},  {5, 6, 0.1 + 0.2}};
  std::string text = header((int64_t) bonds.size());
  for (const auto &bond : bonds) text += EVP::bond_text(bond);

  const std::vector<BondLine> again = read_all(text);
  ASSERT_EQ(again.size(), bonds.size());
  for (size_t k = 0; k < bonds.size(); k++) {
    EXPECT_EQ(again[k].id_i, bonds[k].id_i);
    EXPECT_EQ(again[k].id_j, bonds[k].id_j);
    EXPECT_EQ(again[k].deq, bonds[k].deq) << "17 digits are enough for every double";
  }
}

TEST(BondReader, TellsTheCountBeforeTheBonds)
{
  const Stream stream = stream_of(header(2) + "1 2 0.01\n2 3 0.01\n");
  EXPECT_EQ(BondReader(stream.get(), "body.bonds", "si").count(), 2);
  EXPECT_TRUE(read_all(header(0)).empty()) << "no bonds are as good as any number";
}

TEST(BondReader, SkipsCommentsEmptyLinesAndDosLineEnds)
{
  const auto bonds = read_all("# EVP bonds COUNT: 2 UNITS: si\r\n"
                              "\r\n# a comment\n  1\t2  0.01  # the first\r\n\n2 3 +1E-2\n");
  ASSERT_EQ(bonds.size(), 2u);
  EXPECT_EQ(bonds[0].deq, 0.01);
  EXPECT_EQ(bonds[1].deq, 0.01);
}

// A reader that keeps the whole file would hold a million bonds here; it never holds more than it
// was asked for.
TEST(BondReader, StreamsAMillionLines)
{
  constexpr int64_t COUNT = 1000000;
  constexpr size_t MOST = 4096;
  std::string text = header(COUNT);
  for (int64_t k = 1; k <= COUNT; k++) text += EVP::bond_text({k, k + 1, 0.01 + 1e-9 * (double) k});
  const Stream stream = stream_of(text);
  BondReader reader(stream.get(), "body.bonds", "si");

  std::vector<BondLine> piece;
  int64_t seen = 0;
  for (bool more = true; more;) {
    piece.clear();
    more = reader.read(piece, MOST);
    ASSERT_LE(piece.size(), MOST);
    for (const auto &bond : piece) {
      seen++;
      ASSERT_EQ(bond.id_i, seen);
      ASSERT_EQ(bond.id_j, seen + 1);
      ASSERT_EQ(bond.deq, 0.01 + 1e-9 * (double) seen);
    }
  }
  EXPECT_EQ(seen, COUNT);
}

TEST(BondReader, WantsItsHeader)
{
  const std::string rule = "expected the header '# EVP bonds COUNT: 0 UNITS: si'";
  expect_refusal("", {"the bond file is empty", rule, "body.bonds"});
  for (const std::string text :
       {"1 2 0.01\n", "\n# EVP bonds COUNT: 0 UNITS: si\n", "# EVP bonds UNITS: si COUNT: 0\n",
        "# EVP bonds COUNT: 0\n", "#EVP bonds COUNT: 0 UNITS: si\n", "# LAMMPS data file\n"})
    expect_refusal(text, {"bond file line 1: ", rule});
  expect_refusal("\xEF\xBB\xBF" + header(0), {"bond file line 1: ", "byte-order mark"});
}

TEST(BondReader, HoldsTheFileToItsUnits)
{
  expect_refusal(header(0), {"bond file line 1: ", "in UNITS: si", "'units lj' is in force"}, "lj");
  expect_refusal("# EVP bonds COUNT: 0 UNITS: \n", {"in UNITS: , but 'units si' is in force"});
}

TEST(BondReader, RefusesCountsThatAreNone)
{
  for (const std::string count : {"-1", "1.5", "many", "0x10", "99999999999999999999"})
    expect_refusal("# EVP bonds COUNT: " + count + " UNITS: si\n",
                   {"bond file line 1: COUNT must be", "got '" + count + "'"});
}

TEST(BondReader, RefusesCountsThatLie)
{
  expect_refusal(header(3) + "1 2 0.01\n2 3 0.01\n",
                 {"holds 2 bonds", "header says 3", "incomplete"});
  expect_refusal(header(1) + "1 2 0.01\n2 3 0.01\n",
                 {"line 3: ", "more bonds than the 1 that the header says"});
  expect_refusal(header(999999999999999999) + "1 2 0.01\n", {"holds 1 bonds"});
}

// What had shrunk when the file was written is no fault of the file.
TEST(BondReader, TellsHowManyBondsWereBeyondDlim)
{
  EXPECT_EQ(EVP::bond_header(3, "si"), "# EVP bonds COUNT: 3 UNITS: si");
  const std::string some = EVP::bond_header(3, "si", 2);
  EXPECT_EQ(some, "# EVP bonds COUNT: 3 UNITS: si BEYOND: 2");
  for (const auto &[text, beyond] : {std::pair<std::string, int64_t>{some + "\n", 2},
                                     {header(3), 0},
                                     {EVP::bond_header(3, "si") + " BEYOND: 0\n", 0}})
    EXPECT_EQ(BondReader(stream_of(text).get(), "body.bonds", "si").beyond(), beyond) << text;
  for (const std::string words : {" BEYOND: -1", " BEYOND: some", " BEYOND:"})
    expect_refusal(EVP::bond_header(3, "si") + words + "\n",
                   {"bond file line 1: BEYOND must be a positive integer"});
}

// Versions that do not know the word must not read on.
TEST(BondReader, TellsWhichAtomsWereOneBody)
{
  using EVP::Within;
  const std::string types = EVP::bond_header(3, "si", 2, Within::TYPE);
  EXPECT_EQ(types, "# EVP bonds COUNT: 3 WITHIN: type UNITS: si BEYOND: 2");
  for (const auto &[text, within] :
       {std::pair<std::string, Within>{types, Within::TYPE},
        {EVP::bond_header(3, "si", 0, Within::MOLECULE), Within::MOLECULE},
        {EVP::bond_header(3, "si", 2), Within::ALL}}) {
    const auto stream = stream_of(text + "\n");
    const BondReader reader(stream.get(), "body.bonds", "si");
    EXPECT_EQ(reader.within(), within) << text;
    EXPECT_EQ(reader.count(), 3) << text;
    EXPECT_EQ(reader.beyond(), within == Within::MOLECULE ? 0 : 2) << text;
  }
  for (const std::string word : {"all", "Type", "types", ""})
    expect_refusal("# EVP bonds COUNT: 3 WITHIN: " + word + " UNITS: si\n",
                   {"bond file line 1: within must be type or molecule"});
}

// A host program may show the first 99 characters of a message, and a path can be longer.
TEST(BondReader, NamesTheCauseBeforeTheFile)
{
  const std::string path = std::string(300, 'p') + "/body.bonds";
  for (const std::string text : {"", "1 2 0.01\n", "# EVP bonds COUNT: 2 UNITS: si\n1 2 0.01\n",
                                 "# EVP bonds COUNT: 1 UNITS: si\n1 2 -0.01\n"})
    try {
      const Stream stream = stream_of(text);
      BondReader reader(stream.get(), path, "si");
      std::vector<BondLine> bonds;
      reader.read(bonds, 10);
      ADD_FAILURE() << "taken: " << text;
    } catch (const BadInput &bad) {
      EXPECT_GT(std::string(bad.what()).find(path), std::string(bad.what()).find(": ") + 10);
    }
}

// `0.0101234` cut to `0.01` would be a number as good as any other.
TEST(BondReader, RefusesALastLineWithoutItsEnd)
{
  expect_refusal(header(1) + "1 2 0.01", {"line 2: ", "no line end", "incomplete"});
  expect_refusal("# EVP bonds COUNT: 0 UNITS: si", {"line 1: ", "no line end"});
}

TEST(BondReader, RefusesLinesThatAreNoBond)
{
  expect_bad_line("1 2", {"id_i id_j deq", "expected 3 values, got 2"});
  expect_bad_line("1 2 0.01 0", {"id_i id_j deq", "expected 3 values, got 4"});
  expect_bad_line("1 2 0.0\r1", {"expected 3 values, got 4"});    // never 0.01
  expect_bad_line("1 1 0.01", {"atom 1 is bonded to itself"});
  expect_bad_line("0 2 0.01", {"id_i must be a positive integer, got 0"});
  expect_bad_line("-1 2 0.01", {"id_i must be a positive integer", "'-1'"});
  expect_bad_line("1 2.0 0.01", {"id_j must be a positive integer", "'2.0'"});
  expect_bad_line("one 2 0.01", {"id_i must be a positive integer", "'one'"});
  expect_bad_line("9223372036854775808 2 0.01", {"id_i must be", "at most 18 digits"});
}

TEST(BondReader, RefusesDistancesThatAreNone)
{
  expect_bad_line("1 2 0", {"deq must be positive, got 0"});
  expect_bad_line("1 2 -0.01", {"deq must be positive, got -0.01"});
  for (const std::string word : {"nan", "inf", "1e400", "0,01", "0x1p-6", "0.01m"})
    expect_bad_line("1 2 " + word, {"deq must be a finite decimal number", "'" + word + "'"});
  // 1/deq^2 is what stiffness and step are made of
  for (const std::string word : {"1e-310", "1e-200"})
    expect_bad_line("1 2 " + word, {"too small to be a distance", word});
}

TEST(BondReader, RefusesWhatIsNoText)
{
  expect_bad_line(std::string("1 2\0 0.01", 9), {"not a text file", "NUL"});
  expect_bad_line("1 2 0.01" + std::string(300, ' '), {"longer than 256 characters"});
  expect_bad_line("\x80\xff 2 0.01", {"id_i must be", "got '\?\?'"});
}

TEST(BondReader, NamesTheLineOfALateFault)
{
  std::string text = header(1000);
  for (int k = 1; k < 1000; k++) text += "1 " + std::to_string(k + 1) + " 0.01\n";
  expect_refusal(text + "1 1001 O.01\n", {"bond file line 1001: deq", "'O.01'"});
}

// Opening a folder succeeds, reading it does not.
TEST(BondReader, RefusesAFolder)
{
  const Stream folder(fopen(".", "rb"));
  ASSERT_TRUE(folder);
  EXPECT_THROW(
      {
        try {
          BondReader(folder.get(), "body.bonds", "si");
        } catch (const BadInput &bad) {
          EXPECT_STREQ(bad.what(),
                       "the bond file cannot be read: is it a file of text? (file 'body.bonds')");
          throw;
        }
      },
      BadInput);
}
