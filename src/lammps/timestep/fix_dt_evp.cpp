// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/timestep/fix_dt_evp.h"

#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/base/user_input.h"

#include "output.h"
#include "pair.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;
using namespace EVP;

static constexpr double PASSES = 1.0;    // displacement per step that passes xi_s deq unseen
static constexpr double ROTATION_PER_STEP = 0.1;    // rad, of any pair that fix nve/evp damps
static constexpr double GROWTH_PER_CHECK = 1.25;
static constexpr double BOUND_CHANGES = 0.05;    // then eigenvalues are due again

// fix ID group dt/evp N fraction [max DT] [displacement F]
FixDtEVP::FixDtEVP(LAMMPS *lmp, int narg, char **arg) :
    WithPerAtomComm(lmp, narg, arg), limits(lmp, *this)
{
  if (narg < 5)
    error->all(FLERR, "{}: expected N fraction [max DT] [displacement F], got {} arguments", who,
               narg - 3);
  stop_at_bad_input(error, who, [&] {
    const Keyword every = {"N", arg[3]}, of_stable = {"fraction", arg[4]};
    const double n = every.number();
    every.demand(n >= 1.0 && n <= 1.0e9 && n == std::floor(n), "must be a positive integer");
    nevery = (int) n;
    fraction = of_stable.number();
    of_stable.demand(
        fraction > 0.0 && fraction < 1.0,
        "must lie between 0 and 1 (of the largest stable timestep; 0.4 is accurate, 0.8 is fast)");
  });
  for_each_keyword(error, who, narg - 5, arg + 5, {"max", "displacement"}, " and ",
                   [this](const Keyword &word) {
                     double &value = word.is("max") ? maximum : displacement;
                     value = word.number();
                     word.demand(value > 0.0, "must be positive");
                   });
  time_depend = 1;
  scene::offer_values(this, 5);
}

void FixDtEVP::init()
{
  pair_data = PairData::require(force, error, who);
  scene::refuse_respa(update, error, who);
  for (const Fix *other : modify->get_fix_list())
    if (strcmp(other->style, "move") == 0 || utils::strmatch(other->style, "^deform") ||
        (utils::strmatch(other->style, "^dt/") && other != this))
      error->all(FLERR,
                 "{}: fix {} of style {} sets the timestep too, or cannot follow a changing one: "
                 "use one fix dt/evp, and drive atoms by 'velocity set' and fix nve/noforce",
                 who, other->id, other->style);
  displacement_warned = rotation_warned = false;
}

// by the row sums, where they prove the timestep stable: eigenvalues cost many times as much
double FixDtEVP::find_stable_dt()
{
  limits.linearise(*PairData::require_present(force, error, who), {groupbit});
  const double bound = limits.bound();
  if (last_ratio == 0.0 || fraction * last_ratio > 1.0 ||
      std::fabs(bound - last_bound) > BOUND_CHANGES * last_bound) {
    const double limit_now = limits.limit();
    last_ratio = limits.converged() ? limit_now / bound : 1.0;
    last_bound = bound;
  }
  return last_ratio * bound;
}

// the smallest of what stability, rotation and the user allow; at set-up at once,
// later it grows by little, since the state may be about to change back
void FixDtEVP::set_dt(bool at_setup)
{
  stable_dt = find_stable_dt();
  double dt = fraction * stable_dt;
  limit = STABILITY;
  const auto keep_below = [&](double most, Limit by) {
    if (most < dt) {
      dt = most;
      limit = by;
    }
  };
  keep_below(maximum, MAXIMUM);
  if (!at_setup) keep_below(GROWTH_PER_CHECK * update->dt, GROWTH);
  const bool unlimited = stable_dt >= NO_LIMIT && maximum >= NO_LIMIT;
  const bool may_meet = find_fastest(dt);
  if (is_resolved() || unlimited)
    keep_below(by_displacement.dt, DISPLACEMENT);
  else if (by_displacement.dt < dt)
    warn_of_displacement(dt);
  keep_below(by_rotation.dt, ROTATION);
  report_limit(dt);
  if (unlimited && std::min(by_displacement.dt, by_rotation.dt) >= NO_LIMIT &&
      (at_setup || !on_any(may_meet, world)))
    error->all(FLERR,
               "{}: at step {} no pair interacts or approaches another, so nothing limits the "
               "timestep: give 'max DT'",
               who, update->ntimestep);
  if (dt != update->dt) change_dt(dt);
}

void FixDtEVP::report_limit(double dt)
{
  const bool rotates = limit == ROTATION;
  if (!rotates && (limit != DISPLACEMENT || !is_resolved())) return;
  bool &warned = rotates ? rotation_warned : displacement_warned;
  if (std::exchange(warned, true) || comm->me) return;
  const FastestPair &pair = rotates ? by_rotation : by_displacement;
  error->warning(FLERR,
                 "{}: from step {} on the {} of pairs limits the timestep, now {:.4g} for atoms "
                 "{} and {}, {:.3g} of what stability allows: {}",
                 who, update->ntimestep, rotates ? "rotation" : "displacement", dt,
                 (bigint) pair.id_i, (bigint) pair.id_j, dt / (fraction * stable_dt),
                 rotates ? "fix nve/evp needs this where it damps pairs that rotate"
                         : "the energy balance needs this after rupture and in impacts; a "
                           "quasi-static load does not: omit 'displacement' there");
}

void FixDtEVP::warn_of_displacement(double dt)
{
  if (std::exchange(displacement_warned, true) || comm->me) return;
  error->warning(FLERR,
                 "{}: at step {} the distance of atoms {} and {} changes by {:.3g} times their "
                 "threshold strain per timestep: a few such pairs do not matter in a "
                 "quasi-static load, but after rupture and in impacts they heat the body: add "
                 "'displacement 0.1' there, or check the energy balance by fix evp/energy",
                 who, update->ntimestep, (bigint) by_displacement.id_i,
                 (bigint) by_displacement.id_j, PASSES * dt / by_displacement.dt);
}

// Sets by_displacement: |u.(v_i - v_j)| dt <= share xi_s deq, over the pairs that interact or can until the next
// check; flight and spin do not count here. Sets by_rotation: fix nve/evp resolves the damping of a pair that rotates by up
// to 0.1 rad. Returns whether a pair of this MPI rank interacts, or approaches and so may at a later check
bool FixDtEVP::find_fastest(double dt)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  velocity.resize(nall);
  velocity.set_first(nlocal, atom->v[0]);
  forward_comm_velocities(velocity);

  const double share = is_resolved() ? displacement : PASSES;
  by_displacement = by_rotation = {NO_LIMIT, 0.0, 0.0};
  const PairRules &rules = pair_data->rules();
  bool meets = false;
  for_each_pair(pair_data->packed_pairs(), scene::rows(atom->x), [&](const PlacedPair &p) {
    if (!((atom->mask[p.i] | atom->mask[p.j]) & groupbit)) return;
    const Vector v = Vector(velocity[p.i]) - Vector(velocity[p.j]);
    const double speed_times_d = dot(p.g, v);
    if (!p.is_past_cutoff() || speed_times_d < 0.0) meets = true;

    const double d = p.distance(), speed = speed_times_d / d;
    const double acts_from = p.is_bond || !rules.joins()
        ? std::sqrt(p.cutsq)
        : rules.join.within * (atom->radius[p.i] + atom->radius[p.j]);
    const double gap = d - acts_from;
    if (gap > 0.0 && -speed * dt * nevery < gap) return;
    const auto allow = [&](FastestPair &fastest, double allowed) {
      if (allowed < fastest.dt)
        fastest = {allowed, (double) atom->tag[p.i], (double) atom->tag[p.j]};
    };
    const double xi_s = pair_data->xi_s_of(p);
    if (speed != 0.0) allow(by_displacement, share * xi_s / (p.inv_deq * std::fabs(speed)));
    if (p.is_past_cutoff() || pair_data->implicit_gamma(p) == 0.0) return;
    const double across_sq = dot(v, v) - speed * speed;
    if (across_sq > 0.0) allow(by_rotation, ROTATION_PER_STEP * d / std::sqrt(across_sq));
  });

  for (FastestPair *const pair : {&by_displacement, &by_rotation}) {
    struct {
      double dt;
      int rank;
    } mine = {pair->dt, comm->me}, least;
    MPI_Allreduce(&mine, &least, 1, MPI_DOUBLE_INT, MPI_MINLOC, world);
    MPI_Bcast(pair, 3, MPI_DOUBLE, least.rank, world);
  }
  return meets;
}

// as the timestep command does
void FixDtEVP::change_dt(double dt)
{
  update->update_time();
  update->dt = dt;
  update->dt_default = 0;
  if (force->pair) force->pair->reset_dt();
  for (int k = 0; k < modify->nfix; k++) modify->fix[k]->reset_dt();
  output->reset_dt();
}
