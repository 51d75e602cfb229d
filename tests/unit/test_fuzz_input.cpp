// SPDX-License-Identifier: GPL-2.0-only
//
// Random damage to parameter files and bond files: whatever the bytes, the outcome is a checked value
// or a BadInput whose text a terminal can show.

#include "core/bonds/bond_file.h"
#include "core/law/row_text.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <sstream>
#include <string>
#include <vector>

using EVP::BadInput;

namespace {

constexpr int TEXTS = 20000;    // of each kind of file
constexpr size_t LONGEST_MESSAGE = 1500;

/// Of a text with bars between them.
std::vector<std::string> parts_of(const std::string &text)
{
  std::istringstream stream(text);
  std::vector<std::string> parts;
  for (std::string part; std::getline(stream, part, '|');) parts.push_back(part);
  return parts;
}

/// Makes a bad text of a good one.
class Vandal {
 public:
  size_t below(size_t n) { return n ? std::uniform_int_distribution<size_t>(0, n - 1)(random) : 0; }

  std::string damage(std::string text)
  {
    for (size_t k = below(4); k > 0 || below(8) == 0; k = k ? k - 1 : 0) damage_once(text);
    return text;
  }

 private:
  std::mt19937_64 random{20170515};

  const std::string &any(const std::vector<std::string> &list) { return list[below(list.size())]; }

  void damage_once(std::string &text)
  {
    static const std::vector<std::string> words = parts_of(
        "nan|-nan|inf|1e400|1e-400|-0|0|1e308|4.9e-324|1e-160|-1|0x1p3|1.5.2|--1|1e|e1|+|.|200|201|"
        "0.999999999999999999|1.0000000000000002|99999999999999999999|18446744073709551616|"
        "\xEF\xBB\xBF|\r\n|\r|\n\n|#|COUNT:|UNITS:|UNITS: lj|# EVP bonds COUNT: 2 UNITS: "
        "si\n|\t|\v| |%s%n|{}");
    const size_t at = below(text.size() + 1);
    const size_t kind = below(9);
    if (kind == 0)
      text.resize(at);
    else if (kind == 1)
      text.insert(at, any(words));
    else if (kind == 2)
      text.insert(at, 1, (char) below(256));
    else if (kind == 3)
      text.erase(at, 1 + below(20));
    else if (kind == 4)
      text.insert(at, text.substr(below(text.size() + 1), below(80)));
    else if (kind == 5 && at < text.size())
      text[at] ^= (char) (1u << below(8));
    else if (kind == 6)
      text.insert(at, below(400), "0123456789. a\n"[below(14)]);
    else if (kind == 7)
      replace_word(text, at, any(words));
    else if (kind == 8)
      std::swap_ranges(text.begin(), text.begin() + (long) (at / 2),
                       text.begin() + (long) (at - at / 2));
  }

  static void replace_word(std::string &text, size_t at, const std::string &word)
  {
    const std::string blank = " \t\n";
    const size_t first = text.find_first_not_of(blank, at);
    if (first == std::string::npos) return;
    text.replace(first, text.find_first_of(blank, first) - first, word);
  }
};

/// Calls one(text) on damaged texts; counts what becomes of them.
template <class F> void fuzz(const std::string &good, F one)
{
  Vandal vandal;
  size_t taken = 0, refused = 0;
  for (int k = 0; k < TEXTS; k++) {
    const std::string text = vandal.damage(good);
    SCOPED_TRACE("text:\n" + text);
    try {
      one(text, vandal);
      taken++;
    } catch (const BadInput &bad) {
      refused++;
      const std::string what = bad.what();
      const bool printable = std::all_of(what.begin(), what.end(), [](char c) {
        return c >= ' ' && c <= '~';
      });
      EXPECT_TRUE(!what.empty() && what.size() < LONGEST_MESSAGE && printable) << what;
    } catch (const std::exception &other) {
      ADD_FAILURE() << "neither a value nor BadInput: " << other.what();
    }
    if (testing::Test::HasFailure()) return;
  }
  // a fuzzer that only ever sees one outcome tests nothing
  EXPECT_GT(taken, 20u);
  EXPECT_GT(refused, 200u);
}

}    // namespace

TEST(Fuzz, ParameterFileGivesALawOrARefusal)
{
  const std::string good =
      "# DATE: 2017-05-15 UNITS: si CITATION: hal-01899324\n"
      "# name e1 m1 n1 e2 m2 n2 xi_s gamma alpha\n\n"
      "table1 80 8 4 3 8 4 0.005 0 1.5\n"
      "table2 80 8 4 3 7.5 3.2 0.005 1000 1.5 # damped\n"
      "soft 0 2 1 1e-3 12 6 0.1 0 2\n"
      "metal 80 8 4 3 8 4 0.005 0 1.5 spacing 4.42e-3 coordination 11.9 kv 1e3 density 2700\n"
      "steel 80 8 4 3 8 4 0.005 0 1.5 kv 1e3 flow 0 1 0.1 1.5 0.3 1.2\n";
  const std::vector<std::string> names = {"table1", "table2", "soft", "metal",
                                          "steel",  "absent", ""};
  fuzz(good, [&](const std::string &text, Vandal &vandal) {
    const EVP::Row row =
        EVP::row_from_text(text, "fuzz.evp", names[vandal.below(names.size())], "si");
    EXPECT_EQ(row.spacing > 0.0, row.coordination > 0.0);
    const EVP::PairLaw law(row);
    for (const double r : {0.7, 1.0 - row.xi_s, 1.0, 1.0 + row.xi_s, row.alpha}) {
      const EVP::PairState now = law.state(r, {100.0});
      const double values[] = {now.force, now.stiffness, now.stored.total()};
      for (const double value : values) EXPECT_TRUE(std::isfinite(value)) << "at r = " << r;
    }
    EXPECT_GE(law.state(1.0, {100.0}).stiffness, 0.0);
    EXPECT_GE(row.gamma, 0.0);
  });
}

TEST(Fuzz, BondFileGivesBondsOrARefusal)
{
  const std::string columns = "plastic_strain,plastic_work,slip,bonds,recorded,given_strain";
  std::string good =
      EVP::bond_header({4, EVP::BodyRule::ALL, 0.0, 2, 1, {3, 2}, {}, {}, columns}, "si") +
      "\nsphere 3 0.5 0.1 0 12 13 -1\n";
  for (int k = 1; k <= 6; k++)
    good += EVP::bond_text({k, k + 1, 0.01 * (1.0 + k / 7.0), k > 4 ? k % 2 : EVP::BondLine::BOND});
  fuzz(good, [&](const std::string &text, Vandal &vandal) {
    std::istringstream stream(text);
    EVP::BondReader reader(stream, "fuzz.bonds", "si");
    const size_t most = 1 + vandal.below(8);
    std::vector<EVP::BondLine> bonds;
    std::vector<EVP::SphereLine> spheres;
    const auto lines = [&] {
      return bonds.size() + spheres.size();
    };
    for (size_t before = 0; reader.read(bonds, spheres, most); before = lines())
      EXPECT_EQ(lines(), before + most);
    for (const auto &line : bonds) {
      EXPECT_TRUE(line.id > 0 && line.bond.partner > 0);
      EXPECT_TRUE(line.bond.deq > 0.0 && std::isfinite(line.bond.deq)) << line.bond.deq;
    }
    for (const auto &sphere : spheres)
      for (const double value : sphere.values) EXPECT_TRUE(sphere.id > 0 && std::isfinite(value));
  });
}
