// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/timestep/compute_evp_dt.h"

#include <utility>

using namespace LAMMPS_NS;
using namespace EVP;

ComputeEVPDt::ComputeEVPDt(LAMMPS *lmp, int narg, char **arg) :
    WithPerAtomComm(lmp, narg, arg), limits(lmp, *this)
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
  PairData::require(force, error, who);
  lanczos_warned = false;
  linearised_step = -1;
}

double ComputeEVPDt::compute_scalar()
{
  linearise();
  invoked_scalar = update->ntimestep;
  scalar = limits.limit();
  warn_of_eigenvalues();
  return scalar;
}

void ComputeEVPDt::compute_vector()
{
  linearise();
  invoked_vector = update->ntimestep;
  vector[0] = limits.undamped_dt();
  vector[1] = limits.explicit_dt();
  vector[2] = limits.implicit_dt();
  vector[3] = limits.paper_dt(*PairData::find(force));
  vector[4] = limits.row_sum_dt();
  warn_of_eigenvalues();
}

// all values of a step are those of one state
void ComputeEVPDt::linearise()
{
  if (update->whichflag != 0 && linearised_step == update->ntimestep) return;
  linearised_step = update->ntimestep;
  limits.linearise(*PairData::require_present(force, error, who), {groupbit});
}

void ComputeEVPDt::warn_of_eigenvalues()
{
  if (limits.converged() || std::exchange(lanczos_warned, true) || comm->me) return;
  error->warning(FLERR,
                 "{}: an eigenvalue did not converge in {} iterations, the timesteps may be too "
                 "large: use c_{}[5], which is safe",
                 who, StableTimesteps::MAX_ITERATIONS, id);
}
