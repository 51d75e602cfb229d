// SPDX-License-Identifier: GPL-2.0-only
//
// The law header against 60-digit arithmetic (tests/data/make_law_reference.py).

#include "core/law.h"
#include "law_cases.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>
#include <string>
#include <vector>

#ifndef EVP_TEST_DATA
#define EVP_TEST_DATA EVP_REPOSITORY "/tests/data"
#endif

using EVP::Law;
using EVP::Row;
using law_cases::energy_scale;
using law_cases::name_of;
using law_cases::REFERENCE;

namespace {

struct Reference {
  Row row;
  double d, deq, dcut;
  int regime;    // 0 where rounding decides
  double force, energy, stiffness;
};

/// The lines of a table, none where one has not so many columns.
std::vector<std::vector<double>> read_table(const std::string &name, size_t columns)
{
  std::vector<std::vector<double>> lines;
  std::ifstream file(std::string(EVP_TEST_DATA) + "/" + name);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream in(line);
    std::vector<double> v;
    for (std::string word; std::getline(in, word, ',');)
      v.push_back(std::strtod(word.c_str(), nullptr));
    if (v.size() != columns) return {};
    lines.push_back(v);
  }
  return lines;
}

std::vector<Reference> read_references()
{
  std::vector<Reference> table;
  for (const auto &v : read_table("law_reference.csv", 14))
    table.push_back({{v[0], v[1], v[2], v[3], v[4], v[5], v[6], 0.0, 1.5},
                     v[7],
                     v[8],
                     v[9],
                     (int) v[10],
                     v[11],
                     v[12],
                     v[13]});
  return table;
}

class LawReference : public testing::Test {
 protected:
  static const std::vector<Reference> &table()
  {
    static const std::vector<Reference> lines = read_references();
    return lines;
  }

  void SetUp() override
  {
    ASSERT_GT(table().size(), 1000u)
        << "no table of 14 columns in " << EVP_TEST_DATA
        << "/law_reference.csv: write it with tests/data/make_law_reference.py";
  }

  static std::string place(const Reference &ref)
  {
    std::ostringstream text;
    text.precision(17);
    text << name_of(ref.row) << ", d = " << ref.d << ", d/deq = " << ref.d / ref.deq;
    return text.str();
  }
};

}    // namespace

TEST_F(LawReference, ForceHoldsToTwelveDigits)
{
  for (const auto &ref : table()) {
    const double scale = std::max(std::fabs(ref.force), energy_scale(ref.row) / ref.deq);
    EXPECT_NEAR(Law(ref.row).force(ref.d, ref.deq), ref.force, REFERENCE * scale) << place(ref);
  }
}

TEST_F(LawReference, EnergyHoldsToTwelveDigits)
{
  for (const auto &ref : table()) {
    const double scale = std::max(std::fabs(ref.energy), energy_scale(ref.row));
    EXPECT_NEAR(Law(ref.row).energy(ref.d, ref.deq, ref.dcut), ref.energy, REFERENCE * scale)
        << place(ref);
  }
}

TEST_F(LawReference, StiffnessHoldsToTwelveDigitsAwayFromItsJump)
{
  for (const auto &ref : table()) {
    if (ref.regime == 0) continue;
    const double at_rest = energy_scale(ref.row) / ref.row.xi_s / (ref.deq * ref.deq);
    const double scale = std::max(std::fabs(ref.stiffness), at_rest);
    EXPECT_NEAR(Law(ref.row).stiffness(ref.d, ref.deq), ref.stiffness, REFERENCE * scale)
        << place(ref);
  }
}

TEST_F(LawReference, RegimeIsTheOneOfEquation8)
{
  for (const auto &ref : table())
    if (ref.regime != 0) {
      EXPECT_EQ(Law(ref.row).regime(ref.d, ref.deq), ref.regime) << place(ref);
    }
}

// Down to strains of one bit of d: nothing is lost but a few roundings, times m/(m - n) of the row.
TEST(StoredReference, HoldsToThirteenDigitsOfItself)
{
  const auto table = read_table("stored_reference.csv", 11);
  ASSERT_GT(table.size(), 1000u) << "write it with tests/data/make_law_reference.py";
  int tiny = 0, second = 0;
  for (const auto &v : table) {
    const Row row = {v[0], v[1], v[2], v[3], v[4], v[5], v[6], 0.0, 1.5};
    const double d = v[7], deq = v[8], true_first = v[9], true_second = v[10];
    const EVP::Stored found = Law(row).stored(d, deq);
    const double rounded = 1e-14 * std::max(row.m1 / (row.m1 - row.n1), row.m2 / (row.m2 - row.n2));
    std::ostringstream place;
    place.precision(17);
    place << name_of(row) << ", d = " << d << ", d/deq - 1 = " << (d - deq) / deq;
    const double stored = true_first + true_second;
    EXPECT_NEAR(found.total(), stored, rounded * stored) << place.str();
    EXPECT_NEAR(found.first, true_first, rounded * true_first) << place.str();
    // which side of a threshold d is on may be a matter of its last bit
    if (std::fabs(std::fabs(d - deq) / (row.xi_s * deq) - 1.0) > 1e-6) {
      EXPECT_NEAR(found.second, true_second, rounded * true_second) << place.str();
    }
    tiny += std::fabs(d - deq) < 2e-10 * deq && stored > 0.0;
    second += found.second > 0.0;
  }
  EXPECT_GT(tiny, 100);
  EXPECT_GT(second, 100);
}
