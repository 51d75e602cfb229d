// SPDX-License-Identifier: GPL-2.0-only
//
// Measures of a body: what its file may say, what is taken where it says nothing, and which bodies they fit.

#include "core/body_measures.h"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vector>

using EVP::BadInput;
using EVP::BodyMeasures;
using EVP::Centres;
using EVP::MeasureSource;

namespace {

const std::string CYLINDER = "# dimensions of the body in part.data\n"
                             "variable length index 0.06            # [m] along x, from x = 0\n"
                             "variable radius index 0.018\n"
                             "\n"
                             "variable volume index 6.1e-05 # [m3]\n"
                             "variable solid_fraction index 0.59\n"
                             "variable density index 4538.8\n";
constexpr double PI = 3.14159265358979323846;

const MeasureSource DESCRIBED = {"part.data", true, false}, GIVEN = {"part.data", false, true},
                    NOTHING = {"part.data", false, false};

/// {length, radius, area} and nothing else.
BodyMeasures shape(double length, double radius, double area)
{
  return {length, radius, area, 0.0, 0.0, 0.0, 0.0};
}

BodyMeasures read(const std::string &text)
{
  return EVP::measures_from_text(text, "part.data.body");
}

void expect_refusal(const std::function<void()> &action, const std::vector<std::string> &parts)
{
  SCOPED_TRACE(parts.front());
  try {
    action();
    ADD_FAILURE() << "taken without a word";
  } catch (const BadInput &bad) {
    for (const auto &part : parts)
      EXPECT_NE(std::string(bad.what()).find(part), std::string::npos)
          << "message: " << bad.what() << "\nlacks:   " << part;
  }
}

void expect_bad_line(const std::string &line, const std::vector<std::string> &parts)
{
  std::vector<std::string> all = {"file part.data.body line 3: "};
  all.insert(all.end(), parts.begin(), parts.end());
  expect_refusal(
      [&] {
        read("# body\nvariable length index 0.06\n" + line + "\n");
      },
      all);
}

/// Centres of a cylinder 0.06 x 0.018 m that just fits, of spheres of 4 mm.
Centres centres_of_cylinder()
{
  return {800, {0.002, -0.016, -0.0158}, {0.058, 0.0159, 0.016}, 0.016, 0.0044};
}

}    // namespace

TEST(BodyFile, IsRead)
{
  const BodyMeasures body = read(CYLINDER);
  EXPECT_EQ(body.length, 0.06);
  EXPECT_EQ(body.radius, 0.018);
  EXPECT_EQ(body.area, 0.0);
  EXPECT_EQ(body.volume, 6.1e-05);
  EXPECT_EQ(body.solid_fraction, 0.59);
  EXPECT_EQ(body.density, 4538.8);
}

TEST(BodyFile, MayHaveLineEndsOfWindows)
{
  std::string text;
  for (const char c : CYLINDER) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(read(text).density, 4538.8);
}

TEST(BodyFile, EmptySaysNothing)
{
  EXPECT_EQ(read("").length, 0.0);
  EXPECT_EQ(read("# nothing, and no line end").length, 0.0);
}

TEST(BodyFile, DamagedLinesAreNamed)
{
  const std::string form = "expected 'variable NAME index VALUE', got ";
  expect_bad_line("variable radius equal 0.018", {form + "'variable radius equal 0.018'"});
  expect_bad_line("variable radius index", {form});
  expect_bad_line("variable radius index 0.018 0.02", {form});
  expect_bad_line("shell rm -r *", {form + "'shell rm -r *'"});
  expect_bad_line("variable radius index 0,018",
                  {"radius must be a finite decimal number, got '0,018'"});
  expect_bad_line("variable radius index nan", {"radius must be a finite decimal number"});
  expect_bad_line("variable radius index -0.018", {"radius must be positive, got -0.018"});
  expect_bad_line("variable radius index 0", {"radius must be positive, got 0"});
  expect_bad_line("variable solid_fraction index 1.2",
                  {"solid_fraction must not exceed 1, got 1.2"});
  expect_bad_line("variable lenght index 0.06",
                  {"unknown dimension 'lenght': a body may have length, radius, area, volume, "
                   "solid_fraction, density"});
  expect_bad_line("variable diameter index 0.004", {"unknown dimension 'diameter'"});
  expect_bad_line("variable length index 0.06", {"length is given twice"});
  expect_refusal(
      [] {
        read(CYLINDER + "variable area index 0.001\n");
      },
      {"line 8: radius and area are both given"});
}

TEST(BodyFile, DamagedFilesAreNamed)
{
  expect_refusal(
      [] {
        read(CYLINDER.substr(0, CYLINDER.size() - 4));
      },
      {"line 7: the last line has no line end"});
}

TEST(BodyMeasures, GivenBeforeDescribedBeforeThePapers)
{
  const BodyMeasures described = read(CYLINDER);
  const BodyMeasures paper = EVP::find_measures({}, {}, NOTHING, 500);
  EXPECT_EQ(paper.length, 0.05);
  EXPECT_EQ(paper.radius, 0.02);
  const BodyMeasures file = EVP::find_measures({}, described, DESCRIBED, 800);
  EXPECT_EQ(file.length, 0.06);
  EXPECT_EQ(file.radius, 0.018);
  const BodyMeasures both =
      EVP::find_measures(shape(0.07, 0, 0), described, {"part.data", true, true}, 800);
  EXPECT_EQ(both.length, 0.07);
  EXPECT_EQ(both.radius, 0.018);
  const BodyMeasures other =
      EVP::find_measures(shape(0, 0, 0.001), described, {"part.data", true, true}, 800);
  EXPECT_EQ(other.length, 0.06);
  EXPECT_EQ(other.radius, 0.0) << "a given area makes a cylinder another body";
  EXPECT_EQ(other.area, 0.001);
}

TEST(BodyMeasures, AreaAndDiameterFollow)
{
  const BodyMeasures paper = EVP::find_measures({}, {}, NOTHING, 500);
  EXPECT_NEAR(paper.area / (PI * 0.0004), 1.0, 1e-14);
  // spheres of this diameter fill 0.6 of the body
  const auto filled = [](const BodyMeasures &body, int n) {
    return n * PI / 6.0 * std::pow(body.diameter, 3.0);
  };
  EXPECT_NEAR(filled(paper, 500) / (0.6 * PI * 0.0004 * 0.05), 1.0, 1e-13);
  EXPECT_NEAR(filled(EVP::find_measures(shape(0.05, 0, 6e-4), {}, GIVEN, 600), 600) / (0.6 * 3e-5),
              1.0, 1e-13);
  BodyMeasures bone = shape(0.05, 0, 6e-4);
  bone.volume = 5e-5;
  EXPECT_NEAR(filled(EVP::find_measures({}, bone, DESCRIBED, 600), 600) / (0.6 * 5e-5), 1.0, 1e-13);
}

TEST(BodyMeasures, WhatCannotBeIsRefused)
{
  const auto find = [](const BodyMeasures &given, const BodyMeasures &described,
                       const MeasureSource &source, int count = 500) {
    return [=] {
      EVP::find_measures(given, described, source, count);
    };
  };
  expect_refusal(find(shape(-1, 0, 0), {}, GIVEN),
                 {"length must be positive, or 0 where it is not given, got -1"});
  expect_refusal(find(shape(0, 0.02, 0.001), {}, GIVEN),
                 {"radius and area are both given: give radius for a cylinder"});
  expect_refusal(find({}, {}, NOTHING, 0), {"there are no atoms"});
  expect_refusal(find({}, shape(0, 0.02, 0), DESCRIBED),
                 {"file part.data.body has no length: make part.data and part.data.body again"});
  expect_refusal(find({}, shape(0.05, 0, 0), DESCRIBED),
                 {"has no radius (of a cylinder) and no area (of any other body)"});
  find(shape(0.05, 0, 0), shape(0, 0.02, 0), {"part.data", true, true})();
}

TEST(BodyMeasures, CentresMustFit)
{
  const auto check = [](const BodyMeasures &given, const MeasureSource &source,
                        const std::function<void(Centres &)> &change) {
    return [=] {
      Centres centres = centres_of_cylinder();
      change(centres);
      const BodyMeasures none{};
      EVP::check_centres(EVP::find_measures(source.is_described ? none : given,
                                            source.is_described ? given : none, source,
                                            centres.count),
                         centres, source);
    };
  };
  const auto none = [](Centres &) {
  };
  const BodyMeasures cylinder = shape(0.06, 0.018, 0), bar = shape(0.06, 0, 1.1e-3);
  check(cylinder, GIVEN, none)();
  check(bar, GIVEN, none)();

  expect_refusal(check(shape(0.07, 0.018, 0), GIVEN, none),
                 {"the centers lie from 0.002 to 0.058 m along x, not from 0 to length = 0.07 m; "
                  "correct the given length, radius or area"});
  expect_refusal(check(shape(0.0579, 0.018, 0), GIVEN, none), {"not from 0 to length = 0.0579 m"});
  const std::vector<std::function<void(Centres &)>> moved = {[](Centres &c) {
                                                               c.lowest[0] = -0.001;
                                                             },
                                                             [](Centres &c) {
                                                               c.lowest[0] = 0.01;
                                                             },
                                                             [](Centres &c) {
                                                               c.highest[0] = 0.05;
                                                             },
                                                             [](Centres &c) {
                                                               c.highest[0] = 0.061;
                                                             }};
  for (const auto &change : moved)
    expect_refusal(check(cylinder, DESCRIBED, change),
                   {"m along x", "make part.data and part.data.body again"});
  expect_refusal(check(shape(0.06, 0.0159, 0), GIVEN, none),
                 {"the centers have y from -0.016 to 0.0159 m and z from -0.0158 to 0.016 m, which "
                  "is no cylinder of radius 0.0159 m about the x axis"});
  expect_refusal(check(shape(0.06, 0.024, 0), GIVEN, none), {"no cylinder of radius 0.024 m"});
  expect_refusal(check(shape(0.06, 0, 1.6e-3), GIVEN, none), {"too little for area = 0.0016 m2"});
  // given measures that are far off do not widen what fits
  expect_refusal(check(shape(0.065, 0.1, 0), GIVEN, none), {"not from 0 to length = 0.065 m"});
  expect_refusal(check({}, NOTHING, none),
                 {"not from 0 to length = 0.05 m",
                  "there is no part.data.body: give length, and radius or area"});
}

TEST(BodyMeasures, ALatticeMayLeaveALayerMoreFree)
{
  Centres centres = centres_of_cylinder();
  centres.lowest[0] = 0.0055;
  const BodyMeasures described =
      EVP::find_measures({}, shape(0.06, 0.018, 0), DESCRIBED, centres.count);
  EXPECT_GT(centres.lowest[0], centres.diameter) << "control";
  EVP::check_centres(described, centres, DESCRIBED);
  EXPECT_THROW(EVP::check_centres(described, centres, GIVEN), BadInput);
}

TEST(BodyMeasures, SpheresMustBeThoseOfTheMeasures)
{
  const BodyMeasures described = EVP::find_measures({}, read(CYLINDER), DESCRIBED, 800);
  const double whole = 6.1e-5 * 0.59, middle = 0.2 * whole;
  const auto check = [](BodyMeasures body, double whole_in, double middle_in,
                        const MeasureSource &source) {
    EVP::check_filled_volume(body, {whole_in, middle_in}, source);
    return body;
  };
  EXPECT_EQ(check(described, 1.01 * whole, middle, DESCRIBED).solid_fraction, 0.59);
  for (const double share : {0.97, 1.03})
    expect_refusal(
        [&] {
          check(described, share * whole, middle, DESCRIBED);
        },
        {"part.data.body is of another body: the spheres have ", "it says 3.599e-05 m3",
         "or remove part.data.body and give length, and radius or area"});

  // a cylinder has a volume without a file, any other body has not
  const BodyMeasures cylinder = EVP::find_measures(shape(0.06, 0.018, 0), {}, GIVEN, 800);
  const BodyMeasures known = check(cylinder, whole, middle, GIVEN);
  EXPECT_NEAR(known.volume / (PI * 0.018 * 0.018 * 0.06), 1.0, 1e-13);
  EXPECT_NEAR(known.solid_fraction * known.volume / whole, 1.0, 1e-13);
  const BodyMeasures bar = EVP::find_measures(shape(0.06, 0, 1e-3), {}, GIVEN, 800);
  EXPECT_EQ(check(bar, whole, middle, GIVEN).solid_fraction, 0.0);
  EXPECT_EQ(check(bar, whole, middle, GIVEN).volume, 0.0);
  BodyMeasures bone = bar;
  bone.volume = 6.3e-5;
  EXPECT_NEAR(check(bone, whole, middle, GIVEN).solid_fraction * 6.3e-5 / whole, 1.0, 1e-13);

  for (const double share : {0.29, 1.01})
    expect_refusal(
        [&] {
          check(bar, whole, share * 0.2 * 0.06 * 1e-3, GIVEN);
        },
        {"between 0.4 and 0.6 of the length the spheres fill ",
         "of area = 0.001 m2 times length; "});
}

TEST(BodyMeasures, ANotchAtMidLengthMayFillMoreThanItsAreaTimesLength)
{
  const auto check = [](const std::string &lines, const MeasureSource &source) {
    BodyMeasures body = EVP::find_measures({}, read(lines), source, 800);
    EVP::check_filled_volume(body, {6e-6, 1.1 * 0.2 * 0.05 * 1e-4}, source);
  };
  const std::string shape_lines = "variable length index 0.05\nvariable area index 1e-4\n";
  const std::string whole =
      shape_lines + "variable volume index 1e-5\nvariable solid_fraction index 0.6\n";
  check(whole, DESCRIBED);
  MeasureSource changed = DESCRIBED;
  changed.is_given = true;
  EXPECT_THROW(check(whole, changed), BadInput);
  EXPECT_THROW(check(shape_lines, DESCRIBED), BadInput);
}
