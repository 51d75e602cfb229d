/* SPDX-License-Identifier: GPL-2.0-only

   Compute evp/dt: the steps. The matrices that they follow from are in compute_evp_dt_network.cpp. */

#include "compute_evp_dt.h"

#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

double ComputeEVPDt::root_of(double a, double b)
{
  const double sum = b + std::sqrt(b * b + 4.0 * a);
  return sum > 0.0 ? 4.0 / sum : NO_LIMIT;
}

/* ---------------------------------------------------------------------- */

ComputeEVPDt::ComputeEVPDt(LAMMPS *lmp, int narg, char **arg) :
    NodalExchange(lmp, narg, arg), pair(nullptr), computed_step(-1), warned(false),
    unsettled_warned(false)
{
  if (narg != 3)
    error->all(FLERR, "Compute {} evp/dt takes no further words, got '{}'", id, arg[3]);
  scalar_flag = vector_flag = 1;
  extscalar = extvector = 0;
  size_vector = 5;
  dynamic_group_allow = 0;
  vector = new double[size_vector];
  for (int k = 0; k < size_vector; k++) vector[k] = 0.0;
}

/* ---------------------------------------------------------------------- */

ComputeEVPDt::~ComputeEVPDt()
{
  delete[] vector;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::init()
{
  pair = PairNetwork::require(force, error, fmt::format("Compute {} evp/dt", id));
  warned = unsettled_warned = false;
  computed_step = -1;
}

/* ----------------------------------------------------------------------
   before the first step: a step above the limit runs, but not unnoticed
------------------------------------------------------------------------- */

void ComputeEVPDt::setup()
{
  // a fix dt/evp has yet to set the step; it asks then
  if (update->whichflag == 1 && !EVP::scene::find_fix(modify, "dt/evp")) warn_of_step();
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::warn_of_step()
{
  if (warned) return;
  warned = true;
  const double limit = compute_scalar();
  if (update->dt > limit && comm->me == 0)
    error->warning(
        FLERR,
        "The step {:.6g} is {:.4g} times the largest stable step {:.6g} of compute {} "
        "evp/dt: the run is unstable, or silently wrong; use a timestep of at most {:.4g}",
        update->dt, update->dt / limit, limit, id, 0.8 * limit);
}

/* ---------------------------------------------------------------------- */

double ComputeEVPDt::compute_scalar()
{
  compute_vector();
  invoked_scalar = update->ntimestep;
  scalar = all_implicit() ? vector[2] : vector[1];
  return scalar;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::compute_vector()
{
  // set-up, thermo and fix dt/evp may all ask at one step
  if (update->whichflag != 0 && computed_step == update->ntimestep) return;
  computed_step = update->ntimestep;
  invoked_vector = update->ntimestep;
  collect_links();

  const double lambda_k = largest_eigenvalue({1.0, 1.0, 0.0});
  const double lambda_c = largest_eigenvalue({0.0, 0.0, 1.0});
  const double lambda_across = largest_eigenvalue({0.0, 1.0, 0.0});
  const double lambda_axial = lambda_across > 0.0 ? largest_eigenvalue({1.0, 0.0, 0.0}) : lambda_k;

  vector[0] = root_of(lambda_k, 0.0);
  vector[1] = explicit_step(lambda_k, lambda_c);
  vector[2] = implicit_step(lambda_axial, lambda_across);
  vector[3] = paper_step();
  vector[4] = row_sum_step();
}

/* ----------------------------------------------------------------------
   does fix nve/evp integrate all the free atoms that interact?
------------------------------------------------------------------------- */

bool ComputeEVPDt::all_implicit() const
{
  const Fix *implicit = EVP::scene::find_fix(modify, "nve/evp");
  const int bit = implicit ? implicit->groupbit : 0;
  int outside = 0, any;
  for (const Link &link : links)
    for (const int i : {link.i, link.j})
      if (is_free(i) && !(atom->mask[i] & bit)) outside = 1;
  MPI_Allreduce(&outside, &any, 1, MPI_INT, MPI_MAX, world);
  return implicit && !any;
}

/* ---------------------------------------------------------------------- */

bool ComputeEVPDt::is_free(int i) const
{
  return atom->mask[i] & groupbit;
}

/* ----------------------------------------------------------------------
   dt with lambda_max(M^-1 (dt^2 K + 2 dt C)) = 4. The root with the two largest
   eigenvalues taken apart is below it, and where damping and stiffness peak in
   different modes by much; each correction lies between those of a pure
   stiffness and of a pure damper
------------------------------------------------------------------------- */

double ComputeEVPDt::explicit_step(double lambda_k, double lambda_c)
{
  double dt = root_of(lambda_k, lambda_c);
  if (lambda_c == 0.0) return dt;
  for (int it = 0; it < 10; it++) {
    const double stiff = dt * dt * lambda_k, viscous = 2.0 * dt * lambda_c;
    const double value = largest_eigenvalue({dt * dt, dt * dt, 2.0 * dt});
    const double power = (2.0 * stiff + viscous) / (stiff + viscous);
    dt *= std::pow(4.0 / value, 1.0 / power);
    if (std::fabs(value / 4.0 - 1.0) < 10.0 * TOLERANCE) return dt;
  }
  return root_of(lambda_k, lambda_c);    // below the limit in any case
}

/* ----------------------------------------------------------------------
   sufficient for dt^2 K <= 4 M + 2 dt C: with C >= a K_axial,
   (dt^2 - 2 a dt) lambda_axial + dt^2 lambda_across <= 4 where dt >= 2 a, and
   dt^2 lambda_across <= 4 below, where the damping outweighs the axial stiffness
------------------------------------------------------------------------- */

double ComputeEVPDt::implicit_step(double lambda_axial, double lambda_across) const
{
  double here = NO_LIMIT, a;
  for (const Link &link : links)
    if (link.axial > 0.0) here = std::min(here, link.damping / link.axial);
  MPI_Allreduce(&here, &a, 1, MPI_DOUBLE, MPI_MIN, world);

  const double sum = lambda_axial + lambda_across;
  if (sum == 0.0) return NO_LIMIT;
  if (a * a * lambda_across > 1.0) return root_of(lambda_across, 0.0);
  const double b = a * lambda_axial;
  return (b + std::sqrt(b * b + 4.0 * sum)) / sum;
}

/* ----------------------------------------------------------------------
   eqs. 6 and 7: overlap of 0.3, deq = R_i + R_j; knows neither coordination nor gamma
------------------------------------------------------------------------- */

double ComputeEVPDt::paper_step() const
{
  double here = NO_LIMIT, dt;
  const EVP::PairList &list = pair->packed_pairs();
  for (const auto &row : list.rows)
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &packed_pair = list.pairs[n];
      const int i = row.i, j = packed_pair.j;
      if (!is_free(i) && !is_free(j)) continue;
      const EVP::PairGeometry g(EVP::scene::rows(atom->x), i, j);
      if (g.dsq > packed_pair.cutsq) continue;
      const double k =
          pair->law_of(packed_pair).first_stiffness(0.7, atom->radius[i] + atom->radius[j]);
      const double w = std::max(EVP::scene::inverse_mass(atom, force, i),
                                EVP::scene::inverse_mass(atom, force, j));
      if (k > 0.0) here = std::min(here, 1.0 / std::sqrt(k * w));
    }
  MPI_Allreduce(&here, &dt, 1, MPI_DOUBLE, MPI_MIN, world);
  return dt;
}

/* ---------------------------------------------------------------------- */

double ComputeEVPDt::memory_usage()
{
  return (double) links.capacity() * sizeof(Link) +
      (double) (motion.capacity() + reaction.capacity()) * sizeof(double);
}
