// SPDX-License-Identifier: GPL-2.0-only

#include "scaling_report.h"

using namespace LAMMPS_NS;
using Source = EVP::Coefficients::Source;

static constexpr int MOST_LINES = 20;

static std::string line_of(const EVP::Coefficients &coefficients, int i, int j)
{
  const EVP::RowKeywords row = coefficients.keywords(i, j);
  const auto [source, factors] = coefficients.scaling(i, j);
  std::string line = fmt::format("pair evp/lj: types {} {}: ", i, j);
  if (source == Source::OWN_BONDS) {
    const EVP::BondMeasure body = coefficients.measured().of(i, j);
    line += fmt::format("spacing {:.6g} (row {:.6g}), bonds per particle {:.4g} (row {:.4g}): ",
                        body.spacing, row.spacing, body.coordination, row.coordination);
  } else
    line += "no bonds between them: ";
  if (source == Source::AS_GIVEN) return line + "coefficients as given\n";

  line += fmt::format("e1 e2 x {:.6g}, gamma x {:.6g}", factors.energies, factors.gamma);
  if (i == j && row.kv > 0.0) line += fmt::format(", kv x {:.6g}", factors.kv);
  return line + (source == Source::LIKE_TYPES ? ", as of the like types\n" : "\n");
}

std::string LAMMPS_NS::describe_scaling(const EVP::Coefficients &coefficients, const CutOffs &cuts,
                                        int ntypes)
{
  std::string lines;
  int count = 0;
  for (int i = 1; i <= ntypes; i++)
    for (int j = i; j <= ntypes; j++)
      if (cuts.handles(i, j) && coefficients.keywords(i, j).is_scaled() && ++count <= MOST_LINES)
        lines += line_of(coefficients, i, j);
  if (count > MOST_LINES)
    lines += fmt::format("pair evp/lj: and {} more pairs of types\n", count - MOST_LINES);
  return lines;
}
