/* SPDX-License-Identifier: GPL-2.0-only

   Fix nve/evp: time integration. The linear solve is in fix_nve_evp_solve.cpp. */

#include "fix_nve_evp.h"

#include "core/text.h"
#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;

/* ----------------------------------------------------------------------
   fix ID group nve/evp [tol 1e-3] [maxiter 500]
------------------------------------------------------------------------- */

FixNVEEVP::FixNVEEVP(LAMMPS *lmp, int narg, char **arg) :
    NodalExchange(lmp, narg, arg), tolerance(1.0e-3), max_iterations(500), others_groupbits(0),
    forces_follow(false), pair(nullptr), balance_wanted(false), most_turned(0.0),
    turning_warned(false), last_build(-1), bodies_build(-1), dt_turning(0.0), dt_applied(0.0),
    vflag_now(0), last_iterations(0), most_iterations(0), all_iterations(0), solves(0)
{
  for (int iarg = 3; iarg < narg; iarg += 2) {
    const std::string key = arg[iarg];
    if (key != "tol" && key != "maxiter")
      error->all(FLERR, "Fix {} nve/evp: unknown keyword '{}'; it takes tol and maxiter", id, key);
    if (iarg + 1 == narg) error->all(FLERR, "Fix {} nve/evp: keyword {} needs a value", id, key);
    double value = 0.0;
    try {
      value = EVP::parse_number(key, arg[iarg + 1]);
    } catch (const EVP::BadInput &bad) {
      error->all(FLERR, "Fix {} nve/evp: {}", id, bad.what());
    }
    if (key == "tol") {
      if (!(value > 0.0 && value < 1.0))
        error->all(FLERR,
                   "Fix {} nve/evp: tol must lie between 0 and 1 (residual over damping), got {}",
                   id, arg[iarg + 1]);
      tolerance = value;
    } else {
      if (!(value >= 1.0 && value <= 1.0e6 && value == std::floor(value)))
        error->all(FLERR, "Fix {} nve/evp: maxiter must be a whole number from 1 to 1e6, got {}",
                   id, arg[iarg + 1]);
      max_iterations = (int) value;
    }
  }

  time_integrate = 1;
  dynamic_group_allow = 0;
  virial_global_flag = virial_peratom_flag = thermo_virial = 1;
  scalar_flag = vector_flag = 1;
  size_vector = 2;
  global_freq = 1;
  extscalar = extvector = 0;
  atom->add_callback(
      Atom::GROW);    // LAMMPS takes it from constructors only; nothing is kept unless wanted
}

/* ---------------------------------------------------------------------- */

FixNVEEVP::~FixNVEEVP()
{
  atom->delete_callback(id, Atom::GROW);
}

/* ---------------------------------------------------------------------- */

int FixNVEEVP::setmask()
{
  return INITIAL_INTEGRATE | FINAL_INTEGRATE | POST_FORCE | MIN_POST_FORCE | POST_RUN;
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::init()
{
  const std::string who = fmt::format("Fix {} nve/evp", id);
  pair = PairNetwork::require(force, error, who);
  EVP::scene::refuse_respa(update, error, who);

  others_groupbits = 0;
  forces_follow = false;
  bool after_this = false;
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *other = modify->fix[k];
    if (other == this) {
      after_this = true;
      continue;
    }
    if (after_this && (modify->fmask[k] & POST_FORCE)) forces_follow = true;
    if (strcmp(other->style, style) == 0)
      error->all(
          FLERR,
          "Fix {} nve/evp: fix {} is one already, and the damping is one system: use one fix "
          "nve/evp for the group union",
          id, other->id);
    if (EVP::scene::moves_by_forces(other)) others_groupbits |= other->groupbit;
  }
  if (domain->deform_vremap)
    error->all(
        FLERR,
        "Fix {} nve/evp does not know the velocity of a deforming box: use fix deform without "
        "'remap v'",
        id);
  check_groups();
  want_places();
  balance_wanted = EVP::scene::find_fix(modify, "evp/energy") != nullptr;
  most_turned = 0.0;
  turning_warned = false;
  last_build = bodies_build = -1;    // another pair style may have come to the same count
  last_iterations = most_iterations = 0;
  all_iterations = solves = 0;
}

/* ----------------------------------------------------------------------
   a path may turn: then the velocity over the step to come is not that at the present places
------------------------------------------------------------------------- */

void FixNVEEVP::want_places()
{
  movers.forget();
  bool any = movers.wanted();
  for (int k = 0; k < modify->nfix; k++) any = any || strcmp(modify->fix[k]->style, "move") == 0;
  if (!any || movers.wanted()) return;
  movers.want();
  create_attribute = 1;
  maxexchange = EVP::MoverPlaces::SIZE;
  movers.grow(atom->nmax);
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::grow_arrays(int nmax)
{
  if (movers.wanted()) movers.grow(nmax);
}

void FixNVEEVP::copy_arrays(int i, int j, int /*delflag*/)
{
  if (movers.wanted()) movers.copy(i, j);
}

void FixNVEEVP::set_arrays(int i)
{
  if (movers.wanted()) movers.set(atom, domain, i);
}

int FixNVEEVP::pack_exchange(int i, double *buf)
{
  if (!movers.wanted()) return 0;
  movers.pack(i, buf);
  return EVP::MoverPlaces::SIZE;
}

int FixNVEEVP::unpack_exchange(int i, double *buf)
{
  if (!movers.wanted()) return 0;
  movers.unpack(i, buf);
  return EVP::MoverPlaces::SIZE;
}

/* ----------------------------------------------------------------------
   what else acts on the velocities of the group would undo the solve, or be undone by it
------------------------------------------------------------------------- */

void FixNVEEVP::check_groups() const
{
  for (const Fix *other : modify->get_fix_list()) {
    bool holds = false;
    for (const char *pattern : {"^setforce", "^lineforce", "^planeforce", "^aveforce", "^freeze"})
      holds = holds || utils::strmatch(other->style, pattern);
    if (other == this || (!holds && !other->time_integrate)) continue;
    int shared = 0, any;
    for (int i = 0; i < atom->nlocal; i++)
      if (in_group(i) && (atom->mask[i] & other->groupbit)) shared = 1;
    MPI_Allreduce(&shared, &any, 1, MPI_INT, MPI_MAX, world);
    if (any)
      error->all(
          FLERR,
          "Fix {} nve/evp and fix {} of style {} act on the same atoms: leave those that are "
          "held or moved otherwise out of its group, and use fix nve/noforce for them",
          id, other->id, other->style);
  }
}

/* ---------------------------------------------------------------------- */

bool FixNVEEVP::in_group(int i) const
{
  return atom->mask[i] & groupbit;
}

/* ----------------------------------------------------------------------
   atoms hold the velocity of the full step: half of the kick is still to come
------------------------------------------------------------------------- */

void FixNVEEVP::setup(int vflag)
{
  vflag_now = vflag;
  collect_dampers();
  if (balance_wanted) find_rates(0.0);
  solve_and_apply(0.5 * update->dt);
  movers.remember(atom, domain);
  if (forces_follow) dt_applied = 0.0;    // solve anew with what they add to f from here on
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::post_force(int vflag)
{
  vflag_now = vflag;
}

/* ---------------------------------------------------------------------- */

// no damping acts in a minimization: the virial of the last run must not stay in its pressure

void FixNVEEVP::min_setup(int vflag)
{
  v_init(vflag);
}

void FixNVEEVP::min_post_force(int vflag)
{
  v_init(vflag);
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::post_run()
{
  warn_of_turning();
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::initial_integrate(int /*vflag*/)
{
  // the damping in f belongs to another step, or to less force: solve its second half anew
  if (update->dt != dt_applied) {
    remove_applied();
    solve_and_apply(0.5 * update->dt);
  }
  kick();
  for (int i = 0; i < atom->nlocal; i++)
    if (in_group(i))
      for (int c = 0; c < 3; c++) atom->x[i][c] += update->dt * atom->v[i][c];
}

/* ----------------------------------------------------------------------
   atoms hold v-: solve for v+, and leave them half way between
------------------------------------------------------------------------- */

void FixNVEEVP::final_integrate()
{
  collect_dampers();
  if (balance_wanted) find_rates(update->dt);
  solve_and_apply(update->dt);
  if (balance_wanted) find_mean_rates();
  movers.remember(atom, domain);
  kick();
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::kick()
{
  const double half = 0.5 * update->dt;
  for (int i = 0; i < atom->nlocal; i++)
    if (in_group(i)) {
      const double scale = half * EVP::scene::inverse_mass(atom, force, i);
      for (int c = 0; c < 3; c++) atom->v[i][c] += scale * atom->f[i][c];
    }
}

/* ----------------------------------------------------------------------
   h: the time over which the damping acts, the step or its second half
------------------------------------------------------------------------- */

void FixNVEEVP::solve_and_apply(double h)
{
  dt_applied = update->dt;
  applied.clear();
  v_init(vflag_now);
  if (!pair->damps_implicitly()) return;

  last_iterations = solve(h);
  most_iterations = std::max(most_iterations, last_iterations);
  all_iterations += last_iterations;
  solves++;

  store_applied(h);
  double *f = atom->f[0];
  for (size_t k = 0; k < applied.size(); k++) f[k] += applied[k];
  tally_virial();
}

/* ---------------------------------------------------------------------- */

void FixNVEEVP::remove_applied()
{
  double *f = atom->f[0];
  for (size_t k = 0; k < applied.size(); k++) f[k] -= applied[k];
}

/* ----------------------------------------------------------------------
   f_ID: iterations of the last solve; f_ID[1], f_ID[2]: their mean and maximum in this run
------------------------------------------------------------------------- */

double FixNVEEVP::compute_scalar()
{
  return last_iterations;
}

/* ---------------------------------------------------------------------- */

double FixNVEEVP::compute_vector(int n)
{
  if (n == 1) return most_iterations;
  return solves ? (double) all_iterations / solves : 0.0;
}

/* ---------------------------------------------------------------------- */

double FixNVEEVP::memory_usage()
{
  double bytes = (double) dampers.capacity() * sizeof(Damper);
  bytes += (double) damper_rows.capacity() * sizeof(EVP::PackedRow);
  bytes += movers.memory_usage() + connected.memory_usage() + bodies.memory_usage() +
      solves_of_bodies.memory_usage();
  for (const Nodal *nodal :
       {&damper_scale, &last_turning, &rate_before, &rate_now, &velocities, &reaction, &applied,
        &lowest, &last_force, &mobility, &inertia, &prescribed, &undamped, &change, &velocity,
        &residual, &direction, &direction_product})
    bytes += (double) nodal->capacity() * sizeof(double);
  return bytes;
}
