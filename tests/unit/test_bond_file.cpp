// SPDX-License-Identifier: GPL-2.0-only
//
// The text file of bonds: what is written reads back to the last bit, and what each damage gets.

#include "core/files.h"

#include <gtest/gtest.h>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

using EVP::BadInput;
using EVP::BondLine;
using EVP::BondReader;

namespace {

/// All bonds of a text.
std::vector<BondLine> read_all(const std::string &text, const std::string &file = "body.bonds")
{
  std::istringstream stream(text);
  BondReader reader(stream, file, "si");
  std::vector<BondLine> bonds;
  while (reader.read(bonds, 3)) {}
  return bonds;
}

std::string header(int64_t count)
{
  return EVP::bond_header(count, "si") + "\n";
}

}    // namespace

TEST(BondText, ReadsBackToTheLastBit)
{
  const double third = 1.0 / 3.0, eps = std::numeric_limits<double>::epsilon();
  const std::vector<BondLine> bonds = {{1, 2, third, {0.1 * third, third, 7.0 * third, 0.0}},
                                       {2, 3, 1.0 + eps, {0.0, 0.0, 0.0, 1.0}},
                                       {3, 4, 1.0 - eps / 2.0, {-0.25, 0.5, 1e-300, 0.0}, true},
                                       {7, 999999999999999999, 6.02e23},
                                       {4, 5, 1e-100 * third},
                                       {5, 6, 0.1 + 0.2}};
  for (const bool with_history : {false, true}) {
    std::string text = header((int64_t) bonds.size());
    for (const auto &bond : bonds) text += EVP::bond_text(bond, with_history);
    const std::vector<BondLine> again = read_all(text);
    ASSERT_EQ(again.size(), bonds.size());
    for (size_t k = 0; k < bonds.size(); k++) {
      EXPECT_EQ(again[k].id_i, bonds[k].id_i);
      EXPECT_EQ(again[k].id_j, bonds[k].id_j);
      EXPECT_EQ(again[k].deq, bonds[k].deq) << "17 digits are enough for every double";
      EXPECT_EQ(again[k].has_changed(), with_history && k < 3);
      if (!with_history) continue;
      const auto &found = again[k].history, &history = bonds[k].history;
      EXPECT_NEAR(found.q, history.q, eps * std::fabs(history.q));    // q is a length in the file
      EXPECT_EQ(found.k, history.k);
      EXPECT_EQ(found.work, history.work);
      EXPECT_EQ(found.broken, history.broken);
      EXPECT_EQ(again[k].is_contact, bonds[k].is_contact);
    }
  }
}

TEST(BondReader, SkipsCommentsEmptyLinesAndDosLineEnds)
{
  const auto bonds = read_all("# EVP bonds COUNT: 2 UNITS: si\r\n"
                              "\r\n# a comment\n  1\t2  0.01  # the first\r\n\n2 3 +1E-2\n");
  ASSERT_EQ(bonds.size(), 2u);
  EXPECT_EQ(bonds[0].deq, 0.01);
  EXPECT_EQ(bonds[1].deq, 0.01);
  EXPECT_TRUE(read_all(header(0)).empty()) << "no bonds are as good as any number";
}

// A host program may show the first 99 characters of a message, and a path can be longer: the cause stands first.
TEST(BondReader, NamesLineCauseAndFileOfEachDamage)
{
  const std::string expected = "expected the header '# EVP bonds COUNT: 0 UNITS: si'";
  const std::string path = std::string(300, 'p') + "/body.bonds";
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
      {header(1) + "1 2\n", "line 2: expected 3 or 7 values, got 2",
       "id_i id_j deq q k work broken"},
      {header(1) + "1 2 0.0\r1\n", "line 2: expected 3 or 7 values, got 4"},    // never 0.01
      {header(1) + "0 2 0.01\n", "line 2: id_i must be", "at least 1, got '0'"},
      {header(1) + "1 2.0 0.01\n", "line 2: id_j must be", "got '2.0'"},
      {header(1) + "1 99999999999999999999 0.01\n", "line 2: id_j must be", "at most 18 digits"},
      {header(1) + "1 2 0\n", "line 2: deq must be positive, got 0"},
      {header(1) + "1 2 nan\n", "line 2: deq must be a finite decimal number, got 'nan'"},
      {header(1) + std::string("1 2 0.\0\n", 8), "line 2: deq must be a finite decimal number"},
      {header(1) + "1 2 0.01 inf 0 0 0\n", "line 2: q must be a finite decimal number"},
      {header(1) + "1 2 0.01 0 -1 0 0\n", "line 2: k must be zero or positive, got -1"},
      {header(1) + "1 2 0.01 0 0 1e999 0\n", "line 2: work must be a finite decimal number"},
      {header(1) + "1 2 0.01 0 0 0 3\n",
       "line 2: broken must be 0 (a bond), 1 (a broken bond) or 2"}};
  for (const auto &parts : cases) try {
      read_all(parts[0], path);
      ADD_FAILURE() << "taken: " << parts[0];
    } catch (const BadInput &bad) {
      const std::string what = bad.what();
      for (size_t k = 1; k < parts.size(); k++)
        EXPECT_NE(what.find(parts[k]), std::string::npos) << what << "\nlacks " << parts[k];
      EXPECT_NE(what.find(path), std::string::npos) << what;
      EXPECT_LT(what.find(parts[1]), what.find(path)) << what;
    }
}
