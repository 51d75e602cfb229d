/* SPDX-License-Identifier: GPL-2.0-only

   Fix nve/evp: (M + h C) v+ = M v + h F by conjugate gradients, matrix free, over all processes. */

#include "fix_nve_evp.h"

#include "core/opening.h"
#include "core/vector.h"
#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

// of the correction of turning; beyond, pairs turn too far in a step
static constexpr int MOST_PASSES = 20;

/* ----------------------------------------------------------------------
   reaction = sum of the damper forces, minus sign, for all local atoms, velocities being set for the
   local ones. rate(i, k, w, v): sqrt(gamma) times the opening rate of damper k in the row of i, whose
   atoms have the relative velocity v
------------------------------------------------------------------------- */

template <class F> void FixNVEEVP::damping_product(F &&rate)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  to_ghosts(velocities);

  const int nreact = force->newton_pair ? nall : nlocal;
  reaction.assign((size_t) 3 * nall, 0.0);
  const double *all = velocities.data();
  double *forces = reaction.data();
  for (const auto &row : damper_rows) {
    const EVP::Vector vi(all + (size_t) 3 * row.i);
    EVP::Vector yi;
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      const EVP::Vector w(damper.w);
      const EVP::Vector y = w * rate(row.i, k, w, vi - EVP::Vector(all + (size_t) 3 * damper.j));
      yi = yi + y;
      if (damper.j < nreact) y.subtract_from(forces + (size_t) 3 * damper.j);
    }
    yi.add_to(forces + (size_t) 3 * row.i);
  }
  to_owners(reaction);
}

/* ----------------------------------------------------------------------
   velocity = v* with the damper forces of the last step along the present pairs: like those of
   every iterate they have neither momentum nor angular momentum. Residual to match
------------------------------------------------------------------------- */

void FixNVEEVP::warm_start(double h)
{
  const size_t n = (size_t) 3 * atom->nlocal;
  const int nreact = force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
  Nodal &guess = reaction;
  guess.assign(velocities.size(), 0.0);
  for (const auto &row : damper_rows)
    for (int k = row.first; k < row.last; k++) {
      const Damper &damper = dampers[k];
      for (int c = 0; c < 3; c++) {
        const double force_c = last_force[damper.pair] * damper.w[c];
        guess[(size_t) 3 * row.i + c] += force_c;
        if (damper.j < nreact) guess[(size_t) 3 * damper.j + c] -= force_c;
      }
    }
  to_owners(guess);
  for (size_t k = 0; k < n; k++) {
    residual[k] = mobility[k] > 0.0 ? -h * guess[k] : 0.0;
    change[k] = h * mobility[k] * guess[k];
    velocity[k] = undamped[k] + change[k];
  }
  if (dt_turning > 0.0 && update->dt != dt_turning)
    for (double &turning : last_turning) turning *= update->dt / dt_turning;
  dt_turning = update->dt;
  exchange_velocities(velocity);
  damping_product([this](int, int k, const EVP::Vector &w, const EVP::Vector &v) {
    return dot(w, v) + last_turning[dampers[k].pair];
  });
  for (size_t k = 0; k < n; k++)
    if (mobility[k] > 0.0) residual[k] -= h * reaction[k];
}

/* ----------------------------------------------------------------------
   the velocities of the group from `of`, all others as prescribed
------------------------------------------------------------------------- */

void FixNVEEVP::exchange_velocities(const Nodal &of)
{
  for (int i = 0; i < atom->nlocal; i++)
    for (int c = 0; c < 3; c++) {
      const size_t k = (size_t) 3 * i + c;
      velocities[k] = mobility[k] > 0.0 ? of[k] : prescribed[k];
    }
}

/* ----------------------------------------------------------------------
   M (v+ - v-) = h (F - C v+ - T), T being that of v+ in the end: turning changes little from step to
   step, so that mostly the T of the last one does. Iterations
------------------------------------------------------------------------- */

int FixNVEEVP::solve(double h)
{
  const int nlocal = atom->nlocal;
  const size_t n = (size_t) 3 * nlocal;
  velocities.resize(n + (size_t) 3 * atom->nghost);
  for (Nodal *nodal : {&mobility, &inertia, &direction, &direction_product}) nodal->assign(n, 0.0);
  for (Nodal *nodal : {&undamped, &velocity, &change, &residual}) nodal->resize(n);
  for (int i = 0; i < nlocal; i++)
    if (in_group(i)) {
      const double w = EVP::scene::inverse_mass(atom, force, i);
      std::fill_n(&mobility[(size_t) 3 * i], 3, w);
      std::fill_n(&inertia[(size_t) 3 * i], 3, 1.0 / w);
    }

  const double *v = atom->v[0], *f = atom->f[0];
  prescribed.assign(v, v + n);
  if (h == update->dt)
    movers.for_each_before(atom, domain, h, [&](int i, int c, double before) {
      double &after = prescribed[(size_t) 3 * i + c];
      after = 2.0 * after - before;
    });
  for (size_t k = 0; k < n; k++) undamped[k] = v[k] + h * mobility[k] * f[k];
  warm_start(h);

  int iterations = 0;
  for (int pass = 1;; pass++) {
    iterations = iterate(h, iterations);
    if (turning_settled(h) || pass == MOST_PASSES) return iterations;
  }
}

/* ----------------------------------------------------------------------
   conjugate gradients, preconditioned by M, each body by itself: a still one does not wait in the
   residual of a violent one. M keeps the momentum of every iterate exact: pair forces have none, and
   the start carries that of M v + h F.
   The tolerance is against what the damping does, M (v - v*): a measure that knows no frame, so a
   body in flight is not solved worse than one at rest, and that does not grow with h C, as
   h C v* would (it exceeds the motion itself where damping is strong).
   Held atoms need no branch: their mobility, hence every direction, and their inertia are zero.
------------------------------------------------------------------------- */

int FixNVEEVP::iterate(double h, int iteration)
{
  const EVP::CgArrays arrays = {mobility.data(),   inertia.data(),   change.data(),
                                residual.data(),   direction.data(), direction_product.data(),
                                velocities.data(), reaction.data()};
  for (size_t k = 0; k < change.size(); k++) velocities[k] = mobility[k] * residual[k];
  solves_of_bodies.start(bodies, arrays, undamped.data(), h, tolerance);
  for (;; iteration++) {
    damping_product([](int, int, const EVP::Vector &w, const EVP::Vector &v) {
      return dot(w, v);
    });
    if (judge_residuals() == EVP::BodySolves::State::CONVERGED) break;
    if (iteration == max_iterations) {
      double worst = solves_of_bodies.worst();
      MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE, MPI_MAX, world);
      error->all(FLERR,
                 "Fix {} nve/evp: the damping did not converge in {} iterations at step {} "
                 "(residual {:.3g} of the tolerance): reduce the timestep, or raise maxiter",
                 id, iteration, update->ntimestep, worst);
    }
    solves_of_bodies.update();
  }
  for (size_t k = 0; k < change.size(); k++) velocity[k] = undamped[k] + change[k];
  return iteration;
}

/* ---------------------------------------------------------------------- */

EVP::BodySolves::State FixNVEEVP::judge_residuals()
{
  solves_of_bodies.gather();
  MPI_Allreduce(MPI_IN_PLACE, solves_of_bodies.sums(), solves_of_bodies.shared_sums(), MPI_DOUBLE,
                MPI_SUM, world);
  const EVP::BodySolves::State state = solves_of_bodies.judge();
  if (state == EVP::BodySolves::State::NOT_FINITE)
    error->all(FLERR,
               "Fix {} nve/evp: velocities or forces are not numbers any more at step {} with "
               "timestep {:.6g}: the step is above the limit (see compute evp/dt), or the motion "
               "too fast for it (see fix dt/evp)",
               id, update->ntimestep, update->dt);
  return state;
}

/* ----------------------------------------------------------------------
   collective. Takes T from the velocities found, and with it the damper forces and the residual; does
   that meet the tolerance still?
------------------------------------------------------------------------- */

bool FixNVEEVP::turning_settled(double h)
{
  const double half_dt = 0.5 * update->dt;
  double turned = 0.0;
  exchange_velocities(velocity);
  damping_product([&](int, int k, const EVP::Vector &w, const EVP::Vector &v) {
    const int p = dampers[k].pair;
    const double along = dot(w, v), inv_gamma = 1.0 / dot(w, w);
    const double half_step = half_dt * damper_scale[k];
    const double rate = EVP::opening_rate(along, dot(v, v), half_step, inv_gamma);
    turned = std::max(turned, half_step * (rate - along) * inv_gamma);
    last_turning[p] = rate - along;
    last_force[p] = -rate;
    return rate;
  });
  most_turned = std::max(most_turned, turned);

  applied.resize(change.size());
  for (size_t k = 0; k < change.size(); k++) {
    applied[k] = -reaction[k];
    residual[k] = mobility[k] > 0.0 ? -inertia[k] * change[k] - h * reaction[k] : 0.0;
    velocities[k] = mobility[k] * residual[k];
  }
  solves_of_bodies.restart();
  if (judge_residuals() == EVP::BodySolves::State::CONVERGED) return true;
  add_rounding(h);
  solves_of_bodies.restart();
  return judge_residuals() == EVP::BodySolves::State::CONVERGED;
}

/* ----------------------------------------------------------------------
   damper forces are the sum of along and turning, whose rounding no solve can go below
------------------------------------------------------------------------- */

void FixNVEEVP::add_rounding(double h)
{
  for (const auto &row : damper_rows) {
    const int body = bodies.body_of(row.i);
    if (body < 0) continue;
    double sum = 0.0;
    for (int k = row.first; k < row.last; k++) {
      const EVP::Vector w(dampers[k].w);
      const double turning = last_turning[dampers[k].pair];
      const double along = last_force[dampers[k].pair] + turning;
      sum += dot(w, w) * (along * along + turning * turning);
    }
    solves_of_bodies.add_to_floor(body, 2.0 * h * h * mobility[(size_t) 3 * row.i] * sum);
  }
}

/* ----------------------------------------------------------------------
   on the group what took v to the v+ found; elsewhere it is the reaction of the dampers
------------------------------------------------------------------------- */

void FixNVEEVP::store_applied(double h)
{
  const double *v = atom->v[0], *f = atom->f[0];
  for (size_t k = 0; k < applied.size(); k++)
    if (mobility[k] > 0.0) applied[k] = (velocity[k] - v[k]) / (h * mobility[k]) - f[k];
}
