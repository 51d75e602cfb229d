// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/damping/damping_solver.h"

#include "lammps/base/collective.h"
#include "lammps/base/scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace EVP {

// of the correction of rotation; with more, pairs rotate too much in a step
static constexpr int MOST_PASSES = 20;
static constexpr double WARN_ABOVE = 10.0;    // tolerances; round-off may leave one or two

void DampingSolver::find_bodies(const PairData &pair_data, int groupbit)
{
  const PairLists &list = pair_data.packed_pairs();
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  bodies_build = list.common_build;
  bodies.clear(nall);
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (pair_data.implicit_gamma(p) > 0.0)
      bodies.add(p.i, atom->mask[p.i] & groupbit, p.j, atom->mask[p.j] & groupbit);
  });
  labels.resize(nall);
  for (int i = 0; i < nlocal; i++) labels[i][0] = (double) atom->tag[bodies.root(i)];
  ghosts.forward_comm(labels);

  bodies.find_links(labels, nlocal, links);
  int here = (int) links.size();
  const int all = reduce_all(here, MPI_SUM, world);
  int before = 0;
  MPI_Scan(&here, &before, 1, MPI_INT, MPI_SUM, world);
  links.insert(links.begin(), before - here, Bodies::Link{});
  links.resize(all);
  MPI_Allreduce(MPI_IN_PLACE, links.data(), 2 * all, MPI_DOUBLE, MPI_SUM, world);
  bodies.number(labels, nlocal, links);
}

int DampingSolver::solve(double h_in, int groupbit, const AtomValues &prescribed,
                         AtomValues &applied)
{
  h = h_in;
  const int nlocal = atom->nlocal;
  velocities.resize(nlocal + atom->nghost);
  for (AtomValues *values : {&mobility, &inertia, &direction, &direction_product})
    values->assign(nlocal, 0.0);
  for (AtomValues *values : {&undamped, &change, &residual, &applied}) values->resize(nlocal);
  for (int i = 0; i < nlocal; i++)
    if (atom->mask[i] & groupbit) {
      const double w = scene::inverse_mass(atom, force, i);
      std::fill_n(mobility[i], 3, w);
      std::fill_n(inertia[i], 3, 1.0 / w);
    }
  const size_t n = change.numbers();
  const double *v = atom->v[0], *f = atom->f[0];
  for (size_t k = 0; k < n; k++) undamped.flat(k) = v[k] + h * mobility.flat(k) * f[k];

  // Start from the damper forces of the last step along the present pairs: like those of every iterate
  // they have neither momentum nor angular momentum.
  reaction.assign(velocities.size(), 0.0);
  dampers.add_last_forces(reaction);
  ghosts.reverse_comm(reaction);
  for (size_t k = 0; k < n; k++) {
    change.flat(k) = h * mobility.flat(k) * reaction.flat(k);
    residual.flat(k) = -h * reaction.flat(k);
  }
  exchange_velocities(prescribed);
  dampers.multiply_rotating(velocities, reaction, update->dt);
  subtract_damping();

  int iterations = 0;
  for (int pass = 1; pass <= MOST_PASSES; pass++) {
    iterations = iterate(iterations);

    // T, and with it the residual, from the velocities found
    exchange_velocities(prescribed);
    most_rotated = std::max(most_rotated, dampers.rotate(velocities, reaction, update->dt));
    for (size_t k = 0; k < n; k++) residual.flat(k) = -inertia.flat(k) * change.flat(k);
    subtract_damping();
    for (size_t k = 0; k < n; k++) applied.flat(k) = -reaction.flat(k);
    cg.restart();
    if (meets_tolerance()) break;

    // damper forces are the sum of along and rotation, whose rounding no solve can go below
    noise.assign(nlocal, 0.0);
    dampers.add_noise(noise);
    for (int i = 0; i < nlocal; i++) noise[i] *= 2.0 * h * h * mobility[i][0];
    cg.restart();
    cg.add_round_off(noise);
    if (meets_tolerance()) break;
    if (pass < MOST_PASSES || passes_warned) continue;
    const double worst = reduce_all(cg.worst(), MPI_MAX, world);
    if (!(worst > WARN_ABOVE) || std::exchange(passes_warned, true) || comm->me) continue;
    error->warning(FLERR,
                   "{}: the damping of pairs that rotate within a step is far above its tolerance "
                   "after {} passes (residual {:.3g} of it), at step {} with timestep {:.6g}: "
                   "reduce the timestep (said once a "
                   "run)",
                   who, MOST_PASSES, worst, update->ntimestep, update->dt);
  }
  for (size_t k = 0; k < n; k++)
    if (mobility.flat(k) > 0.0)
      applied.flat(k) = (undamped.flat(k) + change.flat(k) - v[k]) / (h * mobility.flat(k)) - f[k];
  return iterations;
}

// Collective. Those of the group as found, all others as prescribed.
void DampingSolver::exchange_velocities(const AtomValues &prescribed)
{
  for (size_t k = 0; k < change.numbers(); k++)
    velocities.flat(k) = mobility.flat(k) > 0.0 ? undamped.flat(k) + change.flat(k)
                                                : prescribed.flat(k);
  ghosts.forward_comm_velocities(velocities);
}

// Collective. The reaction from the residual; M^-1 residual takes the place of the velocities. Held atoms
// need no branch: their mobility, hence every direction, is zero.
void DampingSolver::subtract_damping()
{
  ghosts.reverse_comm(reaction);
  for (size_t k = 0; k < change.numbers(); k++) {
    residual.flat(k) -= h * reaction.flat(k);
    velocities.flat(k) = mobility.flat(k) * residual.flat(k);
  }
}

int DampingSolver::iterate(int iteration)
{
  const CgArrays arrays = {mobility.data(),   inertia.data(),   change.data(),
                           residual.data(),   direction.data(), direction_product.data(),
                           velocities.data(), reaction.data()};
  cg.start(bodies, arrays, undamped.data(), h, tolerance);
  for (;; iteration++) {
    ghosts.forward_comm(velocities);
    dampers.multiply(velocities, reaction);
    ghosts.reverse_comm(reaction);
    if (meets_tolerance()) return iteration;
    if (iteration == max_iterations) {
      const double worst = reduce_all(cg.worst(), MPI_MAX, world);
      error->all(FLERR,
                 "{}: the damping did not converge in {} iterations at step {} (residual {:.3g} of "
                 "the tolerance): reduce the timestep, or raise maxiter",
                 who, iteration, update->ntimestep, worst);
    }
    cg.update();
  }
}

// Collective. Does every body?
bool DampingSolver::meets_tolerance()
{
  using State = ConjugateGradients::State;
  cg.gather();
  MPI_Allreduce(MPI_IN_PLACE, cg.sums(), cg.shared_sums(), MPI_DOUBLE, MPI_SUM, world);
  const State state = cg.judge();
  if (state == State::NOT_FINITE)
    error->all(FLERR,
               "{}: non-finite (NaN or Inf) velocities or forces at step {} with timestep {:.6g}: "
               "the timestep is above the limit (see compute evp/dt), or the motion too fast for "
               "it (see fix dt/evp)",
               who, update->ntimestep, update->dt);
  return state == State::CONVERGED;
}

double DampingSolver::largest_rotation()
{
  const double rotated = reduce_all(most_rotated, MPI_MAX, world);
  most_rotated = 0.0;
  return 2.0 * std::sqrt(rotated);
}

}    // namespace EVP
