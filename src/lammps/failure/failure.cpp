// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/failure/failure.h"

#include "lammps/pairs/pair_data.h"

#include "lammps/base/collective.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "update.h"

#include <algorithm>
#include <limits>

namespace EVP {

void Failure::rows_scaled(const Coefficients &coefficients)
{
  rows.assign(pairs.atoms()->ntypes + 1, Row());
  for (int type = 1; type < (int) rows.size(); type++) rows[type] = coefficients.row(type, type);
  acts = std::any_of(rows.begin(), rows.end(), failing::fails);
}

bool Failure::uses(double Row::*member) const
{
  return member == &Row::damage_d1;
}

bool Failure::has_failed(BondStore &store) const
{
  if (!store.has<FailureRecord>()) return false;
  const auto kept = store.columns<FailureRecord>();
  bool any = false;
  for (int i = 0; i < pairs.atoms()->nlocal; i++) any = any || kept[i].has_begun();
  return any;
}

// Collective
void Failure::keep_values(BondStore &store)
{
  if (!acts && on_any(has_failed(store), world))
    error->all(FLERR,
               "Pair evp/lj: spheres have failed, which rows without damage would forget: keep "
               "damage and rupture in them");
  store.keep<FailureRecord>(acts);
  if (acts) records = store.columns<FailureRecord>();
}

const Row &Failure::row_of(int i) const
{
  return rows[pairs.atoms()->type[i]];
}

// of a layer of spheres that part
double Failure::thickness(int i) const
{
  return failing::LAYER * 2.0 * pairs.atoms()->radius[i];
}

// T* of Johnson and Cook, 0 where there is no temperature
double Failure::heat_of(int i) const
{
  const Row &row = row_of(i);
  const double *const temperatures = pairs.atoms()->temperature;
  return row.damage_d5 > 0.0 && temperatures ? failing::homologous(row, temperatures[i]) : 0.0;
}

void Failure::begin_update()
{
  strains.resize(pairs.lists().nlocal);
  for (size_t i = 0; i < strains.size(); i++) strains[i] = pairs.store().sphere((int) i).p;
  rates = pairs.store().find_value("strain_rate");    // of an effect that has them
}

// What a sphere opens is its own strain; when it begins is told by that around it and by the stress, once they are known. In a
// minimization nothing opens
void Failure::strains_updated(const BondStore &store, bool have_flowed)
{
  if (!have_flowed) return take_given(store);
  const bool opens = update->whichflag != 2;
  bool waits = false;
  for (int i = 0; i < (int) strains.size(); i++) {
    const Row &row = row_of(i);
    FailureRecord &own = records[i];
    if (!failing::fails(row)) continue;
    own.growth = std::max(0.0, store.sphere(i).p - strains[i]);
    if (own.omega >= 1.0 && opens) {
      if (!own.has_begun()) begin(i, strains[i] - own.opening / thickness(i));
      own.opening += thickness(i) * own.growth;
      own.damage = failing::damage_of(own, row);
    }
    waits = waits || (own.omega >= 1.0 && own.growth > 0.0 && !own.has_parted());
    strains[i] = store.sphere(i).p;
  }
  if (!opens && !warned && on_any(waits, world)) warn();
}

void Failure::warn()
{
  warned = true;
  if (comm->me == 0)
    error->warning(FLERR,
                   "Pair evp/lj: spheres begin to fail in a minimization, in which damage does not "
                   "move on: use a run in time from here");
}

// Strains that users have given count as those of tension; what has begun to fail does not heal
void Failure::take_given(const BondStore &store)
{
  for (int i = 0; i < (int) strains.size(); i++) {
    const Row &row = row_of(i);
    const double p = store.sphere(i).p;
    FailureRecord &own = records[i];
    if (!failing::fails(row) || p == strains[i] || own.has_begun()) continue;
    const double at_failure = failing::strain_at_failure(row, failing::OF_TENSION, 0.0, heat_of(i));
    own.omega = p >= at_failure ? 1.0 : p / at_failure;
    if (own.omega < 1.0) continue;
    begin(i, at_failure);
    own.opening = thickness(i) * (p - at_failure);
    own.damage = failing::damage_of(own, row);
  }
}

void Failure::begin(int i, double strain)
{
  records[i].strain = std::max(strain, std::numeric_limits<double>::min());
}

// changes nothing that forces depend on before the next update
void Failure::stress_known(int i, const SphereStress &stress)
{
  const Row &row = row_of(i);
  FailureRecord &own = records[i];
  const double size = von_mises(stress.mean);
  if (!failing::fails(row) || !(size > 0.0)) return;
  own.triaxiality = mean_stress(stress.mean) / size;
  if (own.omega < 1.0) {
    const double moved = failing::progress(row, *stress.means, own.triaxiality,
                                           rates ? rates.of(i) : 0.0, heat_of(i));
    const double beyond = own.omega + moved - 1.0;
    own.omega = std::min(1.0, own.omega + moved);
    if (beyond >= 0.0)    // the share of the last growth that comes after it
      own.opening = thickness(i) * own.growth * (std::isfinite(moved) ? beyond / moved : 1.0);
  }
  if (own.omega < 1.0 || own.stress > 0.0) return;
  const double p = pairs.store().sphere(i).p;
  own.stress = std::max(size, failing::LEAST_STRESS * row.flow_stress(pairs.limit_of(i)(p)));
}

// of one that has begun to fail nothing hardens, and the damage is lost
void Failure::multiply_limits_of_bonds(std::vector<double> &factors) const
{
  for (size_t k = 0; k < factors.size(); k++) {
    const int i = (int) k;
    const FailureRecord &own = records[i];
    if (!own.has_begun() || !failing::fails(row_of(i))) continue;
    const Limit &limit = pairs.limit_of(i);
    const double p = pairs.store().sphere(i).p;
    factors[k] *= limit(std::min(own.strain, p)) / limit(p) *
        std::max(failing::LEAST_LIMIT, 1.0 - own.damage);
  }
}

void Failure::put_shared(Sharing, const ValuesOfAtoms &values) const
{
  for (int i = 0; i < pairs.lists().nlocal; i++)
    values[i][0] = failing::fails(row_of(i)) && records[i].has_parted() ? 1.0 : 0.0;
}

void Failure::set_shared(Sharing, const ValuesOfAtoms &values)
{
  parted.resize(pairs.lists().nall);
  any_parted = false;
  for (int i = 0; i < pairs.lists().nall; i++) {
    parted[i] = values[i][0] != 0.0;
    any_parted = any_parted || parted[i];
  }
}

}    // namespace EVP
