// SPDX-License-Identifier: GPL-2.0-only

#include "damping_solver.h"

#include "collective.h"
#include "scene.h"

#include <algorithm>
#include <cmath>

namespace EVP {

// of the correction of turning; beyond, pairs turn too far in a step
static constexpr int MOST_PASSES = 20;

int DampingSolver::solve(double h_in, int groupbit, const Nodal &prescribed_in, Nodal &applied)
{
  h = h_in;
  prescribed = &prescribed_in;
  const int nlocal = atom->nlocal;
  const size_t n = (size_t) 3 * nlocal;
  velocities.resize(n + (size_t) 3 * atom->nghost);
  for (Nodal *nodal : {&mobility, &inertia, &direction, &direction_product}) nodal->assign(n, 0.0);
  for (Nodal *nodal : {&undamped, &change, &residual, &applied}) nodal->resize(n);
  for (int i = 0; i < nlocal; i++)
    if (atom->mask[i] & groupbit) {
      const double w = scene::inverse_mass(atom, force, i);
      std::fill_n(&mobility[(size_t) 3 * i], 3, w);
      std::fill_n(&inertia[(size_t) 3 * i], 3, 1.0 / w);
    }
  const double *v = atom->v[0], *f = atom->f[0];
  for (size_t k = 0; k < n; k++) undamped[k] = v[k] + h * mobility[k] * f[k];
  warm_start();

  int iterations = 0;
  for (int pass = 1;; pass++) {
    iterations = iterate(iterations);
    if (turning_settled(applied) || pass == MOST_PASSES) break;
  }
  for (size_t k = 0; k < n; k++)
    if (mobility[k] > 0.0) applied[k] = (undamped[k] + change[k] - v[k]) / (h * mobility[k]) - f[k];
  prescribed = nullptr;
  return iterations;
}

// change: by the damper forces of the last step along the present pairs: like those of every
// iterate they have neither momentum nor angular momentum. Residual to match.
void DampingSolver::warm_start()
{
  reaction.assign(velocities.size(), 0.0);
  dampers.add_last_forces(reaction);
  exchange.to_owners(reaction);
  for (size_t k = 0; k < change.size(); k++) {
    residual[k] = mobility[k] > 0.0 ? -h * reaction[k] : 0.0;
    change[k] = h * mobility[k] * reaction[k];
  }
  exchange_velocities();
  dampers.multiply_turning(velocities, reaction, update->dt);
  exchange.to_owners(reaction);
  for (size_t k = 0; k < change.size(); k++)
    if (mobility[k] > 0.0) residual[k] -= h * reaction[k];
}

// Held atoms need no branch: their mobility, hence every direction, and their inertia are zero.
int DampingSolver::iterate(int iteration)
{
  const CgArrays arrays = {mobility.data(),   inertia.data(),   change.data(),
                           residual.data(),   direction.data(), direction_product.data(),
                           velocities.data(), reaction.data()};
  for (size_t k = 0; k < change.size(); k++) velocities[k] = mobility[k] * residual[k];
  solves.start(bodies, arrays, undamped.data(), h, tolerance);
  for (;; iteration++) {
    exchange.to_ghosts(velocities);
    dampers.multiply(velocities, reaction);
    exchange.to_owners(reaction);
    if (judge_residuals() == BodySolves::State::CONVERGED) break;
    if (iteration == max_iterations) {
      const double worst = reduce_all(solves.worst(), MPI_MAX, world);
      error->all(FLERR,
                 "{}: the damping did not converge in {} iterations at step {} (residual {:.3g} of "
                 "the tolerance): reduce the timestep, or raise maxiter",
                 who, iteration, update->ntimestep, worst);
    }
    solves.update();
  }
  return iteration;
}

// Collective. Takes T from the velocities found, and with it the damper forces and the residual; does
// that meet the tolerance still?
bool DampingSolver::turning_settled(Nodal &applied)
{
  exchange_velocities();
  most_turned = std::max(most_turned, dampers.turn(velocities, reaction, update->dt));
  exchange.to_owners(reaction);
  for (size_t k = 0; k < change.size(); k++) {
    applied[k] = -reaction[k];
    residual[k] = mobility[k] > 0.0 ? -inertia[k] * change[k] - h * reaction[k] : 0.0;
    velocities[k] = mobility[k] * residual[k];
  }
  solves.restart();
  if (judge_residuals() == BodySolves::State::CONVERGED) return true;

  // damper forces are the sum of along and turning, whose rounding no solve can go below
  dampers.for_each_sum_of_squares([this](int i, double sum) {
    const int body = bodies.body_of(i);
    if (body >= 0) solves.add_to_floor(body, 2.0 * h * h * mobility[(size_t) 3 * i] * sum);
  });
  solves.restart();
  return judge_residuals() == BodySolves::State::CONVERGED;
}

BodySolves::State DampingSolver::judge_residuals()
{
  solves.gather();
  MPI_Allreduce(MPI_IN_PLACE, solves.sums(), solves.shared_sums(), MPI_DOUBLE, MPI_SUM, world);
  const BodySolves::State state = solves.judge();
  if (state == BodySolves::State::NOT_FINITE)
    error->all(FLERR,
               "{}: non-finite (NaN or Inf) velocities or forces at step {} with timestep {:.6g}: "
               "the timestep is above the limit (see compute evp/dt), or the motion too fast for "
               "it (see fix dt/evp)",
               who, update->ntimestep, update->dt);
  return state;
}

// Collective. Those of the group as found, all others as prescribed.
void DampingSolver::exchange_velocities()
{
  for (size_t k = 0; k < change.size(); k++)
    velocities[k] = mobility[k] > 0.0 ? undamped[k] + change[k] : (*prescribed)[k];
  exchange.velocities_to_ghosts(velocities);
}

double DampingSolver::take_largest_turn()
{
  const double turned = reduce_all(most_turned, MPI_MAX, world);
  most_turned = 0.0;
  return 2.0 * std::sqrt(turned);
}

}    // namespace EVP
