// SPDX-License-Identifier: GPL-2.0-only
//
// Measures of a body along x from x = 0, as the file FILE.body beside its data file FILE gives them: lines
// `variable NAME index VALUE` in SI units, which are a LAMMPS script too, but are read here as data.
#pragma once

#include "core/row.h"
#include "core/text.h"

#include <array>
#include <cstdint>
#include <string>

namespace EVP {

/// 0 where unknown. A body has a radius (cylinders) or an area (all others), never both, until find_measures() adds
/// the area of a cylinder.
struct BodyMeasures {
  double length;            ///< along x, from x = 0 [m]
  double radius;            ///< of a cylinder about the x axis [m]
  double area;              ///< of the cross-section at mid-length [m2]
  double volume;            ///< [m3]
  double solid_fraction;    ///< volume of the spheres over that of the body
  double density;           ///< of the spheres, for a body that has the mass of its solid [kg/m3]
  double diameter;          ///< estimate of the mean diameter of the spheres [m]; not in files
};

struct MeasureMember {
  const char *key;
  double BodyMeasures::*value;
};

/// What a file may give, in the order in which it is written.
constexpr MeasureMember MEASURES[] = {{"length", &BodyMeasures::length},
                                      {"radius", &BodyMeasures::radius},
                                      {"area", &BodyMeasures::area},
                                      {"volume", &BodyMeasures::volume},
                                      {"solid_fraction", &BodyMeasures::solid_fraction},
                                      {"density", &BodyMeasures::density}};

/// Where the particles are.
struct Centres {
  int64_t count;
  std::array<double, 3> lowest, highest;    ///< coordinates of the centres [m]
  double farthest;                          ///< from the x axis [m]
  double diameter;                          ///< of the largest sphere [m]
};

/// What the particles fill.
struct FilledVolume {
  double whole;     ///< volumes of all spheres [m3]
  double middle;    ///< of those with centres from MIDDLE_FROM to MIDDLE_TO of the length
};
constexpr double MIDDLE_FROM = 0.4, MIDDLE_TO = 0.6;

/// Where the measures come from, for messages.
struct MeasureSource {
  std::string data_file;
  bool is_described;    ///< there is a FILE.body
  bool is_given;        ///< length, radius or area is given beside the file
  std::string body_file() const { return data_file + ".body"; }
};

/// The measures of a FILE.body; throws BadInput that names the line. file is for messages.
BodyMeasures measures_from_text(const std::string &text, const std::string &file);

/// The measures given (0: not given), else those described, else the paper's cylinder, 0.05 x 0.02 m; with the area
/// of a cylinder, and a diameter from the number of particles. Throws BadInput where both a radius and an area
/// are given, one is negative, or a description lacks what is not given.
BodyMeasures find_measures(const BodyMeasures &given, const BodyMeasures &described,
                           const MeasureSource &source, int64_t count);

/// Throws BadInput unless the centres of the particles fit length, and radius or area.
void check_centres(const BodyMeasures &body, const Centres &centres, const MeasureSource &source);

/// Throws BadInput unless the spheres are those of the measures. Adds the volume of a cylinder and the solid fraction
/// of a body whose volume is known, where the file does not give them.
void check_filled_volume(BodyMeasures &body, const FilledVolume &filled,
                         const MeasureSource &source);

}    // namespace EVP
