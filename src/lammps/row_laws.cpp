// SPDX-License-Identifier: GPL-2.0-only

#include "row_laws.h"

#include "collective.h"
#include "scene.h"
#include "user_input.h"

#include "comm.h"
#include "domain.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace EVP {

using Source = Coefficients::Source;

template <class F> void RowLaws::stop_at_bad_row(int i, int j, F &&f) const
{
  stop_at_bad_input(error, fmt::format("Pair evp/lj, types {} and {}", i, j), f);
}

Row RowLaws::make(int i, int j, bool plastic)
{
  Row row;
  stop_at_bad_row(i, j, [&] {
    row = coefficients.make_law(i, j);
    if (plastic) coefficients.law(coefficients.index(i, j)).check_flow();
  });
  return row;
}

bool RowLaws::take_measures(const BondStore *bonds)
{
  static const BondMeasures none;    // a packing allocates nothing
  return coefficients.take_measures(bonds ? bonds->measures() : none);
}

void RowLaws::take_kv()
{
  VolumeForces::take_kv(modify, [this](int type) {
    double kv = 0.0;
    stop_at_bad_row(type, type, [&] {
      kv = coefficients.kv(type);
    });
    return kv;
  });
}

void RowLaws::rescale_if_measures_changed(const BondStore *bonds, bool plastic)
{
  if (!take_measures(bonds)) return;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (cuts.handles(i, j)) make(i, j, plastic);
  take_kv();
}

std::string RowLaws::describe(int i, int j, bool with_kv) const
{
  const Row row = coefficients.row(i, j);
  const auto [source, factors] = coefficients.scaling(i, j);
  std::string line = fmt::format("pair evp/lj: types {} {}: ", i, j);
  if (source == Source::OWN_BONDS) {
    const BondMeasure body = coefficients.measured().of(i, j);
    line += fmt::format("spacing {:.6g} (row {:.6g}), bonds per particle {:.4g} (row {:.4g}): ",
                        body.spacing, row.spacing, body.coordination, row.coordination);
  } else
    line += "no bonds between them: ";
  if (source == Source::AS_GIVEN) return line + "coefficients as given\n";

  line += fmt::format("e1 e2 x {:.6g}, gamma x {:.6g}", factors.energies, factors.gamma);
  if (with_kv && i == j && row.kv > 0.0) line += fmt::format(", kv x {:.6g}", factors.kv);
  return line + (source == Source::LIKE_TYPES ? ", as of the like types\n" : "\n");
}

std::string RowLaws::describe() const
{
  const auto volume = VolumeForces::find(modify);
  const bool with_kv = volume && volume->is_of_rows();
  std::string lines;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (cuts.handles(i, j) && coefficients.row(i, j).is_scaled())
        lines += describe(i, j, with_kv);
  return lines;
}

// Empty where fix evp/volume decides on the KV, or could not be defined.
std::string RowLaws::find_inactive_kv() const
{
  if (domain->dimension == 2 || scene::find_fix(modify, "evp/volume") ||
      !scene::find_fix(modify, "evp/bonds"))
    return "";
  for (int type = 1; type <= atom->ntypes; type++)
    if (const double kv = coefficients.row(type, type).kv; kv > 0.0 && cuts.handles(type, type))
      return fmt::format(
          "Pair evp/lj: the row of type {} has kv {:.6g}, but without fix evp/volume "
          "there is no volume energy, and stiffness and Poisson's ratio are not "
          "those of the row; add: fix ID all evp/volume row",
          type, kv);
  return "";
}

// Again only when it changes.
void RowLaws::warn(const std::string &warning, std::string &last) const
{
  if (warning == last) return;
  last = warning;
  if (!warning.empty() && comm->me == 0) error->warning(FLERR, warning);
}

void RowLaws::report()
{
  warn(find_inactive_kv(), last_kv_warning);
  if (!coefficients.any_scaled()) return;
  const std::string lines = describe();
  if (lines == last_report) return;
  last_report = lines;
  if (comm->me) return;
  if (coefficients.measured().any_bonds())
    utils::logmesg(lmp, lines);
  else
    error->warning(FLERR,
                   "Pair evp/lj: a row names the spacing and coordination that it holds for, but "
                   "there are no bonds to compare with: coefficients are taken as given; define "
                   "fix evp/bonds to scale them");
}

void RowLaws::check(const PairList &list, const VolumeForces *volume) const
{
  if (!coefficients.any_scaled()) return;
  const int n = atom->ntypes + 1;
  std::vector<char> unknown((size_t) n * n, 0);
  for (int i = 1; i < n; i++)
    for (int j = 1; j < n; j++)
      unknown[(size_t) i * n + j] = coefficients.row(i, j).is_scaled() &&
          coefficients.scaling(i, j).source == Source::AS_GIVEN;

  const bool has_kv = volume && volume->is_of_rows();
  int first = 0;    // type, of the pair of types or of the KV
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (!p.is_bond) return;
    const int a = atom->type[p.i], b = atom->type[p.j];
    if (unknown[(size_t) a * n + b]) first = std::max(a, b);
    for (const int type : {a, b})
      if (has_kv && unknown[(size_t) type * n + type] && coefficients.row(type, type).kv > 0.0)
        first = type;
  });
  first = reduce_all(first, MPI_MAX, world);
  if (first)
    error->all(FLERR,
               "Pair evp/lj: the row of type {} cannot be scaled: the type had no bonds when "
               "spacing and coordination were measured; set types before the bonds are recorded",
               first);
}

}    // namespace EVP
