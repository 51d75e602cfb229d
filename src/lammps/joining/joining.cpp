// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/joining/joining.h"

#include "lammps/pairs/pair_data.h"

#include "atom.h"
#include "error.h"

#include <algorithm>
#include <utility>

namespace EVP {

bool Joining::asks_pressure() const
{
  return pairs.rules().join.pressure > 0.0;
}

void Joining::rows_scaled(const Coefficients &coefficients)
{
  rows.assign(pairs.atoms()->ntypes + 1, Row());
  for (int type = 1; type < (int) rows.size(); type++) rows[type] = coefficients.row(type, type);
}

bool Joining::begin_run(PairData &)
{
  return acts = pairs.rules().asks_to_join();
}

void Joining::keep_values(BondStore &store)
{
  store.keep<JoiningRecord>(acts);
  store.keep<RelativeStressRecord>(acts && asks_pressure());
  if (acts) records = store.columns<JoiningRecord>();
  if (acts && asks_pressure()) stresses = store.columns<RelativeStressRecord>();
}

// when files of bonds have said what is one body
void Joining::pairs_packed(const NeighList *)
{
  if (pairs.within() == BodyRule::ALL)
    error->all(
        FLERR,
        "Pair evp/lj: 'exposure' of contact join is for contacts between two bodies, but all "
        "atoms are one: add 'within type' or 'within molecule' to fix evp/bonds");
  for (int i = 1; i < (int) rows.size(); i++)
    for (int j = 1; j < (int) rows.size(); j++)
      if (asks_pressure() && pairs.alpha_of(i, j) > 0.0 && !(rows[i].yield > 0.0))
        error->all(
            FLERR,
            "Pair evp/lj, type {}: 'pressure' of contact join is over the flow stress, which "
            "the row of types {} {} must give: add 'yield', or leave 'pressure' out",
            i, i, i);
}

std::string Joining::describe() const
{
  const JoinRule &rule = pairs.rules().join;
  std::string text = fmt::format(", bodies join at an exposure of {}", rule.exposure);
  if (asks_pressure())
    text += fmt::format(" under a pressure of {} times the flow stress", rule.pressure);
  return text;
}

void Joining::begin_update()
{
  strains.resize(pairs.lists().nlocal);
  for (size_t i = 0; i < strains.size(); i++) strains[i] = pairs.store().sphere((int) i).p;
  note_touched();
}

// Collective. By the present positions
void Joining::note_touched()
{
  const PairLists &lists = pairs.lists();
  const double within = pairs.rules().join.within;
  const auto *const x = pairs.positions();
  const double *const radius = pairs.atoms()->radius;
  AtomValues touches(1, lists.nall, 0.0);
  for (const PackedRow &row : lists.contacts.rows)
    for (int k = row.first; k < row.last; k++) {
      if (!(lists.contacts.join[k] & PairList::OF_TWO_BODIES)) continue;
      const int i = row.i, j = lists.contacts.j[k];
      const double most = within * lists.growth_of(i, j) * (radius[i] + radius[j]);
      if (PairGeometry(x, i, j).dsq > most * most) continue;
      for_each_end(i, j, lists.nreact, [&](int own, int) {
        touches[own][0] = 1.0;
      });
    }
  pairs.exchange().reverse_comm(touches);
  for (int i = 0; i < lists.nlocal; i++)
    if (touches[i][0] > 0.0) records[i].touched = 1.0;
}

void Joining::strains_updated(const BondStore &store, bool have_flowed)
{
  for (int i = 0; i < (int) strains.size(); i++) {
    const double p = store.sphere(i).p, growth = p - std::exchange(strains[i], p);
    JoiningRecord &own = records[i];
    if (have_flowed && own.touched != 0.0) own.exposure = joining::exposed(own.exposure, growth);
  }
}

void Joining::put_shared(Sharing, const ValuesOfAtoms &values) const
{
  for (int i = 0; i < pairs.lists().nlocal; i++) {
    values[i][0] = records[i].exposure;
    if (asks_pressure()) std::copy_n(stresses[i].stress.data(), NSTRESS, values[i] + 1);
  }
}

void Joining::set_shared(Sharing when, const ValuesOfAtoms &values)
{
  const int width = shared_width(when);
  shared.set_width(width);
  shared.resize(pairs.lists().nall);
  for (int i = 0; i < pairs.lists().nall; i++) std::copy_n(values[i], width, shared[i]);
}

bool Joining::may_join(int i, int j, const Vector &r) const
{
  const auto pressure_of = [&](int k) {
    return asks_pressure() ? joining::pressure_along(shared[k] + 1, r) : 0.0;
  };
  return joining::is_met(pairs.rules().join, 0.5 * (shared[i][0] + shared[j][0]),
                         0.5 * (pressure_of(i) + pressure_of(j)));
}

void Joining::stresses_begin()
{
  factors.assign(pairs.lists().nlocal, 1.0);
  pairs.effects.for_each([this](const Effect &other) {
    other.multiply_limits(factors);
  });
  yield_factors = pairs.store().find_value("yield_factor");
}

void Joining::stress_known(int i, const SphereStress &stress)
{
  const Row &row = rows[pairs.atoms()->type[i]];
  if (!(row.yield > 0.0)) return;    // of another pair style
  const double limit = pairs.limit_of(i)(pairs.store().sphere(i).p, factors[i]),
               flow_stress = row.flow_stress(limit / yield_factors.of(i));
  for (int c = 0; c < NSTRESS; c++) stresses[i].stress[c] = stress.mean[c] / flow_stress;
}

}    // namespace EVP
