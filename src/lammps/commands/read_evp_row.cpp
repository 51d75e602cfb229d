// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/commands/read_evp_row.h"

#include "core/law/bond_measures.h"
#include "lammps/base/collective.h"
#include "lammps/base/script_variables.h"
#include "lammps/base/user_input.h"
#include "lammps/pairs/pair_types.h"

#include "atom.h"
#include "group.h"
#include "math_const.h"
#include "update.h"

#include <cmath>
#include <cstring>
#include <vector>

using namespace LAMMPS_NS;
using namespace EVP;

// read_evp_row FILE:ROW PREFIX, or FILE ROW PREFIX, or e1 m1 ... alpha [keyword value ...] PREFIX, where the numbers
// may be one quoted word; then [set KEY NUMBER] ... [body GROUP VOLUME SOLID_FRACTION]
void ReadEVPRow::command(int narg, char **arg)
{
  char **body = nullptr;
  std::vector<char **> changes;    // the last one in front
  if (narg > 5 && strcmp(arg[narg - 4], "body") == 0) body = arg + (narg -= 4) + 1;
  while (narg > 4 && strcmp(arg[narg - 3], "set") == 0) changes.push_back(arg + (narg -= 3) + 1);
  if (narg < 2)
    error->all(FLERR,
               "read_evp_row: expected at least two arguments, a row (FILE:ROW or its numbers) and "
               "the prefix of the variables, got {}",
               narg);
  std::vector<std::string> words = {arg, arg + narg - 1};
  if (words.size() == 1 && words[0].find(':') == std::string::npos) words = split_words(words[0]);

  const std::string prefix = arg[narg - 1];
  const auto set = [&](const std::string &name, const std::string &value) {
    set_script_variable(lmp, "read_evp_row", prefix + "_" + name, value,
                        "give another prefix than '" + prefix + "', or rename that variable");
  };
  Row row;
  stop_at_bad_input(error, "read_evp_row", [&] {
    row = read_row(lmp, words);
    for (auto at = changes.rbegin(); at != changes.rend(); ++at)
      set_number(row, (*at)[0], (*at)[1]);
    if (!body) return;
    const Spheres spheres = spheres_of(body);
    set("diameter", rounded(spheres.diameter, 15));
    if (!row.is_scaled()) row = with_number_density(row, spheres.number_density);
  });
  for (const Member &member : MEMBERS) {
    std::string name = member.key;
    std::replace(name.begin(), name.end(), ' ', '_');
    set(name, shortest_text(row.*member.value));
  }
  set("words", row_text(row));
  std::string key = row_text(row);    // 'if' compares words of letters, digits and _ alone
  for (char &c : key)
    if (!isalnum((unsigned char) c)) c = c == '.' ? 'p' : c == '-' ? 'm' : '_';
  set("key", key);
}

// Throws BadInput where rows have no such number, or this one breaks a rule with it.
void ReadEVPRow::set_number(Row &row, const std::string &key, const std::string &number)
{
  const Member *const member = find_member(key);
  if (!member)
    throw BadInput("set: a row has no number '" + shown(key) + "': it has " +
                   keys_of(MEMBERS, std::end(MEMBERS), ", "));
  if (member->place != Member::HEAD && !is_given(row, *member))
    throw BadInput("set: the row has no keyword " + std::string(member->head()->key) +
                   ", of which " + key + " is a number: give the row that keyword");
  row.*member->value = parse_number(key, number);
  (void) PairLaw(row);
}

// Collective. Those of a group, whose volumes must be those of the body. words: group, volume, solid fraction
ReadEVPRow::Spheres ReadEVPRow::spheres_of(char **words) const
{
  if (strcmp(update->unit_style, "si") != 0)
    throw BadInput("body is about that of the paper, in units si: leave 'body' out, and give the "
                   "coefficients of your own body");
  const int igroup = group->find(words[0]);
  if (!atom->radius_flag) throw BadInput("body: there are no spheres yet");
  if (igroup < 0) throw BadInput(fmt::format("body: there is no group '{}'", words[0]));
  const Keyword volume = {"body: the volume", words[1]},
                fraction = {"body: the solid fraction", words[2]};
  const double inside = volume.number(), solid = fraction.number();
  volume.demand(inside > 0.0, "must be positive");
  fraction.demand(solid > 0.0 && solid <= 1.0, "must lie between 0 and 1");
  double of_spheres = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & group->bitmask[igroup])
      of_spheres += 4.0 / 3.0 * MathConst::MY_PI * std::pow(atom->radius[i], 3);
  of_spheres = reduce_all(of_spheres, MPI_SUM, world);
  if (std::fabs(of_spheres / (inside * solid) - 1.0) > 0.02)
    throw BadInput(fmt::format(
        "the spheres of group {} have a volume of {:.5g} m3, but a solid fraction of {} in a body "
        "of {} m3 makes {:.5g} m3: check the numbers in FILE.body, which are in m",
        words[0], of_spheres, words[2], words[1], inside * solid));
  const auto count = (double) group->count(igroup);
  return {count / inside, std::pow(6 * solid * inside / (MathConst::MY_PI * count), 1.0 / 3.0)};
}
