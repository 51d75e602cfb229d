// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/yield/yield_condition.h"

#include "core/stress/stress.h"
#include "lammps/base/collective.h"
#include "lammps/pairs/pair_data.h"

#include "atom.h"
#include "error.h"
#include "update.h"

#include <array>
#include <cmath>
#include <string>

namespace EVP {

void YieldCondition::rows_scaled(const Coefficients &coefficients)
{
  rows.assign(pairs.atoms()->ntypes + 1, Row());
  acts = false;
  for (int type = 1; type < (int) rows.size(); type++) {
    rows[type] = coefficients.row(type, type);
    acts = acts || rows[type].yield > 0.0;
  }
  masses_checked = false;
}

void YieldCondition::pairs_packed(const NeighList *)
{
  const BondMeasures &measured = pairs.coefficients().measured();
  for (int type = 1; type < (int) rows.size() && !masses_checked && !measured.empty(); type++)
    if (rows[type].yield > 0.0 && pairs.alpha_of(type, type) > 0.0)    // not of another style
      demand_mass_of_solid(type, measured.of(type, type).spacing);
  masses_checked = true;
}

// Collective. Of random packings and lattices the solid takes 0.48 to 0.6 of the cube of their mean bond length per sphere; spheres
// with its density, without the voids between them, are a third less
void YieldCondition::demand_mass_of_solid(int type, double spacing) const
{
  constexpr double LEAST = 0.42, MOST = 0.8;
  const Atom *const atom = pairs.atoms();
  std::array<double, 2> sums{};
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->type[i] == type) sums = {sums[0] + atom->rmass[i], sums[1] + 1.0};
  sums = reduce_all(sums, MPI_SUM, world);
  if (spacing == 0.0 || sums[1] == 0.0) return;
  const double share = sums[0] / sums[1] / (rows[type].density * spacing * spacing * spacing);
  if (share < LEAST || share > MOST)
    error->all(
        FLERR,
        "Pair evp/lj, type {}: yield takes the volume of a sphere from its mass, which is {:.3g} "
        "of density times the cube of the bond length, and 0.48 to 0.6 in a body with the "
        "mass of the solid: use 'set group all density' with the density of the row over the "
        "solid fraction of the body",
        type, share);
}

std::string YieldCondition::describe() const
{
  bool volume_yields = true;
  pairs.effects.for_each([&](const Effect &other) {
    volume_yields = volume_yields && (&other == this || !other.uses(&Row::yield));
  });
  return std::string(", spheres flow at the flow stress of their row") +
      (volume_yields ? " (under pressure their bonds flow too: no fix evp/volume row)" : "");
}

void YieldCondition::keep_values(BondStore &store)
{
  store.keep<YieldRecord>(acts);
  if (!acts) return;
  records = store.columns<YieldRecord>();
}

const Row &YieldCondition::row_of(int i) const
{
  return rows[pairs.atoms()->type[i]];
}

void YieldCondition::begin_update()
{
  const int nlocal = pairs.lists().nlocal;
  std::vector<double> factors(nlocal, 1.0);    // of the others, such as by temperature
  pairs.effects.for_each([&](const Effect &other) {
    if (&other != this) other.multiply_limits(factors);
    other.multiply_limits_of_bonds(factors);
  });
  strains.resize(nlocal);
  flow_stresses.resize(nlocal);
  for (int i = 0; i < nlocal; i++) {
    strains[i] = pairs.store().sphere(i).p;
    flow_stresses[i] = row_of(i).flow_stress(pairs.limit_of(i)(strains[i], factors[i]));
  }
}

void YieldCondition::multiply_hardening(std::vector<double> &shares) const
{
  for (size_t i = 0; i < shares.size(); i++)
    if (!yielding::hardens(records[(int) i], flow_stresses[i])) shares[i] = 0.0;
}

void YieldCondition::strains_updated(const BondStore &store, bool have_flowed)
{
  for (int i = 0; have_flowed && i < (int) strains.size(); i++) {
    const Row &row = row_of(i);
    const double growth = store.sphere(i).p - strains[i];
    if (row.yield > 0.0 && growth > 0.0)
      records[i].factor = yielding::next_factor(records[i], growth, flow_stresses[i]);
  }
}

void YieldCondition::multiply_limits(std::vector<double> &factors) const
{
  for (size_t i = 0; i < factors.size(); i++) factors[i] *= records[(int) i].factor;
}

void YieldCondition::stress_known(int i, const SphereStress &stress)
{
  of_pairs.push_back({stress.force, stress.volume});
  if (!(stress.volume > 0.0)) return;
  records[i].stress = equivalent_along(stress.own, stress.mean);
  records[i].stress_around = von_mises(stress.mean);
  records[i].factor_around = *stress.means;
  note_other_force(i, stress.force,
                   stress.volume);    // of spheres at rest, as in a minimization: the same
}

void YieldCondition::note_other_force(int i, const Vector &force, double volume)
{
  records[i].pressed = yielding::is_pressed(std::sqrt(dot(force, force)), pairs.atoms()->radius[i],
                                            volume, records[i].stress_around)
      ? 1.0
      : 0.0;
}

// when all forces of the step are known
void YieldCondition::committed()
{
  if (of_pairs.empty() || update->whichflag == 2) return;
  const auto *const f = scene::rows(pairs.atoms()->f);
  for (size_t i = 0; i < of_pairs.size(); i++)
    note_other_force((int) i, Vector(f[i]) - of_pairs[i].force, of_pairs[i].volume);
  of_pairs.clear();
}

}    // namespace EVP
