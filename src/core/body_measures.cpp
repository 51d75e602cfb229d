// SPDX-License-Identifier: GPL-2.0-only

#include "core/body_measures.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace EVP {

namespace {
  constexpr double PI = 3.14159265358979323846;
  constexpr double PAPER_LENGTH = 0.05, PAPER_RADIUS = 0.02;    // [m]
  constexpr double PACKED = 0.6;                                // about what random packings fill
  constexpr double BEYOND = 1e-6;    // of length or radius, for round-off of data files
  constexpr double ROUGH_AREA = 1.05, ROUGH_VOLUME = 0.02;
  constexpr double LEAST_FILLED = 0.3;

  /// Of 15 digits, as formulas of an input script take the value of another formula: so that decks that computed
  /// these numbers themselves keep their bits.
  double in_formula(double value)
  {
    return std::strtod(rounded(value, 15).c_str(), nullptr);
  }

  std::string interval(double from, double to)
  {
    return "from " + rounded(from, 4) + " to " + rounded(to, 4);
  }

  std::string remedy(const MeasureSource &source)
  {
    if (source.is_given) return "correct the given length, radius or area";
    if (source.is_described)
      return "make " + source.data_file + " and " + source.body_file() + " again";
    return "there is no " + source.body_file() + ": give length, and radius or area";
  }

  void parse_line(const std::vector<std::string> &words, BodyMeasures &measures)
  {
    if (words.size() != 4 || words[0] != "variable" || words[2] != "index") {
      std::string line;
      for (const std::string &word : words) line += (line.empty() ? "" : " ") + word;
      throw BadInput("expected 'variable NAME index VALUE', got '" + shown(line) + "'");
    }
    const MeasureMember *const member = find_entry(MEASURES, words[1]);
    if (!member)
      throw BadInput("unknown dimension '" + shown(words[1]) + "': a body may have " +
                     keys_of(MEASURES, std::end(MEASURES), ", "));
    const double value = parse_number(member->key, words[3]);
    if (!(value > 0.0))
      throw BadInput(std::string(member->key) + " must be positive, got " + shown(words[3]));
    if (member->value == &BodyMeasures::solid_fraction && value > 1.0)
      throw BadInput("solid_fraction must not exceed 1, got " + shown(words[3]));
    if (std::exchange(measures.*member->value, value) != 0.0)
      throw BadInput(std::string(member->key) + " is given twice");
    if (measures.radius > 0.0 && measures.area > 0.0)
      throw BadInput("radius and area are both given: a cylinder has a radius, any other body an "
                     "area");
  }
}    // namespace

BodyMeasures measures_from_text(const std::string &text, const std::string &file)
{
  BodyMeasures measures{};
  std::istringstream in(text);
  std::string line;
  for (int number = 1; std::getline(in, line); number++) {
    const std::vector<std::string> words = split_words(line);
    if (words.empty()) continue;
    try {
      // half a number may be a number too
      if (in.eof())
        throw BadInput(
            "the last line has no line end: the file is incomplete, or add the line end");
      parse_line(words, measures);
    } catch (const BadInput &bad) {
      throw BadInput("file " + file + " line " + std::to_string(number) + ": " + bad.what());
    }
  }
  return measures;
}

BodyMeasures find_measures(const BodyMeasures &given, const BodyMeasures &described,
                           const MeasureSource &source, int64_t count)
{
  for (const MeasureMember &member : MEASURES)
    if (given.*member.value < 0.0)
      throw BadInput(std::string(member.key) +
                     " must be positive, or 0 where it is not given, got " +
                     shortest_text(given.*member.value));
  if (given.radius > 0.0 && given.area > 0.0)
    throw BadInput("radius and area are both given: give radius for a cylinder, area for any other "
                   "body");
  if (count == 0) throw BadInput("there are no atoms: use the command after read_data");

  BodyMeasures body = described;
  if (given.length > 0.0) body.length = given.length;
  if (given.radius > 0.0 || given.area > 0.0) {
    body.radius = given.radius;
    body.area = given.area;
  }
  const bool has_section = body.radius > 0.0 || body.area > 0.0;
  if (source.is_described && !(body.length > 0.0 && has_section))
    throw BadInput(
        "file " + source.body_file() + " has no " +
        (has_section ? "length" : "radius (of a cylinder) and no area (of any other body)") + ": " +
        remedy({source.data_file, true, false}));
  if (!(body.length > 0.0)) body.length = PAPER_LENGTH;
  if (!has_section) body.radius = PAPER_RADIUS;

  double packed = in_formula(PACKED * PI * std::pow(body.radius, 2.0) * body.length);
  if (body.radius > 0.0)
    body.area = in_formula(PI * std::pow(body.radius, 2.0));
  else
    packed =
        in_formula(body.volume > 0.0 ? PACKED * body.volume : PACKED * body.area * body.length);
  body.diameter = in_formula(2.0 * std::pow(packed / ((double) count * 4.0 / 3.0 * PI), 1.0 / 3.0));
  return body;
}

void check_centres(const BodyMeasures &body, const Centres &centres, const MeasureSource &source)
{
  const auto &low = centres.lowest, &high = centres.highest;
  // a lattice leaves up to a layer more free
  const double near = source.is_described ? 2.0 * centres.diameter : centres.diameter;
  const double slack = BEYOND * body.length;
  const bool fits_length = low[0] >= -slack && low[0] <= near && high[0] <= body.length + slack &&
      high[0] >= body.length - near;
  if (!fits_length)
    throw BadInput("the centers lie " + interval(low[0], high[0]) +
                   " m along x, not from 0 to length = " + rounded(body.length, 6) + " m; " +
                   remedy(source));

  const std::string wide = "the centers have y " + interval(low[1], high[1]) + " m and z " +
      interval(low[2], high[2]) + " m, ";
  if (body.radius > 0.0) {
    const double core = std::max(body.radius - near, 0.0) + BEYOND * body.radius;
    if (!(centres.farthest <= (1.0 + BEYOND) * body.radius && centres.farthest > core))
      throw BadInput(wide + "which is no cylinder of radius " + rounded(body.radius, 6) +
                     " m about the x axis; " + remedy(source));
  } else {
    const double box =
        (high[1] - low[1] + centres.diameter) * (high[2] - low[2] + centres.diameter);
    if (!(body.area <= ROUGH_AREA * box))
      throw BadInput(wide + "too little for area = " + rounded(body.area, 6) + " m2; " +
                     remedy(source));
  }
}

void check_filled_volume(BodyMeasures &body, const FilledVolume &filled,
                         const MeasureSource &source)
{
  const bool
      of_file =    // whose area may be that of a notch, then, less than the mean of the middle
      source.is_described && !source.is_given && body.volume > 0.0 && body.solid_fraction > 0.0;
  if (!(body.volume > 0.0) && body.radius > 0.0) body.volume = body.area * body.length;
  if (!(body.solid_fraction > 0.0)) {
    if (body.volume > 0.0) body.solid_fraction = filled.whole / body.volume;
  } else if (body.volume > 0.0) {
    const double claimed = body.volume * body.solid_fraction;
    if (!(std::abs(filled.whole / claimed - 1.0) <= ROUGH_VOLUME))
      throw BadInput(source.body_file() + " is of another body: the spheres have " +
                     rounded(filled.whole, 4) + " m3, it says " + rounded(claimed, 4) +
                     " m3; make both again, or remove " + source.body_file() +
                     " and give length, and radius or area");
  }
  const double share = filled.middle / ((MIDDLE_TO - MIDDLE_FROM) * body.length * body.area);
  if (!(share >= LEAST_FILLED && (share <= 1.0 || of_file)))
    throw BadInput("between " + rounded(MIDDLE_FROM, 2) + " and " + rounded(MIDDLE_TO, 2) +
                   " of the length the spheres fill " + rounded(share, 3) +
                   " of area = " + rounded(body.area, 6) + " m2 times length; " + remedy(source));
}

}    // namespace EVP
