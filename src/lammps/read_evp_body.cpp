// SPDX-License-Identifier: GPL-2.0-only

#include "read_evp_body.h"

#include "collective.h"
#include "prefixed_variables.h"
#include "user_input.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "math_const.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using EVP::BadInput;
using EVP::Reading;

static constexpr int MAX_FILE_SIZE = 1 << 16;

void ReadEVPBody::command(int narg, char **arg)
{
  const std::string who = "read_evp_body";
  if (narg < 2)
    error->all(FLERR,
               "read_evp_body: expected a data file and the prefix of the variables, got {} "
               "argument{}",
               narg, narg == 1 ? "" : "s");
  const EVP::PrefixedVariables variables(lmp, who, arg[1]);
  EVP::BodyMeasures given{};
  EVP::for_each_keyword(error, who, narg - 2, arg + 2, {"length", "radius", "area"}, ", ",
                        [&](const EVP::Keyword &word) {
                          for (const EVP::MeasureMember &member : EVP::MEASURES)
                            if (word.is(member.key)) given.*member.value = word.number();
                        });

  if (!domain->box_exist) error->all(FLERR, "read_evp_body: use the command after read_data");
  if (strcmp(update->unit_style, "si") != 0)
    error->all(FLERR,
               "read_evp_body: dimensions of bodies are in SI units, but 'units {}' is in force",
               update->unit_style);
  if (!atom->radius_flag)
    error->all(FLERR, "read_evp_body needs particles with a radius: use 'atom_style sphere'");

  EVP::BodyMeasures body;
  EVP::MeasureSource source = {arg[0], false,
                               given.length != 0.0 || given.radius != 0.0 || given.area != 0.0};
  EVP::stop_at_bad_input(error, who, [&] {
    const EVP::BodyMeasures described = read_description(source);
    const EVP::Centres centres = find_centres();
    body = EVP::find_measures(given, described, source, centres.count);
    EVP::check_centres(body, centres, source);
    EVP::check_filled_volume(body, sum_spheres(body.length), source);
  });

  for (const EVP::MeasureMember &member : EVP::MEASURES)
    variables.set(member.key, body.*member.value);
  variables.set("diameter", body.diameter);
  report(body, source);
}

EVP::BodyMeasures ReadEVPBody::read_description(EVP::MeasureSource &source) const
{
  const std::string file = source.body_file();
  std::string text;
  switch (EVP::read_text(file, MAX_FILE_SIZE, text, world)) {
    case Reading::MISSING:
      return {};
    case Reading::FAILED:
      throw BadInput("cannot read " + file + ": check its permissions");
    case Reading::TOO_LARGE:
      throw BadInput("file " + file + " is larger than 64 KiB: not the dimensions of a body");
    case Reading::DONE:
      break;
  }
  source.is_described = true;
  return EVP::measures_from_text(text, file);
}

EVP::Centres ReadEVPBody::find_centres() const
{
  constexpr double FAR = std::numeric_limits<double>::max();
  // of -x, -y, -z, x, y, z, the distance from the axis squared and the radius
  std::array<double, 8> most;
  most.fill(-FAR);
  for (int i = 0; i < atom->nlocal; i++) {
    const double *x = atom->x[i];
    for (int k = 0; k < 3; k++) {
      most[k] = std::max(most[k], -x[k]);
      most[k + 3] = std::max(most[k + 3], x[k]);
    }
    most[6] = std::max(most[6], x[1] * x[1] + x[2] * x[2]);
    most[7] = std::max(most[7], atom->radius[i]);
  }
  most = EVP::reduce_all(most, MPI_MAX, world);
  const bigint count = EVP::reduce_all((bigint) atom->nlocal, MPI_SUM, world);
  return {count,
          {-most[0], -most[1], -most[2]},
          {most[3], most[4], most[5]},
          std::sqrt(std::max(most[6], 0.0)),
          2.0 * most[7]};
}

EVP::FilledVolume ReadEVPBody::sum_spheres(double length) const
{
  std::array<double, 2> sums{};
  for (int i = 0; i < atom->nlocal; i++) {
    const double x = atom->x[i][0], radius = atom->radius[i];
    const double ball = MathConst::MY_4PI3 * radius * radius * radius;
    sums[0] += ball;
    if (x > EVP::MIDDLE_FROM * length && x < EVP::MIDDLE_TO * length) sums[1] += ball;
  }
  sums = EVP::reduce_all(sums, MPI_SUM, world);
  return {sums[0], sums[1]};
}

void ReadEVPBody::report(const EVP::BodyMeasures &body, const EVP::MeasureSource &source) const
{
  if (comm->me != 0) return;
  const std::string section = body.radius > 0.0
      ? fmt::format("cylinder of radius {:.6g} m", body.radius)
      : fmt::format("cross-section {:.6g} m2", body.area);
  const std::string solid =
      body.solid_fraction > 0.0 ? fmt::format(", solid fraction {:.4f}", body.solid_fraction) : "";
  const std::string origin = source.is_described ? source.body_file()
      : source.is_given                          ? "as given"
                                                 : "the paper's";
  utils::logmesg(lmp, "read_evp_body: length {:.6g} m, {}{} ({})\n", body.length, section, solid,
                 source.is_given && source.is_described ? "as given, and " + origin : origin);
}
