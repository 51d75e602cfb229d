// SPDX-License-Identifier: GPL-2.0-only

#include "timestep_check.h"

#include "collective.h"
#include "scene.h"
#include "stable_timesteps.h"
#include "with_per_atom_comm.h"

#include "comm.h"
#include "compute.h"

#include <algorithm>
#include <cmath>

namespace EVP {

namespace {

  // With respa the pair style has a step of its own.
  bool is_checked_elsewhere(const Modify *modify, const Update *update)
  {
    if (utils::strmatch(update->integrate_style, "^respa")) return true;
    for (int k = 0; k < modify->ncompute; k++)
      if (strcmp(modify->compute[k]->style, "evp/dt") == 0) return true;
    return scene::find_fix(modify, "dt/evp") || scene::find_fix(modify, "dt/reset");
  }

  // Other fixes hold their atoms, or move several as one.
  bool moves_each_atom_freely(const Fix *fix)
  {
    for (const char *pattern : {"^nve$", "^nve/omp$", "^nve/intel$", "^nve/sphere", "^nve/evp$"})
      if (utils::strmatch(fix->style, pattern)) return true;
    return false;
  }

  // Those that follow the forces on them.
  StableTimesteps::FreeAtoms find_free(const Modify *modify)
  {
    StableTimesteps::FreeAtoms free = {0};
    for (int k = 0; k < modify->nfix; k++) {
      const Fix *const fix = modify->fix[k];
      if (moves_each_atom_freely(fix))
        free.groups |= fix->groupbit;
      else if (fix->time_integrate || scene::holds_atoms(fix))
        free.held_groups |= fix->groupbit;
    }
    return free;
  }

  /// Exchanges values as compute evp/dt does, without being one of the computes of the input script.
  struct Exchange : public WithPerAtomComm<Compute> {
    using WithPerAtomComm::WithPerAtomComm;
    void init() override {}
  };

  // Gershgorin, without the volume energy. Spares most runs the links and the eigenvalues of the network.
  bool may_be_unstable(const PairData &pair_data, const Atom *atom, double dt, int nreact,
                       Exchange &exchange, const std::vector<double> &inverse_mass)
  {
    const PairLists &list = pair_data.packed_pairs();
    std::vector<double> sums((size_t) list.nall, 0.0);
    for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
      if (p.is_past_cutoff()) return;
      const auto stiffness = StableTimesteps::stiffness_of(pair_data, p);
      const double gamma = pair_data.law_of(p).gamma;
      const double value = dt * (dt * (stiffness.axial + stiffness.across) + 2.0 * gamma);
      sums[p.i] += value;
      if (p.j < nreact) sums[p.j] += value;
    });
    exchange.comm_reverse = 1;
    exchange.reverse_comm(sums);
    exchange.comm_reverse = 3;
    bool any = false;
    for (int i = 0; i < atom->nlocal; i++) any = any || inverse_mass[i] * sums[i] > 2.0;
    return any;
  }

  bool are_close(const std::vector<double> &a, const std::vector<double> &b)
  {
    constexpr double ROUND_OFF = 1e-9;    // sums in another order
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](double x, double y) {
      return std::fabs(x - y) <= ROUND_OFF * std::fabs(x);
    });
  }

}    // namespace

// The same on all MPI ranks.
std::vector<double> TimestepCheck::describe(const std::vector<double> &inverse_mass) const
{
  const VolumeForces *const volume = pair_data.volume();
  std::array<double, 2> sums = {};
  for (int i = 0; i < atom->nlocal; i++) {
    sums[0] += inverse_mass[i];
    if (volume) sums[1] += volume->stiffness(i);
  }
  sums = reduce_all(sums, MPI_SUM, world);
  const Fix *const implicit = scene::find_fix(modify, "nve/evp");
  std::vector<double> values = {update->dt,
                                (double) pair_data.source.version(),
                                (double) pair_data.rules.plastic,
                                (double) (implicit ? implicit->groupbit : 0),
                                sums[0],
                                sums[1]};
  for (const int index : coefficients.laws_in_use())
    for (const Member &member : MEMBERS)
      values.push_back(coefficients.law(index).row.*member.value);
  return values;
}

void TimestepCheck::warn()
{
  if (!scene::makes_steps(lmp) || is_checked_elsewhere(modify, update)) return;
  const StableTimesteps::FreeAtoms free = find_free(modify);
  if (!free.groups) return;
  std::vector<double> inverse_mass((size_t) atom->nlocal, 0.0);
  for (int i = 0; i < atom->nlocal; i++)
    if (free.has(atom->mask[i])) inverse_mass[i] = scene::inverse_mass(atom, force, i);
  const std::vector<double> now = describe(inverse_mass);
  if (are_close(now, checked)) return;
  checked = now;

  const int nreact = pair_data.packed_pairs().nreact(force->newton_pair);
  if (VolumeForces *const volume = pair_data.volume())
    volume->evaluate(pair_data.packed_pairs(),
                     {scene::rows(atom->x), scene::rows(atom->v), nullptr, nreact});
  char words[][16] = {"timestep_check", "all", "evp/dt"};
  char *arg[] = {words[0], words[1], words[2]};
  Exchange exchange(lmp, 3, arg);
  const double dt = update->dt;
  const bool screened = !pair_data.volume() &&
      !on_any(may_be_unstable(pair_data, atom, dt, nreact, exchange, inverse_mass), world);
  if (screened) return;

  StableTimesteps limits(lmp, exchange);
  limits.linearise(pair_data, free);
  if (!limits.all_implicit() && limits.is_stable_explicitly(dt)) return;
  const double limit = limits.present_dt();
  if (dt > (1.0 + StableTimesteps::ACCURACY) * limit && comm->me == 0)
    error->warning(FLERR,
                   "Pair evp/lj: the timestep {:.6g} is {:.4g} times the largest stable timestep "
                   "{:.6g}: the run is unstable, or silently wrong; fix dt/evp sets the timestep, "
                   "compute evp/dt shows the limit",
                   dt, dt / limit, limit);
}

}    // namespace EVP
