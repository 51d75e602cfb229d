// SPDX-License-Identifier: GPL-2.0-only

#include "compute_evp_state_atom.h"

#include "core/strain_fit.h"
#include "fix_evp_bonds.h"
#include "scene.h"
#include "user_input.h"

#include "compute_stress_atom.h"
#include "group.h"
#include "input.h"
#include "math_const.h"
#include "variable.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace EVP;

// in the order of Value
static const std::vector<std::string> VALUES = {"plastic_work",       "plastic_strain",
                                                "plastic_strain_sum", "volume_strain",
                                                "von_mises",          "triaxiality"};

// compute ID group evp/state/atom [value ...] [fraction PHI]
ComputeEVPStateAtom::ComputeEVPStateAtom(LAMMPS *lmp, int narg, char **arg) :
    WithPerAtomComm(lmp, narg, arg)
{
  for (int iarg = 3; iarg < narg; iarg++) {
    const auto at = std::find(VALUES.begin(), VALUES.end(), arg[iarg]);
    if (at != VALUES.end()) {
      const auto value = (Value) (at - VALUES.begin());
      if (value != Value::PLASTIC_WORK && value != Value::PLASTIC_STRAIN_SUM)
        scene::demand_three_dimensions(domain, error, who, arg[iarg],
                                       "use 'dimension 3', or leave the value out");
      values.push_back(value);
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
                 utils::join_words(VALUES, ", "));
  }
  if (has(Value::VON_MISES) && fraction == 0.0)
    error->all(FLERR,
               "{}: von_mises needs 'fraction', the volume of all spheres divided by that of the "
               "body: a stress is a force per area of the body",
               who);

  std::vector<std::string> names = {"bonds", "share_second", "share_lost", "new_pairs"};
  for (const Value value : values) names.push_back(VALUES[(size_t) value]);
  std::string titles;    // for dump_modify
  for (size_t k = 0; k < names.size(); k++)
    titles += fmt::format("colname c_{}[{}] {} ", id, k + 1, names[k]);
  input->variable->set(fmt::format("{}_titles string \"{}\"", id, titles));

  peratom_flag = 1;
  size_peratom_cols = (int) names.size();
  comm_reverse = NCOUNTS;
  if (has(Value::VOLUME_STRAIN)) {
    volume_at = comm_reverse;
    comm_reverse += 2;
  }
  if (has(Value::PLASTIC_STRAIN)) {
    plastic_at = comm_reverse;
    comm_reverse += StrainFit::NSUMS;
  }
  if (!has(Value::VON_MISES) && !has(Value::TRIAXIALITY)) return;

  // LAMMPS does not know this one: the buffers and the flags are those of this compute
  std::vector<std::string> words = {id, group->names[igroup], "stress/atom", "NULL", "virial"};
  std::vector<char *> args;
  for (std::string &word : words) args.push_back(word.data());
  stress = std::make_unique<ComputeStressAtom>(lmp, (int) args.size(), args.data());
  comm_reverse = std::max(comm_reverse, stress->comm_reverse);
  pressatomflag = stress->pressatomflag;
  timeflag = stress->timeflag;
}

bool ComputeEVPStateAtom::has(Value value) const
{
  return std::find(values.begin(), values.end(), value) != values.end();
}

void ComputeEVPStateAtom::init()
{
  PairData::require(force, error, who);
  if (stress) stress->init();
}

void ComputeEVPStateAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  if (atom->nmax > nmax) {
    nmax = atom->nmax;
    memory->grow(array_atom, nmax, size_peratom_cols, "evp/state/atom:array_atom");
  }

  const auto *pair_data = PairData::require_present(force, error, who);
  add_pairs(pair_data);
  reverse_comm(sums);
  if (stress) stress->compute_peratom();
  if ((has(Value::PLASTIC_WORK) || has(Value::PLASTIC_STRAIN_SUM)) && pair_data->bonds())
    dynamic_cast<FixEVPBonds *>(scene::find_fix(modify, "evp/bonds"))->return_histories();

  const BondStore *bonds = pair_data->bonds();
  for (int i = 0; i < atom->nlocal; i++) {
    double *state = array_atom[i];
    const double *count = &sums[(size_t) comm_reverse * i];
    const bool in_group = atom->mask[i] & groupbit;
    const double recorded = (in_group && bonds) ? (double) bonds->of(i).size() : 0.0;
    state[0] = recorded;
    state[1] = recorded > 0.0 ? count[SECOND] / recorded : 0.0;
    state[2] = recorded > 0.0 ? 1.0 - count[WITHIN] / recorded : 0.0;
    state[3] = in_group ? count[FRESH] : 0.0;
    for (size_t k = 0; k < values.size(); k++)
      state[NCOLUMNS + k] = in_group ? value_of(values[k], i, bonds) : 0.0;
  }
}

void ComputeEVPStateAtom::add_pairs(const PairData *pair_data)
{
  const PairLists &list = pair_data->packed_pairs();
  sums.assign((size_t) comm_reverse * list.nall, 0.0);
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (p.is_past_cutoff()) return;
    const bool second = pair_data->state_of(p).regime == 2;
    const bool fits = p.is_bond && (volume_at >= 0 || plastic_at >= 0);
    const double weight = !fits ? 0.0
                                : StrainFit::weight(1.0 / p.inv_deq,
                                                    pair_data->law_of(p).row.alpha *
                                                        (atom->radius[p.i] + atom->radius[p.j]));
    for (const int owner : {p.i, p.j}) {
      if (owner == p.j && p.j >= list.nreact) continue;
      double *sum = &sums[(size_t) comm_reverse * owner];
      sum[p.is_bond ? WITHIN : FRESH] += 1.0;
      if (p.is_bond && second) sum[SECOND] += 1.0;
      if (fits && volume_at >= 0) {
        sum[volume_at] += weight * (p.distance() * p.inv_deq - 1.0);
        sum[volume_at + 1] += weight;
      }
      if (fits && plastic_at >= 0) StrainFit::add(p.g, weight, p.offset.q, sum + plastic_at);
    }
  });
}

// Each pair is kept by both of its atoms. PLASTIC_STRAIN_SUM is a lower bound of the accumulated plastic strain: a bond
// along u carries |u.E.u| of a strain E of constant volume, whose mean over all directions is 0.385 of the equivalent
// strain
double ComputeEVPStateAtom::of_histories(Value value, int i, const BondStore *bonds)
{
  constexpr double MEAN_OVER_DIRECTIONS = 0.385;
  if (!bonds || !bonds->has_history()) return 0.0;
  const auto nbonds = bonds->of(i).size();
  double work = 0.0, k = 0.0;
  for (size_t slot = 0; slot < nbonds; slot++) {
    work += bonds->histories_of(i)[slot].work;
    k += bonds->histories_of(i)[slot].k;
  }
  if (value == Value::PLASTIC_STRAIN_SUM)
    return nbonds ? k / ((double) nbonds * MEAN_OVER_DIRECTIONS) : 0.0;
  for (const FlowedContact &contact : bonds->contacts_of(i)) work += contact.history.work;
  return 0.5 * work;
}

double ComputeEVPStateAtom::value_of(Value value, int i, const BondStore *bonds) const
{
  const double *sum = &sums[(size_t) comm_reverse * i];
  switch (value) {
    case Value::PLASTIC_WORK:
    case Value::PLASTIC_STRAIN_SUM:
      return of_histories(value, i, bonds);
    case Value::PLASTIC_STRAIN:
      return std::sqrt(deviator_squared(StrainFit::solve(sum + plastic_at)) / 1.5);
    case Value::VOLUME_STRAIN:
      return sum[volume_at + 1] > 0.0 ? 3.0 * sum[volume_at] / sum[volume_at + 1] : 0.0;
    default:
      break;
  }
  SymmetricTensor of_volume;
  std::copy_n(stress->array_atom[i], 6, of_volume.begin());
  const double mises = std::sqrt(1.5 * deviator_squared(of_volume));
  if (value == Value::TRIAXIALITY) return mises > 0.0 ? mean_of(of_volume) / mises : 0.0;
  const double radius = atom->radius[i];
  return mises * fraction / (MathConst::MY_4PI3 * radius * radius * radius);
}

double ComputeEVPStateAtom::memory_usage()
{
  return (double) nmax * size_peratom_cols * sizeof(double) + bytes_of(sums) +
      (stress ? stress->memory_usage() : 0.0);
}
