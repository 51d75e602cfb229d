// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/yield/yield_condition.h"

#include "lammps/base/collective.h"
#include "lammps/pairs/pair_data.h"

#include "atom.h"
#include "error.h"
#include "update.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

namespace EVP {

namespace {
  constexpr int NSTRESS = std::tuple_size<Tensor>::value;

  template <int Width> EVP_INLINE void add(double *to, const double *from)
  {
    for (int c = 0; c < Width; c++) to[c] += from[c];
  }
}    // namespace

void StressSums::begin(int nall, const ParticleView &view)
{
  nreact = view.nreact;
  damped = view.v != nullptr;
  sums.assign(nall, 0.0);
  for (int i = 0; view.f && i < nall; i++)
    for (int c = 0; c < 3; c++) sums[i][NSTRESS + c] = -view.f[i][c];
}

void StressSums::end(const ParticleView &view)
{
  for (int i = 0; i < (int) sums.size(); i++) add<3>(sums[i] + NSTRESS, view.f[i]);
}

void StressSums::operator()(const PairRange &range, PairBlock &block)
{
  call_vectorized([&]() EVP_KERNEL {
    const int *const partner = range.list.j.data() + range.first;
    double half[PairBlock::SIZE];
    for (int k = 0; k < block.n; k++) {
      prefetch(sums[partner[k]], NSTRESS * sizeof(double));
      half[k] = -0.5 * (damped ? block.force[k] - block.damping[k] : block.force[k]);
    }
    range.for_each_row([&](int i, int first, int last) EVP_KERNEL {
      double total[NSTRESS] = {};
      for (int k = first - range.first; k < last - range.first; k++) {
        const double x = block.relative(0, k), y = block.relative(1, k), z = block.relative(2, k);
        const double hx = half[k] * x, hy = half[k] * y;
        const double share[NSTRESS] = {hx * x, hy * y, half[k] * z * z, hx * y, hx * z, hy * z};
        add<NSTRESS>(total, share);
        if (partner[k] < nreact) add<NSTRESS>(sums[partner[k]], share);
      }
      add<NSTRESS>(sums[i], total);
    });
  });
}

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
  measures = store.words.count(YieldRecord::NAME) > 0;
}

const Row &YieldCondition::row_of(int i) const
{
  return rows[pairs.atoms()->type[i]];
}

// of the solid; 0 where the row has no density
double YieldCondition::volume_of(int i) const
{
  const double density = row_of(i).density;
  return density > 0.0 ? pairs.atoms()->rmass[i] / density : 0.0;
}

void YieldCondition::begin_update()
{
  const int nlocal = pairs.lists().nlocal;
  std::vector<double> factors(nlocal, 1.0);    // of the others, such as by temperature
  pairs.effects.for_each([&](const Effect &other) {
    if (&other != this) other.multiply_limits(factors);
  });
  strains.resize(nlocal);
  flow_stresses.resize(nlocal);
  for (int i = 0; i < nlocal; i++) {
    const Row &row = row_of(i);
    strains[i] = pairs.store().sphere(i).p;
    flow_stresses[i] = row.yield > 0.0    // where a type has no row its limit is infinite
        ? row.yield * pairs.limit_of(i)(strains[i], factors[i]) / row.xi_s
        : 0.0;
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

// a word tells restart files that the stresses are still to be taken, as at the end of a minimization
void YieldCondition::update_effect()
{
  measures = true;
  pairs.store().words[YieldRecord::NAME] = {1.0};
}

void YieldCondition::before_forces(const ParticleView &view)
{
  if (!measures) return;
  stresses.begin(pairs.lists().nall, view);
}

// Of atoms and ghosts: what belongs to their bonds of this MPI rank
void YieldCondition::add_neighbors(const PairList &bonds, int nreact)
{
  constexpr int AHEAD = 8;    // of pairs whose values are brought nearer
  call_vectorized([&, npairs = (int) bonds.size() - 1]() EVP_KERNEL {
    for (const PackedRow &row : bonds.rows) {
      double total[WIDTH] = {};
      for (int n = row.first; n < row.last; n++) {
        const int j = bonds.j[n];
        prefetch(own[bonds.j[std::min(n + AHEAD, npairs)]], WIDTH * sizeof(double));
        prefetch(around[bonds.j[std::min(n + AHEAD, npairs)]], WIDTH * sizeof(double));
        add<WIDTH>(total, own[j]);
        if (j < nreact) add<WIDTH>(around[j], own[row.i]);
      }
      add<WIDTH>(around[row.i], total);
    }
  });
}

// Collective. The stress of each sphere, and the mean over it and those that it is bonded to
void YieldCondition::after_forces(const ParticleView &view)
{
  if (!std::exchange(measures, false)) return;
  pairs.store().words.erase(YieldRecord::NAME);
  forces_of_pairs.clear();
  const PairLists &lists = pairs.lists();
  stresses.end(view);
  pairs.exchange().reverse_comm(stresses.sums);
  own.resize(lists.nall);
  for (int i = 0; i < lists.nlocal; i++) {
    const double volume = volume_of(i);
    for (int c = 0; c < VOLUME; c++) own[i][c] = volume > 0.0 ? stresses.sums[i][c] : 0.0;
    own[i][VOLUME] = volume;
    own[i][FACTOR] = records[i].factor;
    own[i][COUNT] = 1.0;
  }
  pairs.exchange().forward_comm(own);
  around.resize(lists.nall);
  std::copy_n(own.data(), WIDTH * lists.nlocal, around.data());
  std::fill(around[lists.nlocal], around.end(), 0.0);
  add_neighbors(lists.bonds, view.nreact);
  pairs.exchange().reverse_comm(around);

  for (int i = 0; i < lists.nlocal; i++) {
    if (!(own[i][VOLUME] > 0.0)) {
      forces_of_pairs.emplace_back(0.0, 0.0, 0.0);
      continue;
    }
    Tensor stress, mean;
    const double per_volume = 1.0 / own[i][VOLUME], per_all = 1.0 / around[i][VOLUME];
    for (int c = 0; c < VOLUME; c++) {
      stress[c] = own[i][c] * per_volume;
      mean[c] = around[i][c] * per_all;
    }
    records[i].stress = equivalent_along(stress, mean);
    records[i].stress_around = von_mises(mean);
    records[i].factor_around = around[i][FACTOR] / around[i][COUNT];
    const Vector force(stresses.sums[i] + VOLUME);
    note_other_force(i, force);    // of spheres at rest, as in a minimization: the same
    forces_of_pairs.push_back(force);
  }
}

void YieldCondition::note_other_force(int i, const Vector &force)
{
  records[i].pressed = yielding::is_pressed(std::sqrt(dot(force, force)), pairs.atoms()->radius[i],
                                            volume_of(i), records[i].stress_around)
      ? 1.0
      : 0.0;
}

// when all forces of the step are known
void YieldCondition::committed()
{
  if (forces_of_pairs.empty() || update->whichflag == 2) return;
  const auto *const f = scene::rows(pairs.atoms()->f);
  for (size_t i = 0; i < forces_of_pairs.size(); i++)
    note_other_force((int) i, Vector(f[i]) - forces_of_pairs[i]);
  forces_of_pairs.clear();
}

}    // namespace EVP
