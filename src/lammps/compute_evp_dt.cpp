// SPDX-License-Identifier: GPL-2.0-only

#include "compute_evp_dt.h"

#include "collective.h"
#include "scene.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

using namespace LAMMPS_NS;

static constexpr double TOLERANCE = 1.0e-4;    // of an eigenvalue; half of it in dt
static constexpr int MAX_ITERATIONS = 500;

// positive root of dt^2 a + 2 dt b = 4 (velocity Verlet with damping at half-step velocities)
static double root_of(double a, double b)
{
  const double sum = b + std::sqrt(b * b + 4.0 * a);
  return sum > 0.0 ? 4.0 / sum : ComputeEVPDt::NO_LIMIT;
}

ComputeEVPDt::ComputeEVPDt(LAMMPS *lmp, int narg, char **arg) :
    NodalExchange(lmp, narg, arg), linear(*this)
{
  if (narg != 3) error->all(FLERR, "{}: unexpected argument '{}'", who, arg[3]);
  scalar_flag = vector_flag = 1;
  extscalar = extvector = 0;
  size_vector = 5;
  dynamic_group_allow = 0;
  vector = new double[size_vector]();
}

void ComputeEVPDt::init()
{
  EVP::PairNetwork::require(force, error, who);
  limit_warned = lanczos_warned = false;
  computed_step = -1;
}

void ComputeEVPDt::setup()
{
  // a fix dt/evp has yet to set the timestep; it asks then
  if (update->whichflag == 1 && !EVP::scene::find_fix(modify, "dt/evp")) warn_of_timestep();
}

// a timestep above the limit runs, but not unnoticed
void ComputeEVPDt::warn_of_timestep()
{
  if (limit_warned) return;
  limit_warned = true;
  const double limit = compute_scalar();
  if (update->dt > limit && comm->me == 0)
    error->warning(FLERR,
                   "The timestep {:.6g} is {:.4g} times the largest stable timestep {:.6g} of "
                   "compute {} evp/dt: the run is unstable, or silently wrong; use a timestep of "
                   "at most {:.4g}",
                   update->dt, update->dt / limit, limit, id, 0.8 * limit);
}

double ComputeEVPDt::compute_scalar()
{
  compute_vector();
  invoked_scalar = update->ntimestep;
  scalar = all_implicit() ? vector[2] : vector[1];
  return scalar;
}

void ComputeEVPDt::compute_vector()
{
  // set-up, thermo and fix dt/evp may all ask at one step
  if (update->whichflag != 0 && computed_step == update->ntimestep) return;
  computed_step = update->ntimestep;
  invoked_vector = update->ntimestep;
  linearise();

  const double lambda_k = largest_eigenvalue({1.0, 1.0, 0.0, 1.0});
  const double lambda_c = largest_eigenvalue({0.0, 0.0, 1.0});
  const double lambda_across = largest_eigenvalue({0.0, 1.0, 0.0});
  const double lambda_axial = lambda_across > 0.0 ? largest_eigenvalue({1.0, 0.0, 0.0, 1.0})
                                                  : lambda_k;

  vector[0] = root_of(lambda_k, 0.0);
  vector[1] = explicit_dt(lambda_k, lambda_c);
  vector[2] = implicit_dt(lambda_axial, lambda_across);
  // where damping is weak the bound falls below the limit without any
  if (linear.with_volume) vector[2] = std::max(vector[2], vector[0]);
  vector[3] = paper_dt;
  vector[4] = row_sum_dt();
}

// The network of the present positions, and the timestep of the paper.
void ComputeEVPDt::linearise()
{
  const auto *network = EVP::PairNetwork::find_present(force);
  if (!network)
    error->all(FLERR,
               "{} needs the pairs of the current positions: print c_{} with thermo_style in a "
               "'run 0' first",
               who, id);

  take_atoms(network->volume());
  linear.nreact = network->packed_pairs().nreact(force->newton_pair);
  const std::vector<double> inv_deq = take_pairs(network);
  above_volume.clear();
  if (linear.with_volume) above_volume = linear.stiffness_above_volume(inv_deq);
}

// volume: nullptr without fix evp/volume
void ComputeEVPDt::take_atoms(const EVP::VolumeForces *volume)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  linear.with_volume = volume != nullptr;
  linear.volume_stiffness.clear();
  for (int i = 0; volume && i < nlocal; i++)
    linear.volume_stiffness.push_back(volume->stiffness(i));
  linear.inverse_mass.assign(nall, 0.0);
  for (int i = 0; i < nall; i++)
    if (atom->mask[i] & groupbit) linear.inverse_mass[i] = EVP::scene::inverse_mass(atom, force, i);
  // any start will do; this one is the same on every number of MPI ranks
  linear.start.assign((size_t) 3 * nlocal, 0.0);
  for (int i = 0; i < nlocal; i++)
    for (int c = 0; c < 3 && linear.is_free(i); c++) {
      uint64_t z = 0x9e3779b97f4a7c15ULL * (3 * (uint64_t) atom->tag[i] + c + 1);
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
      linear.start[(size_t) 3 * i + c] = (double) ((z ^ (z >> 27)) >> 11) * 0x1.0p-53 - 0.5;
    }
}

// Returns 1/deq of the links where there is a volume energy. Stiffness from the law, never below that where either
// regime begins: a pair may be back in the first regime, or in a stiffer second one, within a step
std::vector<double> ComputeEVPDt::take_pairs(const EVP::PairNetwork *network)
{
  const EVP::VolumeForces *const volume = network->volume();
  const bool flows = network->rules.flows;
  linear.links.clear();
  linear.openings.clear();
  std::vector<double> inv_deq;
  double shortest = NO_LIMIT;
  EVP::for_each_pair(
      network->packed_pairs(), EVP::scene::rows(atom->x), [&](const EVP::PlacedPair &p) {
        if ((!linear.is_free(p.i) && !linear.is_free(p.j)) || p.is_beyond()) return;
        const EVP::Law &law = network->law_of(p);
        const double d = p.distance(), deq = 1.0 / p.inv_deq;
        const double push = flows ? law.force(d, deq, p.offset) : law.force(d, deq);
        const double of_volume = volume ? volume->force(p) : 0.0;
        linear.links.push_back(
            {p.i,
             p.j,
             {p.g.dx / d, p.g.dy / d, p.g.dz / d},
             flows ? law.stiffness_ahead(d, deq, p.offset) : law.stiffness_ahead(d, deq),
             std::max(0.0, -(push + of_volume) / d),
             law.parameters().gamma + network->implicit_gamma(p)});
        if (volume) {
          linear.openings.push_back(volume->opening_of(p));
          inv_deq.push_back(p.inv_deq);
        }

        // eqs. 6 and 7: overlap of 0.3, deq = R_i + R_j; knows neither coordination nor gamma
        const double k = law.first_stiffness(0.7, atom->radius[p.i] + atom->radius[p.j]);
        const double w = std::max(EVP::scene::inverse_mass(atom, force, p.i),
                                  EVP::scene::inverse_mass(atom, force, p.j));
        if (k > 0.0) shortest = std::min(shortest, 1.0 / std::sqrt(k * w));
      });
  paper_dt = EVP::reduce_all(shortest, MPI_MIN, world);
  return inv_deq;
}

double ComputeEVPDt::largest_eigenvalue(const EVP::LinearNetwork::Mix &mix)
{
  const EVP::LanczosResult found = linear.largest_eigenvalue(mix, TOLERANCE, MAX_ITERATIONS);
  if (!found.converged && !lanczos_warned) {
    lanczos_warned = true;
    if (comm->me == 0)
      error->warning(FLERR,
                     "{}: an eigenvalue did not converge in {} iterations, the timesteps may be "
                     "too large: use c_{}[5], which is safe",
                     who, found.iterations, id);
  }
  return found.eigenvalue;
}

// does fix nve/evp integrate all the free atoms that interact?
bool ComputeEVPDt::all_implicit() const
{
  const Fix *implicit = EVP::scene::find_fix(modify, "nve/evp");
  const int bit = implicit ? implicit->groupbit : 0;
  bool outside = false;
  for (const auto &link : linear.links)
    for (const int i : {link.i, link.j})
      if (linear.is_free(i) && !(atom->mask[i] & bit)) outside = true;
  return !EVP::on_any(outside, world) && implicit;
}

// dt with lambda_max(M^-1 (dt^2 K + 2 dt C)) = 4. The root with the two largest eigenvalues taken
// apart is below it, and where damping and stiffness peak in different modes by much; each correction
// lies between those of a pure stiffness and of a pure damper
double ComputeEVPDt::explicit_dt(double lambda_k, double lambda_c)
{
  double dt = root_of(lambda_k, lambda_c);
  if (lambda_c == 0.0) return dt;
  for (int it = 0; it < 10; it++) {
    const double stiff = dt * dt * lambda_k, viscous = 2.0 * dt * lambda_c;
    const double value = largest_eigenvalue({dt * dt, dt * dt, 2.0 * dt, dt * dt});
    const double power = (2.0 * stiff + viscous) / (stiff + viscous);
    dt *= std::pow(4.0 / value, 1.0 / power);
    if (std::fabs(value / 4.0 - 1.0) < 10.0 * TOLERANCE) return dt;
  }
  return root_of(lambda_k, lambda_c);    // below the limit in any case
}

// sufficient for dt^2 K <= 4 M + 2 dt C: with C >= a K_axial, the volume energy included,
// (dt^2 - 2 a dt) lambda_axial + dt^2 lambda_across <= 4 where dt >= 2 a, and dt^2 lambda_across <= 4
// below, where the damping outweighs the axial stiffness
double ComputeEVPDt::implicit_dt(double lambda_axial, double lambda_across) const
{
  double here = NO_LIMIT;
  for (size_t k = 0; k < linear.links.size(); k++) {
    const auto &link = linear.links[k];
    const double axial = link.axial + (above_volume.empty() ? 0.0 : above_volume[k]);
    if (axial > 0.0) here = std::min(here, link.damping / axial);
  }
  const double a = EVP::reduce_all(here, MPI_MIN, world);

  const double sum = lambda_axial + lambda_across;
  if (sum == 0.0) return NO_LIMIT;
  if (a * a * lambda_across > 1.0) return root_of(lambda_across, 0.0);
  const double b = a * lambda_axial;
  return (b + std::sqrt(b * b + 4.0 * sum)) / sum;
}

double ComputeEVPDt::row_sum_dt() const
{
  const std::vector<double> k = linear.row_sums({1.0, 1.0, 0.0, 1.0});
  const std::vector<double> c = linear.row_sums({0.0, 0.0, 1.0});
  double here = NO_LIMIT;
  for (size_t n = 0; n < k.size(); n++) here = std::min(here, root_of(k[n], c[n]));
  return EVP::reduce_all(here, MPI_MIN, world);
}
