// SPDX-License-Identifier: GPL-2.0-only

#include "timestep_check.h"

#include "collective.h"
#include "scene.h"

#include "comm.h"
#include "compute.h"

#include <vector>

namespace EVP {

namespace {

  bool is_left_to_others(const Modify *modify)
  {
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

  // Bits of groups.
  struct Movers {
    int free = 0;      // their atoms follow the forces on them
    int others = 0;    // theirs do not, or not alone
  };

  Movers find_movers(const Modify *modify)
  {
    Movers movers;
    for (int k = 0; k < modify->nfix; k++) {
      const Fix *const fix = modify->fix[k];
      if (moves_each_atom_freely(fix))
        movers.free |= fix->groupbit;
      else if (fix->time_integrate || scene::holds_atoms(fix))
        movers.others |= fix->groupbit;
    }
    return movers;
  }

  // Of own atoms, 0 for those that do not move freely.
  std::vector<double> inverse_masses(const Atom *atom, const Force *force, const Movers &movers)
  {
    std::vector<double> inverse((size_t) atom->nlocal, 0.0);
    for (int i = 0; i < atom->nlocal; i++)
      if ((atom->mask[i] & movers.free) && !(atom->mask[i] & movers.others))
        inverse[i] = scene::inverse_mass(atom, force, i);
    return inverse;
  }

  // Of pairs of a law by its index: dt^2 k deq^2 at rest, and 2 dt gamma.
  struct AtRest {
    double stiff = -1.0, viscous = 0.0;
  };

}    // namespace

// A screen at a tenth of the cost of the blocks, for most runs: no eigenvalue of the block of an atom is above
// the sum of the stiffnesses of its pairs. Those at rest are taken, and half of the limit, which leaves room for
// stiffening.
bool TimestepCheck::may_be_unstable(const std::vector<double> &inverse_mass)
{
  constexpr double HALF_OF_LIMIT = 2.0;
  const int nreact = list.nreact(force->newton_pair);
  const double dt = update->dt;
  std::vector<AtRest> laws;
  std::vector<double> values((size_t) list.nall, 0.0);
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (p.law >= (int) laws.size()) laws.resize((size_t) p.law + 1);
    AtRest &at_rest = laws[p.law];
    if (at_rest.stiff < 0.0) {
      const Law &law = coefficients.law(p.law);
      at_rest = {dt * dt * law.stiffness_ahead(1.0, 1.0), 2.0 * dt * law.parameters().gamma};
    }
    const double value = at_rest.stiff * (p.inv_deq * p.inv_deq) + at_rest.viscous;
    values[p.i] += value;
    if (p.j < nreact) values[p.j] += value;
  });
  sums.to_owners(values, 1);
  bool any = false;
  for (size_t i = 0; i < inverse_mass.size(); i++)
    any = any || inverse_mass[i] * values[i] > HALF_OF_LIMIT;
  return on_any(any, world);
}

SingleParticles TimestepCheck::linearise(bool damped) const
{
  SingleParticles particles((size_t) list.nall, damped);
  const int nreact = list.nreact(force->newton_pair);
  const bool flows = rules.flows;
  for_each_pair(list, scene::rows(atom->x), [&](const PlacedPair &p) {
    if (p.is_beyond() || atom->tag[p.i] == atom->tag[p.j]) return;
    const Law &law = coefficients.law(p.law);
    const double d = p.distance(), deq = 1.0 / p.inv_deq;
    const double u[] = {p.g.dx / d, p.g.dy / d, p.g.dz / d};
    const double push = flows ? law.force(d, deq, p.offset) : law.force(d, deq);
    if (flows && push < 0.0 && only_repels(p.cutsq, p.inv_deq)) return;
    const double axial = flows ? law.stiffness(d, deq, p.offset) : law.stiffness(d, deq);
    const double viscous = law.parameters().gamma - coefficients.gamma_elsewhere(p.law);
    particles.add(p.i, u, axial, -push / d, viscous);
    if (p.j < nreact) particles.add(p.j, u, axial, -push / d, viscous);
  });
  return particles;
}

void TimestepCheck::warn(bool damped)
{
  if (!scene::makes_steps(lmp) || is_left_to_others(modify)) return;
  const Movers movers = find_movers(modify);
  if (!movers.free) return;
  const std::vector<double> inverse_mass = inverse_masses(atom, force, movers);
  if (!may_be_unstable(inverse_mass)) return;

  SingleParticles particles = linearise(damped);
  sums.to_owners(particles.stiffness, SingleParticles::WIDTH);
  if (damped) sums.to_owners(particles.damping, SingleParticles::WIDTH);
  const double dt = update->dt;
  const double limit = reduce_all(particles.lowest_limit(inverse_mass, dt), MPI_MIN, world);
  if (limit < dt && comm->me == 0)
    error->warning(
        FLERR,
        "Pair evp/lj: the timestep {:.6g} is {:.4g} times {:.6g}, an upper limit of the stable "
        "timestep from the stiffness and damping around single atoms: the run is unstable, or "
        "silently wrong; compute evp/dt gives the limit itself, which is lower, and fix dt/evp "
        "sets the timestep",
        dt, dt / limit, limit);
}

}    // namespace EVP
