// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/damping/fix_nve_evp.h"

#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/base/user_input.h"

#include "comm.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;
using namespace EVP;

static constexpr double LARGEST_ROTATION = 0.15;    // rad per step, see doc/fix_nve_evp.rst

// fix ID group nve/evp [tol 1e-3] [maxiter 500]
FixNVEEVP::FixNVEEVP(LAMMPS *lmp, int narg, char **arg) :
    AtomRecords(lmp, narg, arg), solver(lmp, who, *this, dampers)
{
  for_each_keyword(error, who, narg - 3, arg + 3, {"tol", "maxiter"}, " and ",
                   [this](const Keyword &word) {
                     const double value = word.number();
                     if (word.is("tol")) {
                       word.demand(value > 0.0 && value < 1.0,
                                   "must lie between 0 and 1 (residual over damping)");
                       solver.tolerance = value;
                     } else {
                       word.demand(value >= 1.0 && value <= 1.0e6 && value == std::floor(value),
                                   "must be an integer from 1 to 1e6");
                       solver.max_iterations = (int) value;
                     }
                   });

  comm_reverse = 6;    // of the virial
  time_integrate = 1;
  dynamic_group_allow = 0;
  virial_global_flag = virial_peratom_flag = thermo_virial = 1;
  scene::offer_values(this, 2);
  atom->add_callback(Atom::GROW);
}

void FixNVEEVP::init()
{
  pair_data = PairData::require(force, error, who);
  scene::refuse_respa(update, error, who);
  scene::demand_only_one(modify, error, this, who);
  if (!(update->dt > 0.0))
    error->all(FLERR, "{} needs a timestep above 0, got {:.6g}", who, update->dt);

  others_groupbits = 0;
  forces_follow = false;
  bool after_this = false;
  bool any_move = false;    // along a curve: mean velocities over a step are not those at its end
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *other = modify->fix[k];
    if (other == this) {
      after_this = true;
      continue;
    }
    if (after_this && (modify->fmask[k] & FixConst::POST_FORCE)) forces_follow = true;
    any_move = any_move || strcmp(other->style, "move") == 0;
    if (scene::integrates_atoms(other)) others_groupbits |= other->groupbit;
  }
  check_groups();
  positions_known = false;
  if (any_move && !keeps_records()) keep_records();
  powers_wanted = pair_data->effects.any(&Effect::asks_for_powers);
  rotation_warned = false;
  solver.reset();
  dampers.reset();    // another pair style may have come to the same count of builds
  last_iterations = most_iterations = 0;
  all_iterations = solves = 0;
}

// What else acts on the velocities of the group would undo the solve, or be undone by it.
void FixNVEEVP::check_groups() const
{
  for (const Fix *other : modify->get_fix_list()) {
    if (other == this || (!scene::holds_atoms(other) && !other->time_integrate)) continue;
    bool shared = false;
    for (int i = 0; i < atom->nlocal; i++)
      shared = shared || (in_group(i) && (atom->mask[i] & other->groupbit));
    if (on_any(shared, world))
      error->all(FLERR,
                 "{} and fix {} of style {} act on the same atoms: leave those that are held or "
                 "moved otherwise out of its group, and use fix nve/noforce for them",
                 who, other->id, other->style);
  }
}

// Collective. Fix move tells nobody which components are NULL: its kick is tried out, after the init() that sets its timestep.
void FixNVEEVP::find_null_moves()
{
  null_moves.clear();
  const size_t n = (size_t) 3 * atom->nlocal;
  for (Fix *move : modify->get_fix_by_style("^move$")) {
    const std::vector<double> v(atom->v[0], atom->v[0] + n), f(atom->f[0], atom->f[0] + n);
    std::fill_n(atom->v[0], n, 0.0);
    std::fill_n(atom->f[0], n, 1.0);
    move->final_integrate();
    std::array<int, 3> kicked{};
    for (size_t k = 0; k < n; k++) kicked[k % 3] |= atom->v[0][k] != 0.0;
    std::copy(v.begin(), v.end(), atom->v[0]);
    std::copy(f.begin(), f.end(), atom->f[0]);

    kicked = reduce_all(kicked, MPI_MAX, world);
    std::string components;
    for (int c = 0; c < domain->dimension; c++)
      if (kicked[c]) components += "xyz"[c];
    if (components.empty()) continue;
    null_moves.push_back({move, components});
    others_groupbits |= move->groupbit;
  }
}

// atom->v is that of the full step: half of the kick is still to come.
void FixNVEEVP::setup(int vflag)
{
  vflag_now = vflag;
  find_null_moves();
  collect_dampers();
  if (powers_wanted) find_rates(0.0);
  solve_and_apply(0.5 * update->dt);
  remember_positions();
  if (forces_follow) dt_applied = 0.0;    // solve anew with what they add to f from here on
}

void FixNVEEVP::initial_integrate(int /*vflag*/)
{
  // the damping in f belongs to another timestep, or to less force: solve its second half anew
  if (update->dt != dt_applied) {
    for (size_t k = 0; k < applied.numbers(); k++) atom->f[0][k] -= applied.flat(k);
    solve_and_apply(0.5 * update->dt);
  }
  kick(true);
  for (int i = 0; i < atom->nlocal; i++)
    if (in_group(i))
      for (int c = 0; c < 3; c++) atom->x[i][c] += update->dt * atom->v[i][c];
}

// atom->v is v-: solves for v+, and sets it to the mean of both.
void FixNVEEVP::final_integrate()
{
  collect_dampers();
  if (powers_wanted) find_rates(update->dt);
  solve_and_apply(update->dt);
  if (powers_wanted) dampers.find_mean_rates();
  remember_positions();
  kick(false);
}

// At the force evaluation, and the bodies that they connect where the list is new.
void FixNVEEVP::collect_dampers()
{
  dampers.clear();
  if (!pair_data->damps_implicitly()) return;
  const PairLists &list = pair_data->packed_pairs();
  const auto gamma_of = [this](const PackedPair &p) {
    return pair_data->implicit_gamma(p);
  };
  if (solver.bodies_are_due(list)) {
    warn_of_rotation();
    solver.find_bodies(*pair_data, groupbit);
  }
  // a bond that ends moves the numbers of pairs on its rank: both copies of a pair must start from one force
  if (pair_data->rules().has_history() && on_any(!dampers.are_of(list), world)) dampers.reset();
  dampers.collect(list, scene::rows(atom->x), gamma_of);
  if (!others_groupbits) return;

  // neighbors of the group may be held or moved along a path, but not follow forces of their own
  dampers.for_each([this](int i, const Dampers::Damper &damper, double) {
    for (const int k : {i, damper.j})
      if (!in_group(k) && (atom->mask[k] & others_groupbits)) stop_at_integrated(k);
  });
}

void FixNVEEVP::stop_at_integrated(int i) const
{
  for (const auto &[move, components] : null_moves)
    if (atom->mask[i] & move->groupbit)
      error->one(FLERR,
                 "{}: atom {} interacts with its group, but fix {} of style move integrates its "
                 "component {} by the forces (NULL), whose velocity would enter as prescribed: "
                 "prescribe the component (0.0 holds the atom), or use fix nve for the group of "
                 "fix {}, with the timestep that explicit damping allows (compute evp/dt)",
                 who, atom->tag[i], move->id, components, id);
  error->one(FLERR,
             "{}: atom {} interacts with its group but is integrated by another fix, whose "
             "velocity would enter as prescribed: put it into the group of fix {}, or move it by "
             "fix nve/noforce or fix move",
             who, atom->tag[i], id);
}

void FixNVEEVP::remember_positions()
{
  positions_known = keeps_records();
  for (int i = 0; positions_known && i < atom->nlocal; i++) set_arrays(i);
}

// Calls f(i, component, mean velocity over the last step of size dt) for all local atoms, where known.
template <class F> void FixNVEEVP::for_each_mean_velocity(double dt, F &&f) const
{
  for (int i = 0; positions_known && i < atom->nlocal; i++) {
    double x[3];
    domain->unmap(atom->x[i], atom->image[i], x);
    for (int c = 0; c < 3; c++) f(i, c, (x[c] - records[i][c]) / dt);
  }
}

// Separation rates over the last timestep dt, or now with dt = 0, from atom->v.
void FixNVEEVP::find_rates(double dt)
{
  if (!pair_data->damps_implicitly()) return;
  velocities.resize(atom->nlocal + atom->nghost);
  velocities.set_first(atom->nlocal, atom->v[0]);
  if (dt > 0.0)
    for_each_mean_velocity(dt, [this](int i, int c, double mean) {
      if (!in_group(i)) velocities[i][c] = mean;
    });
  forward_comm_velocities(velocities);
  dampers.find_rates(velocities, dt);

  image_velocities.assign(domain->deform_vremap ? velocities.size() : 0, 0.0);
  if (domain->deform_vremap) forward_comm_velocities(image_velocities);
}

double FixNVEEVP::power_of_box() const
{
  double sum = 0.0;
  if (image_velocities.empty()) return sum;
  dampers.for_each([&](int, const Dampers::Damper &damper, double along) {
    sum += dampers.share(damper) * along * dot(damper.w, Vector(image_velocities[damper.j]));
  });
  return sum;
}

// Collective, once per neighbor build and at the end of a run: fast rotation leads to builds.
void FixNVEEVP::warn_of_rotation()
{
  const double angle = solver.largest_rotation();
  if (angle <= 1.01 * LARGEST_ROTATION || std::exchange(rotation_warned, true) || comm->me) return;
  error->warning(
      FLERR,
      "{}: damped pairs rotated by more than {} rad per step, {:.3g} rad before step {}, which the "
      "damping does not resolve: reduce the timestep to {:.4g}, or use fix dt/evp",
      who, LARGEST_ROTATION, angle, update->ntimestep, update->dt * LARGEST_ROTATION / angle);
}

// after: the half step after the forces, or before
void FixNVEEVP::kick(bool after)
{
  const double half = 0.5 * update->dt;
  for (int i = 0; i < atom->nlocal; i++)
    if (in_group(i)) {
      const double scale = half * scene::inverse_mass(atom, force, i);
      for (int c = 0; c < 3; c++) atom->v[i][c] += scale * atom->f[i][c];
    }
  if (applied.empty()) return;
  pair_data->effects.for_each([&](Effect &one) {
    if (!one.takes_heat()) return;
    dampers.for_each_power(after, [&](int i, const Dampers::Damper &damper, double power) {
      one.add_heat(i, damper.j, dampers.takes_reaction(damper), half * power);
    });
  });
}

// h: the time over which the damping acts, the timestep or its second half.
void FixNVEEVP::solve_and_apply(double h)
{
  dt_applied = update->dt;
  applied.clear();
  v_init(vflag_now);
  if (!pair_data->damps_implicitly()) return;
  prescribed.resize(atom->nlocal);
  prescribed.set_first(atom->nlocal, atom->v[0]);
  if (h == update->dt)
    for_each_mean_velocity(h, [this](int i, int c, double before) {
      double &after = prescribed[i][c];
      after = 2.0 * after - before;
    });
  last_iterations = solver.solve(h, groupbit, prescribed, applied);
  most_iterations = std::max(most_iterations, last_iterations);
  all_iterations += last_iterations;
  solves++;

  for (size_t k = 0; k < applied.numbers(); k++) atom->f[0][k] += applied.flat(k);
  tally_virial();
}

// Of the damping, which the pair style left out.
void FixNVEEVP::tally_virial()
{
  if (!evflag) return;    // v_init sets no vflag_either

  AtomValues shares(6, vflag_atom ? atom->nlocal + atom->nghost : 0);
  const auto x = scene::rows(atom->x);
  dampers.for_each([&](int i, const Dampers::Damper &damper, double along) {
    const PairGeometry g(x, i, damper.j);
    const Vector f = damper.w * along;
    const double v[6] = {f.x * g.x, f.y * g.y, f.z * g.z, f.x * g.y, f.x * g.z, f.y * g.z};
    if (vflag_global)
      for (int c = 0; c < 6; c++) virial[c] += dampers.share(damper) * v[c];
    if (vflag_atom)
      for (int c = 0; c < 6; c++) {
        shares[i][c] += 0.5 * v[c];
        if (dampers.takes_reaction(damper)) shares[damper.j][c] += 0.5 * v[c];
      }
  });
  if (!vflag_atom) return;
  reverse_comm(shares);
  for (int i = 0; i < atom->nlocal; i++)
    for (int c = 0; c < 6; c++) vatom[i][c] += shares[i][c];
}
