// SPDX-License-Identifier: GPL-2.0-only

#include "density_check.h"

#include "collective.h"
#include "scene.h"

#include "comm.h"
#include "math_const.h"

#include <vector>

namespace EVP {

// Density of atoms over that of the solid: one, or one over the solid fraction of a body, which is above 0.5 in a
// packing.
static constexpr double LOWEST = 0.99, HIGHEST = 2.5;

void DensityCheck::warn()
{
  if (!scene::makes_steps(update) || !coefficients.any_density()) return;

  const int types = atom->ntypes;
  std::vector<double> sums((size_t) 2 * (types + 1), 0.0);    // mass and volume of each type
  for (int i = 0; i < atom->nlocal; i++) {
    const double r = atom->radius[i];
    double *const of_type = &sums[(size_t) 2 * atom->type[i]];
    of_type[0] += scene::mass(atom, i);
    of_type[1] += 4.0 / 3.0 * MathConst::MY_PI * r * r * r;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), (int) sums.size(), MPI_DOUBLE, MPI_SUM, world);

  std::string warning;
  for (int type = 1; type <= types && warning.empty(); type++) {
    const double solid = coefficients.keywords(type, type).density;
    const double mass = sums[(size_t) 2 * type], volume = sums[(size_t) 2 * type + 1];
    if (!cuts.handles(type, type) || solid == 0.0 || volume == 0.0) continue;
    const double ratio = mass / volume / solid;
    if (ratio < LOWEST || ratio > HIGHEST)
      warning = fmt::format("Pair evp/lj: atoms of type {} have a density of {:.6g}, but their row "
                            "is of a solid of {:.6g}: set their "
                            "density to that of the row, divided by the solid fraction of the "
                            "body, before the run; ignore this if "
                            "masses are scaled on purpose",
                            type, mass / volume, solid);
  }
  if (warning == last_warning) return;
  last_warning = warning;
  if (!warning.empty() && comm->me == 0) error->warning(FLERR, warning);
}

}    // namespace EVP
