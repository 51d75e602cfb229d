// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/bonds/compute_evp_state_atom.h"

#include "lammps/base/scene.h"
#include "lammps/base/script_variables.h"
#include "lammps/base/user_input.h"
#include "lammps/bonds/fix_evp_bonds.h"

#include "core/stress/stress.h"
#include "lammps/stress/sphere_stresses.h"

#include "math_const.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace EVP;

// in the order of Value; and all that spheres keep
static const std::vector<std::string> VALUES = {"volume_strain", "von_mises", "triaxiality",
                                                "bonds_now", "joints"};

static bool is_shown(const SphereValue &value)
{
  return value.shown;
}

static std::string all_values()
{
  std::string names = utils::join_words(VALUES, ", ");
  for (const auto &[effect, table] : sphere_tables())
    if (const std::string shown = names_of(table, ", ", is_shown); !shown.empty())
      names += ", " + shown;
  return names;
}

// compute ID group evp/state/atom [value ...] [fraction PHI]
ComputeEVPStateAtom::ComputeEVPStateAtom(LAMMPS *lmp, int narg, char **arg) :
    WithPerAtomComm(lmp, narg, arg)
{
  for (int iarg = 3; iarg < narg; iarg++) {
    const auto at = std::find(VALUES.begin(), VALUES.end(), arg[iarg]);
    const SphereValue *const kept = find_sphere_value(arg[iarg]);
    if (at != VALUES.end() || (kept && kept->shown)) {
      const auto value = (Value) (at - VALUES.begin());    // the last one is that behind VALUES
      if (value == Value::VON_MISES || value == Value::TRIAXIALITY)
        scene::demand_three_dimensions(domain, error, who, arg[iarg],
                                       "use 'dimension 3', or leave the value out");
      values.push_back(value);
      value_names.emplace_back(arg[iarg]);
    } else if (strcmp(arg[iarg], "fraction") == 0) {
      for_each_keyword(error, who, std::min(2, narg - iarg), arg + iarg, {"fraction"}, "",
                       [this](const Keyword &given) {
                         fraction = given.number();
                         given.demand(fraction > 0.0 && fraction <= 1.0,
                                      "must be above 0 and at most 1");
                       });
      iarg++;
    } else
      error->all(FLERR, "{}: unknown keyword '{}'; it takes {}, fraction", who, arg[iarg],
                 all_values());
  }
  if (has(Value::VON_MISES) && fraction == 0.0)
    error->all(FLERR,
               "{}: von_mises needs 'fraction', the volume of all spheres divided by that of the "
               "body: a stress is a force per area of the body",
               who);

  if (has(Value::VOLUME_STRAIN) && !scene::find_fix(modify, "evp/volume"))
    error->all(FLERR,
               "{}: volume_strain is that of fix evp/volume: define it before (with a KV of 0 "
               "it only measures)",
               who);

  std::vector<std::string> names = {"bonds", "share_second", "share_lost", "new_pairs"};
  names.insert(names.end(), value_names.begin(), value_names.end());
  std::string titles;    // for dump_modify
  for (size_t k = 0; k < names.size(); k++)
    titles += fmt::format("colname c_{}[{}] {} ", id, k + 1, names[k]);
  set_script_variable(lmp, who, std::string(id) + "_titles", titles,
                      "give the compute another ID, or rename that variable");

  peratom_flag = 1;
  size_peratom_cols = (int) names.size();
  comm_reverse = std::max((int) NCOUNTS, StressSums::WIDTH);
  comm_forward = AROUND_WIDTH;
}

bool ComputeEVPStateAtom::has(Value value) const
{
  return std::find(values.begin(), values.end(), value) != values.end();
}

void ComputeEVPStateAtom::init()
{
  PairData::require(force, error, who);
}

void ComputeEVPStateAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  if (atom->nmax > nmax) {
    nmax = atom->nmax;
    memory->grow(array_atom, nmax, size_peratom_cols, "evp/state/atom:array_atom");
  }

  auto *const pair_data = PairData::require_present(force, error, who);
  add_pairs(pair_data);
  reverse_comm(sums);
  if (has(Value::VON_MISES) || has(Value::TRIAXIALITY)) find_stresses(*pair_data);
  if (pair_data->bonds() && pair_data->bonds()->has_history())
    dynamic_cast<FixEVPBonds *>(scene::find_fix(modify, "evp/bonds"))->return_histories();

  const BondStore *bonds = pair_data->bonds();
  places.assign(values.size(), {});
  for (size_t k = 0; bonds && k < values.size(); k++)
    if (values[k] == Value::OF_SPHERE) places[k] = bonds->find_value(value_names[k]);
  for (int i = 0; i < atom->nlocal; i++) {
    double *state = array_atom[i];
    const double *count = sums[i];
    const bool in_group = atom->mask[i] & groupbit;
    double recorded = 0.0;
    if (in_group && bonds)
      recorded = bonds->has_history() ? bonds->sphere(i).recorded : (double) bonds->of(i).size();
    state[0] = recorded;
    state[1] = recorded > 0.0 ? count[SECOND] / recorded : 0.0;
    state[2] = recorded > 0.0 ? std::max(0.0, 1.0 - count[WITHIN] / recorded) : 0.0;
    state[3] = in_group ? count[UNBONDED] : 0.0;
    for (size_t k = 0; k < values.size(); k++)
      state[NCOLUMNS + k] = in_group ? value_of(k, i, pair_data) : 0.0;
  }
}

void ComputeEVPStateAtom::add_pairs(const PairData *pair_data)
{
  const PairLists &list = pair_data->packed_pairs();
  sums.assign(list.nall, 0.0);
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (!p.acts()) return;
    const bool second = p.is_bond && pair_data->state_of(p).regime == 2;
    const bool joint = p.is_bond && in_different_bodies(atom, pair_data->within(), p.i, p.j);
    for_each_end(p.i, p.j, list.nreact, [&](int i, int) {
      double *sum = sums[i];
      sum[p.is_bond ? WITHIN : UNBONDED] += 1.0;
      if (second) sum[SECOND] += 1.0;
      if (joint) sum[BETWEEN_BODIES] += 1.0;
    });
  });
}

double ComputeEVPStateAtom::value_of_effects(const std::string &name, int i,
                                             const PairData *pair_data)
{
  double found = 0.0;
  pair_data->effects.for_each([&](const Effect &one) {
    const std::vector<double> *const values = one.values_of_atoms(name);
    if (values && i < (int) values->size()) found = (*values)[i];
  });
  return found;
}

double ComputeEVPStateAtom::value_of(size_t column, int i, const PairData *pair_data) const
{
  const Value value = values[column];
  switch (value) {
    case Value::OF_SPHERE:
      return places[column] ? places[column].of(i) : 0.0;
    case Value::BONDS_NOW:
      return sums[i][WITHIN];
    case Value::JOINTS:
      return sums[i][BETWEEN_BODIES];
    case Value::VOLUME_STRAIN:
      return value_of_effects("volume_strain", i, pair_data);
    default:
      break;
  }
  Tensor of_volume;
  std::copy_n(around[i], of_volume.size(), of_volume.begin());
  const double size = EVP::von_mises(of_volume);
  if (value == Value::TRIAXIALITY) return size > 0.0 ? mean_stress(of_volume) / size : 0.0;
  return size * fraction / around[i][StressSums::NSTRESS];
}

// Sums over each atom and those that it is bonded to, of stress times volume and of the volume of the sphere
void ComputeEVPStateAtom::find_stresses(PairData &pair_data)
{
  StressSums stresses;
  find_stresses_now(pair_data, stresses);
  reverse_comm(stresses.sums);
  const PairLists &lists = pair_data.lists();
  AtomValues own(AROUND_WIDTH, lists.nall);
  for (int i = 0; i < lists.nlocal; i++) {
    const double radius = atom->radius[i];
    std::copy_n(stresses.sums[i], (int) StressSums::NSTRESS, own[i]);
    own[i][StressSums::NSTRESS] = MathConst::MY_4PI3 * radius * radius * radius;
  }
  forward_comm(own);
  around.assign(lists.nall, 0.0);
  std::copy_n(own.data(), AROUND_WIDTH * lists.nlocal, around.data());
  add_bonded(lists.bonds, lists.nreact, own, around);
  reverse_comm(around);
}

double ComputeEVPStateAtom::memory_usage()
{
  return (double) nmax * size_peratom_cols * sizeof(double) + bytes_of(sums, around);
}
