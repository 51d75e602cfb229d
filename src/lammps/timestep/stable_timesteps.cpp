// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/timestep/stable_timesteps.h"

#include "lammps/base/collective.h"
#include "lammps/base/per_atom.h"
#include "lammps/base/scene.h"

#include "comm.h"
#include "compute.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace EVP {

// positive root of dt^2 a + 2 dt b = 4 (velocity Verlet with damping at half-step velocities)
double StableTimesteps::root_of(double a, double b)
{
  const double sum = b + std::sqrt(b * b + 4.0 * a);
  return sum > 0.0 ? 4.0 / sum : NO_LIMIT;
}

void StableTimesteps::linearise(const PairData &pair_data, const FreeAtoms &free)
{
  stiffest = -1.0;
  all_converged = true;
  set_atoms(free);
  implicit_groupbits = pair_data.implicit_groupbits();
  linear.nreact = pair_data.packed_pairs().nreact;
  set_pairs(pair_data);
  pair_data.effects.for_each([this](Effect &one) {
    one.add_stiffness(linear);
  });
  linear.find_springs_above_density();
  least_damping = NO_LIMIT;
  bool damped = false, undamped = false;
  for (size_t k = 0; k < linear.links.size(); k++) {
    auto &link = linear.links[k];
    link.across = std::max(0.0, link.across);    // compression takes none away
    damped = damped || link.damping > 0.0;
    undamped = undamped || linear.undamped(k) > 0.0;
    if (link.damping > 0.0 && linear.most_axial(k) > 0.0)
      least_damping = std::min(least_damping, link.damping / linear.most_axial(k));
  }
  least_damping = reduce_all(least_damping, MPI_MIN, world);
  any_damped = on_any(damped, world);
  any_undamped = on_any(undamped, world);
}

void StableTimesteps::set_atoms(const FreeAtoms &free)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  linear.inverse_mass.assign(nall, 0.0);
  for (int i = 0; i < nall; i++)
    if (free.has(atom->mask[i])) linear.inverse_mass[i] = scene::inverse_mass(atom, force, i);
  // any start will do; this one is the same on every number of MPI ranks
  linear.start.assign(nlocal, 0.0);
  for (int i = 0; i < nlocal; i++)
    for (int c = 0; c < 3 && linear.is_free(i); c++) {
      uint64_t z = 0x9e3779b97f4a7c15ULL * (3 * (uint64_t) atom->tag[i] + c + 1);
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
      linear.start[i][c] = (double) ((z ^ (z >> 27)) >> 11) * 0x1.0p-53 - 0.5;
    }
}

void StableTimesteps::set_pairs(const PairData &pair_data)
{
  linear.links.clear();
  linear.densities.clear();
  linear.links.reserve(pair_data.packed_pairs().size());
  for_each_pair(pair_data.packed_pairs(), scene::rows(atom->x), [&](const PlacedPair &p) {
    if ((!linear.is_free(p.i) && !linear.is_free(p.j)) || !p.acts()) return;
    const PairLaw &law = pair_data.law_of(p);
    // never below the stiffness where either regime begins: a pair may be back in the first regime, or in a stiffer
    // second one, within a step
    const PairState state = pair_data.state_of(p);
    linear.links.push_back({p.i, p.j, p.direction(), state.stiffness_ahead,
                            -state.force / p.distance(), law.gamma + pair_data.implicit_gamma(p)});
  });
}

double StableTimesteps::largest_eigenvalue(const StiffnessMatrix::Mix &mix)
{
  const LanczosResult found = linear.largest_eigenvalue(mix, TOLERANCE, MAX_ITERATIONS);
  all_converged = all_converged && found.converged;
  return found.eigenvalue;
}

double StableTimesteps::lambda_k()
{
  if (stiffest < 0.0) stiffest = largest_eigenvalue({1.0, 1.0, 0.0, 1.0});
  return stiffest;
}

// does fix nve/evp integrate all the free atoms that interact?
bool StableTimesteps::all_implicit() const
{
  if (!implicit_groupbits) return false;
  bool outside = false;
  for (const auto &link : linear.links)
    for (const int i : {link.i, link.j})
      if (linear.is_free(i) && !(atom->mask[i] & implicit_groupbits)) outside = true;
  return !on_any(outside, world);
}

// dt with lambda_max(M^-1 (dt^2 K + 2 dt C)) = 4. The root with the two largest eigenvalues taken
// apart is below it, and where damping and stiffness peak in different modes by much; each correction
// lies between those of a pure stiffness and of a pure damper
double StableTimesteps::explicit_dt()
{
  const double lambda_k = this->lambda_k();
  const double lambda_c = largest_eigenvalue({0.0, 0.0, 1.0});
  double dt = root_of(lambda_k, lambda_c);
  if (lambda_c == 0.0) return dt;
  for (int it = 0; it < 10; it++) {
    const double stiff = dt * dt * lambda_k, viscous = 2.0 * dt * lambda_c;
    const double value = largest_eigenvalue({dt * dt, dt * dt, 2.0 * dt, dt * dt});
    const double power = (2.0 * stiff + viscous) / (stiff + viscous);
    dt *= std::pow(4.0 / value, 1.0 / power);
    if (std::fabs(value / 4.0 - 1.0) < ACCURACY) return dt;
  }
  return root_of(lambda_k, lambda_c);    // below the limit in any case
}

// of links across, and of those without damping
static constexpr StiffnessMatrix::Mix AXIAL = {1.0, 0.0, 0.0, 1.0},
                                      REST = {0.0, 1.0, 0.0, 0.0, 1.0};

double StableTimesteps::implicit_dt()
{
  // forces are round-off
  const bool is_at_rest = highest_row_sum(REST) < 1e-12 * highest_row_sum(AXIAL);
  const double rest = is_at_rest ? 0.0 : largest_eigenvalue(REST);
  const double axial = rest > 0.0 ? largest_eigenvalue(AXIAL) : lambda_k();
  return implicit_dt(axial, rest, !linear.densities.empty() || any_undamped ? undamped_dt() : 0.0);
}

double StableTimesteps::bound() const
{
  if (!all_implicit()) return row_sum_dt();
  return implicit_dt(highest_row_sum(AXIAL), highest_row_sum(REST), row_sum_dt(false));
}

// sufficient for dt^2 K <= 4 M + 2 dt C: with C >= a K_axial of the damped links, the volume energy included,
// (dt^2 - 2 a dt) lambda_axial + dt^2 lambda_rest <= 4 where dt >= 2 a, and dt^2 lambda_rest <= 4
// below, where the damping outweighs the axial stiffness. undamped: where damping is weak the bound falls below the limit
// without any
double StableTimesteps::implicit_dt(double lambda_axial, double lambda_rest, double undamped) const
{
  const double a = least_damping, sum = lambda_axial + lambda_rest;
  if (sum == 0.0) return NO_LIMIT;
  if (a * a * lambda_rest > 1.0) return std::max(undamped, root_of(lambda_rest, 0.0));
  const double b = a * lambda_axial;
  return std::max(undamped, (b + std::sqrt(b * b + 4.0 * sum)) / sum);
}

double StableTimesteps::highest_row_sum(const StiffnessMatrix::Mix &mix) const
{
  double here = 0.0;
  for (const double sum : linear.row_sums(mix)) here = std::max(here, sum);
  return reduce_all(here, MPI_MAX, world);
}

double StableTimesteps::paper_dt(const PairData &pair_data) const
{
  double shortest = NO_LIMIT;
  for_each_pair(pair_data.packed_pairs(), scene::rows(atom->x), [&](const PlacedPair &p) {
    if ((!linear.is_free(p.i) && !linear.is_free(p.j)) || !p.acts()) return;
    const double sum_radii = atom->radius[p.i] + atom->radius[p.j];
    const double k = pair_data.law_of(p).first_stiffness(0.7, sum_radii);
    const double w =
        std::max(scene::inverse_mass(atom, force, p.i), scene::inverse_mass(atom, force, p.j));
    if (k > 0.0) shortest = std::min(shortest, 1.0 / std::sqrt(k * w));
  });
  return reduce_all(shortest, MPI_MIN, world);
}

double StableTimesteps::row_sum_dt(bool with_damping) const
{
  const AtomValues k = linear.row_sums({1.0, 1.0, 0.0, 1.0});
  AtomValues c(3, k.size());
  if (with_damping && any_damped) c = linear.row_sums({0.0, 0.0, 1.0});
  double here = NO_LIMIT;
  for (size_t n = 0; n < k.numbers(); n++) here = std::min(here, root_of(k.flat(n), c.flat(n)));
  return reduce_all(here, MPI_MIN, world);
}

namespace {

  // Thermostats and barostats, limits of the displacement and the like change nothing in what timestep is stable
  bool moves_each_atom_freely(const Fix *fix)
  {
    for (const char *pattern : {"^rigid", "^poems", "^brownian"})    // several as one; no inertia
      if (utils::strmatch(fix->style, pattern)) return false;
    return scene::integrates_atoms(fix);
  }

  // Those that follow the forces on them.
  StableTimesteps::FreeAtoms find_free(Modify *modify)
  {
    StableTimesteps::FreeAtoms free = {0};
    for (const Fix *fix : modify->get_fix_list())
      if (moves_each_atom_freely(fix))
        free.groups |= fix->groupbit;
      else if (fix->time_integrate || scene::holds_atoms(fix))
        free.held_groups |= fix->groupbit;
    return free;
  }

  /// Exchanges values as compute evp/dt does, without being one of the computes of the input script.
  struct Exchange : public WithPerAtomComm<Compute> {
    using WithPerAtomComm::WithPerAtomComm;
    void init() override {}
  };

}    // namespace

void warn_of_timestep(LAMMPS *lmp, const PairData &pair_data)
{
  const Update *const update = lmp->update;
  // with respa the pair style has a step of its own
  const bool is_set = utils::strmatch(update->integrate_style, "^respa") ||
      scene::find_fix(lmp->modify, "dt/evp") || scene::find_fix(lmp->modify, "dt/reset");
  const StableTimesteps::FreeAtoms free = find_free(lmp->modify);
  if (is_set || !free.groups || !scene::makes_steps(lmp)) return;
  char words[][16] = {"timestep_check", "all", "evp/dt"};
  char *arg[] = {words[0], words[1], words[2]};
  Exchange exchange(lmp, 3, arg);
  StableTimesteps limits(lmp, exchange);
  limits.linearise(pair_data, free);
  const bool implicit = limits.all_implicit();
  const double dt = update->dt;    // most runs are spared the eigenvalues
  if (dt <= limits.row_sum_dt(!implicit) || (!implicit && limits.is_stable_explicitly(dt))) return;
  const double limit = limits.limit();
  if (dt > (1.0 + StableTimesteps::ACCURACY) * limit && lmp->comm->me == 0)
    lmp->error->warning(FLERR,
                        "Pair evp/lj: the timestep {:.6g} is {:.4g} times the largest stable "
                        "timestep {:.6g}: the run is unstable, or silently wrong; fix dt/evp sets "
                        "the timestep, compute evp/dt shows the limit",
                        dt, dt / limit, limit);
}

}    // namespace EVP
