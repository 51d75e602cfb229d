// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/failure/failure.h"

#include "lammps/pairs/pair_data.h"

#include "atom.h"

#include <algorithm>
#include <iterator>

namespace EVP {

static constexpr double Row::*OF_FAILURE[] = {&Row::damage_d1,     &Row::damage_d2, &Row::damage_d3,
                                              &Row::damage_d4,     &Row::damage_d5, &Row::rupture,
                                              &Row::rupture_energy};

void Failure::rows_scaled(const Coefficients &coefficients)
{
  rows.assign(pairs.atoms()->ntypes + 1, Row());
  for (int type = 1; type < (int) rows.size(); type++) rows[type] = coefficients.row(type, type);
  acts = std::any_of(rows.begin(), rows.end(), [](const Row &row) {
    return row.damage_d1 >= 0.0;
  });
}

bool Failure::uses(double Row::*member) const
{
  return std::find(std::begin(OF_FAILURE), std::end(OF_FAILURE), member) != std::end(OF_FAILURE);
}

void Failure::keep_values(BondStore &store)
{
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

// T* of Johnson and Cook, 0 where there is no fix evp/heat
double Failure::heat_of(int i) const
{
  const Row &row = row_of(i);
  if (row.damage_d5 == 0.0 || !pairs.atoms()->temperature) return 0.0;
  return std::clamp((pairs.atoms()->temperature[i] - row.soften_tref) /
                        (row.soften_tmelt - row.soften_tref),
                    0.0, 1.0);
}

void Failure::begin_update()
{
  strains.resize(pairs.lists().nlocal);
  for (size_t i = 0; i < strains.size(); i++) strains[i] = pairs.store().sphere((int) i).p;
  rates.clear();
  pairs.effects.for_each([&](const Effect &other) {
    if (const std::vector<double> *const found = other.values_of_atoms("strain_rate"))
      rates = *found;
  });
}

// What a sphere opens is its own strain; when it begins is told by that around it and by the stress, once they are known
void Failure::strains_updated(const BondStore &store, bool have_flowed)
{
  for (int i = 0; i < (int) strains.size(); i++) {
    const Row &row = row_of(i);
    FailureRecord &own = records[i];
    if (row.damage_d1 < 0.0) continue;
    own.growth = 0.0;
    if (!have_flowed) {    // given by users: as in tension
      own.omega =
          std::min(1.0,
                   store.sphere(i).p /
                       failing::strain_at_failure(row, failing::OF_TENSION, 0.0, heat_of(i)));
      if (own.omega >= 1.0) begin(i, 0.0, own.stress);
      continue;
    }
    own.growth = std::max(0.0, store.sphere(i).p - strains[i]);
    if (own.omega < 1.0) continue;
    own.opening += thickness(i) * own.growth;
    find_damage(i);
  }
}

void Failure::stress_known(int i, const SphereStress &stress)
{
  const Row &row = row_of(i);
  FailureRecord &own = records[i];
  const double size = von_mises(stress.mean);
  if (row.damage_d1 < 0.0 || !(size > 0.0)) return;
  own.triaxiality = mean_stress(stress.mean) / size;
  if (own.omega >= 1.0 || own.triaxiality <= failing::LEAST_TRIAXIALITY) return;
  const double rate = i < (int) rates.size() ? rates[i] : 0.0;
  const double grown =
      *stress.means / failing::strain_at_failure(row, own.triaxiality, rate, heat_of(i));
  const double before = own.omega;
  own.omega = std::min(1.0, before + grown);
  if (own.omega >= 1.0) begin(i, (before + grown - 1.0) / grown, size);
}

// beyond: share of the last growth that comes after it
void Failure::begin(int i, double beyond, double stress)
{
  FailureRecord &own = records[i];
  own.stress = stress;
  own.strain = pairs.store().sphere(i).p - beyond * own.growth;
  own.opening = thickness(i) * beyond * own.growth;
  find_damage(i);
}

void Failure::find_damage(int i)
{
  records[i].damage = failing::damage_of(records[i], row_of(i));
}

// of one that has begun to fail nothing hardens, and the damage is lost
void Failure::multiply_limits_of_bonds(std::vector<double> &factors) const
{
  for (size_t k = 0; k < factors.size(); k++) {
    const int i = (int) k;
    if (records[i].omega < 1.0 || row_of(i).damage_d1 < 0.0) continue;
    const Limit &limit = pairs.limit_of(i);
    factors[k] *= limit(records[i].strain) /
        limit(std::max(pairs.store().sphere(i).p, records[i].strain)) *
        std::max(failing::LEAST_LIMIT, 1.0 - records[i].damage);
  }
}

void Failure::put_shared(Sharing, const ValuesOfAtoms &values) const
{
  for (int i = 0; i < pairs.lists().nlocal; i++)
    values[i][0] = row_of(i).damage_d1 >= 0.0 && records[i].damage >= 1.0 ? 1.0 : 0.0;
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
