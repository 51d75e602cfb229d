// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/pairs/pair_types.h"

#include "core/bonds/bond_store.h"
#include "core/law/row_text.h"
#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/base/user_input.h"
#include "lammps/pairs/effect.h"

#include "comm.h"
#include "domain.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <tuple>
#include <utility>

namespace EVP {

using Source = Coefficients::Source;

void PairTypes::begin_run(const BondStore *bonds)
{
  const int ntypes = atom->ntypes + 1;
  max_radius.assign(ntypes, 0.0);
  min_radius.assign(ntypes, HUGE_VAL);
  longest_of.assign((size_t) ntypes * ntypes, -1.0);
  limits.assign(ntypes, Limit());
  for (int i = 0; i < atom->nlocal; i++) {
    double &largest = max_radius[atom->type[i]], &smallest = min_radius[atom->type[i]];
    const double radius = atom->radius[i];
    largest = std::max(largest, radius);
    smallest = std::min(smallest, std::isfinite(radius) ? radius : -HUGE_VAL);
  }
  MPI_Allreduce(MPI_IN_PLACE, max_radius.data(), ntypes, MPI_DOUBLE, MPI_MAX, world);
  MPI_Allreduce(MPI_IN_PLACE, min_radius.data(), ntypes, MPI_DOUBLE, MPI_MIN, world);

  // particles to come
  for (Fix *fix : modify->get_fix_list())
    if (utils::strmatch(fix->style, "^pour") || utils::strmatch(fix->style, "^deposit"))
      for (int type = 1; type < ntypes; type++) {
        int itype = type;
        const auto *radius = (const double *) fix->extract("radius", itype);
        if (radius) max_radius[type] = std::max(max_radius[type], *radius);
      }
  set_measures(bonds);
}

double PairTypes::handle(int i, int j, double alpha)
{
  const double smallest = std::min(min_radius[i], min_radius[j]);
  if (!(smallest > 0.0))
    error->all(FLERR,
               "Pair evp/lj needs particles with a radius above zero, and finite, found {} in "
               "types {} and {}: use 'set ... diameter'",
               smallest, i, j);
  const double cut = alpha * (max_radius[i] + max_radius[j]) * (1.0 + LIST_MARGIN);
  longest_of[index(i, j)] = cut;
  return cut;
}

void PairTypes::check_radii() const
{
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->radius[i] > max_radius[atom->type[i]] && handles(atom->type[i], atom->type[i]))
      error->one(FLERR,
                 "Pair evp/lj: the radius of atom {} is {:.8g}, but the cutoff was set for at "
                 "most {:.8g} in its type: radii must not grow past the largest at the start of "
                 "the run; split the run there",
                 atom->tag[i], atom->radius[i], max_radius[atom->type[i]]);
}

template <class F> void PairTypes::stop_at_bad_row(int i, int j, F &&f) const
{
  stop_at_bad_input(error, fmt::format("Pair evp/lj, types {} and {}", i, j), f);
}

Row PairTypes::make(int i, int j, bool plastic)
{
  Row row;
  stop_at_bad_row(i, j, [&] {
    row = coefficients.make_law(i, j);
    if (plastic && i == j) limits[i] = Limit(row);
  });
  return row;
}

bool PairTypes::set_measures(const BondStore *bonds)
{
  static const BondMeasures none;    // a packing allocates nothing
  return coefficients.set_measures(bonds ? bonds->measures : none);
}

bool PairTypes::rescale_if_measures_changed(const BondStore *bonds, bool plastic)
{
  if (!set_measures(bonds)) return false;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (handles(i, j)) make(i, j, plastic);
  return true;
}

std::string PairTypes::describe(int i, int j, bool with_kv) const
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

static bool uses(const Effects &effects, double Row::*member)
{
  return effects.any([member](const Effect &one) {
    return one.uses(member);
  });
}

std::string PairTypes::describe(const Effects &effects) const
{
  const bool with_kv = uses(effects, &Row::kv);
  std::string lines;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (handles(i, j) && coefficients.row(i, j).is_scaled()) lines += describe(i, j, with_kv);
  return lines;
}

// Empty where fix evp/volume decides on the KV, or could not be defined.
std::string PairTypes::find_inactive_kv() const
{
  if (domain->dimension == 2 || scene::find_fix(modify, "evp/volume") ||
      !scene::find_fix(modify, "evp/bonds"))
    return "";
  for (int type = 1; type <= atom->ntypes; type++)
    if (const double kv = coefficients.row(type, type).kv; kv > 0.0 && handles(type, type))
      return fmt::format("Pair evp/lj: the row of type {} has kv {:.6g}, but without fix "
                         "evp/volume there is no volume energy, and stiffness and Poisson's ratio "
                         "are not those of the row; add: fix ID all evp/volume row",
                         type, kv);
  return "";
}

// Of those that change forces
std::string PairTypes::find_inactive_keywords(bool plastic, const Effects &effects) const
{
  std::string of_plasticity, of_heat;
  for (const char *key : {"yield", "damage", "soften", "rate", "expansion"}) {
    const Member &member = *find_member(key);
    const bool needs_plasticity = !plastic && member.value != &Row::expansion;
    bool given = false;
    if (!needs_plasticity && uses(effects, member.value)) continue;
    for (int type = 1; type <= atom->ntypes; type++)
      given = given || (handles(type, type) && is_given(coefficients.row(type, type), member));
    std::string &keys = needs_plasticity ? of_plasticity : of_heat;
    if (given) keys += (keys.empty() ? "" : ", ") + std::string(key);
  }
  for (const auto &[name, member, needed] :
       {std::tuple("D4 of damage", &Row::damage_d4, &Row::rate),
        {"D5 of damage", &Row::damage_d5, &Row::soften_tref}}) {
    bool given = false;
    for (int type = 1; type <= atom->ntypes; type++)
      given = given || (handles(type, type) && coefficients.row(type, type).*member != 0.0);
    if (plastic && given && !uses(effects, needed))
      of_heat += (of_heat.empty() ? "" : ", ") + std::string(name);
  }
  std::string text;
  if (!of_plasticity.empty()) text += ", inactive without plasticity isotropic: " + of_plasticity;
  if (!of_heat.empty()) text += ", inactive without fix evp/heat: " + of_heat;
  return text;
}

// The row of two unlike types says how stiff their bonds are, those of like types how far they hold
void PairTypes::report_unlike_types()
{
  std::string line;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i + 1; j <= atom->ntypes; j++) {
      if (!handles(i, j)) continue;
      if (!handles(i, i) && !handles(j, j))
        error->all(FLERR,
                   "Pair evp/lj: with plasticity a bond of types {} and {} holds as the weaker of "
                   "its spheres, by the rows of like types: give 'pair_coeff {} {}' a row",
                   i, j, i, i);
      const Row row = coefficients.row(i, j);
      if (row.limit_own != 0.0) continue;
      const auto has = [&](int type) {
        const Row own = coefficients.row(type, type);
        return !handles(type, type) || (own.xi_s == row.xi_s && own.flow == row.flow);
      };
      if (!has(i) || !has(j)) line += fmt::format("{}{} {}", line.empty() ? "" : ", ", i, j);
    }
  if (line == std::exchange(last_flow_report, line) || line.empty() || comm->me) return;
  utils::logmesg(lmp,
                 "pair evp/lj: with plasticity xi_s and flow of the rows of types {} are not used: "
                 "a bond holds as the weaker of its spheres, by the rows of like types\n",
                 line);
}

void PairTypes::report(bool plastic, const Effects &effects)
{
  if (plastic) report_unlike_types();
  const std::string warning = find_inactive_kv();
  if (warning != std::exchange(last_kv_warning, warning) && !warning.empty() && comm->me == 0)
    error->warning(FLERR, warning);
  if (!coefficients.any_scaled()) return;
  const std::string lines = describe(effects);
  if (lines == std::exchange(last_report, lines) || comm->me) return;
  if (coefficients.measured().any_bonds())
    utils::logmesg(lmp, lines);
  else
    error->warning(FLERR,
                   "Pair evp/lj: a row names the spacing and coordination that it holds for, but "
                   "there are no bonds to compare with: coefficients are taken as given; define "
                   "fix evp/bonds to scale them");
}

void PairTypes::check(const PairList &list, const Effects &effects) const
{
  if (!coefficients.any_scaled()) return;
  const int n = atom->ntypes + 1;
  std::vector<char> unknown((size_t) n * n, 0);
  for (int i = 1; i < n; i++)
    for (int j = 1; j < n; j++)
      unknown[(size_t) i * n + j] = coefficients.row(i, j).is_scaled() &&
          coefficients.scaling(i, j).source == Source::AS_GIVEN;

  const bool has_kv = uses(effects, &Row::kv);
  int first = 0;    // type, of the pair of types or of the KV
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    const int a = atom->type[p.i], b = atom->type[p.j];
    if (unknown[(size_t) a * n + b]) first = std::max(a, b);
    for (const int type : {a, b})
      if (has_kv && unknown[(size_t) type * n + type] && coefficients.row(type, type).kv > 0.0)
        first = type;
  });
  first = reduce_all(first, MPI_MAX, world);
  if (first)
    error->all(
        FLERR,
        "Pair evp/lj: the row of type {} cannot be scaled: the type had no bonds when "
        "spacing and coordination were measured; set types before the bonds are recorded, or "
        "give atoms that come later a row without spacing",
        first);
}

// Collective. name: of the row
static Row read_file(LAMMPS *lmp, const std::string &file, const std::string &name)
{
  std::string text, complaint;
  if (lmp->comm->me == 0) {
    std::ifstream in(utils::get_potential_file_path(file), std::ios::binary);
    std::ostringstream read;
    read << in.rdbuf();
    text = read.str();
    if (text.empty())
      complaint = "cannot read the potential file '" + shown(file) +
          "': give its path, or put its folder into LAMMPS_POTENTIALS; a row of numbers has " +
          row_keys();
  }
  throw_together(complaint, lmp->world);
  broadcast(text, 0, lmp->world);
  return row_from_text(text, file, name, lmp->update->unit_style);
}

Row read_row(LAMMPS *lmp, const std::vector<std::string> &words)
{
  const auto found = find_file_and_row(words);
  return found ? read_file(lmp, (*found)[0], (*found)[1]) : parse_row(words);
}

}    // namespace EVP
