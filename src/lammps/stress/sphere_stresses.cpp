// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/stress/sphere_stresses.h"

#include "core/pairs/pairs.h"
#include "lammps/pairs/pair_data.h"

#include "atom.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace EVP {

void SphereStresses::rows_scaled(const Coefficients &coefficients)
{
  densities.assign(pairs.atoms()->ntypes + 1, 0.0);
  for (int type = 1; type < (int) densities.size(); type++)
    densities[type] = coefficients.row(type, type).density;
}

static const char *const DUE = "stress";

void SphereStresses::keep_values(BondStore &store)
{
  measures = store.words.count(DUE) > 0;
}

std::vector<StressReader *> SphereStresses::find_readers() const
{
  std::vector<StressReader *> readers;
  pairs.effects.for_each([&](Effect &one) {
    if (StressReader *const reader = one.stress_reader()) readers.push_back(reader);
  });
  return readers;
}

// a word tells restart files that the stresses are still to be taken, as at the end of a minimization
void SphereStresses::update_effect()
{
  measures = true;
  pairs.store().words[DUE] = {1.0};
}

void SphereStresses::before_forces(const ParticleView &view)
{
  if (measures) stresses.start(pairs.lists().nall, view);
}

// Collective. The stress of each sphere, and the mean over it and those that it is bonded to
void SphereStresses::after_forces(const ParticleView &view)
{
  if (!std::exchange(measures, false)) return;
  pairs.store().words.erase(DUE);
  const std::vector<StressReader *> readers = find_readers();
  int width = READERS;
  for (const StressReader *const reader : readers) width += reader->averaged_width();
  const PairLists &lists = pairs.lists();
  stresses.add_forces(view);
  pairs.exchange().reverse_comm(stresses.sums);
  own.set_width(width);
  around.set_width(width);
  own.resize(lists.nall);
  around.resize(lists.nall);
  for (int i = 0; i < lists.nlocal; i++) {
    const double density = densities[pairs.atoms()->type[i]];
    const double volume = density > 0.0 ? pairs.atoms()->rmass[i] / density : 0.0;
    for (int c = 0; c < VOLUME; c++) own[i][c] = volume > 0.0 ? stresses.sums[i][c] : 0.0;
    own[i][VOLUME] = volume;
    own[i][COUNT] = 1.0;
    double *values = own[i] + READERS;
    for (const StressReader *const reader : readers) {
      reader->put_averaged(i, values);
      values += reader->averaged_width();
    }
  }
  pairs.exchange().forward_comm(own);
  std::copy_n(own.data(), width * lists.nlocal, around.data());
  std::fill(around[lists.nlocal], around.end(), 0.0);
  add_bonded(lists.bonds, view.nreact, own, around);
  pairs.exchange().reverse_comm(around);

  for (StressReader *const reader : readers) reader->stresses_begin();
  for (int i = 0; i < lists.nlocal; i++) {
    const bool is_known = own[i][VOLUME] > 0.0;
    SphereStress stress = {
        {}, {}, Vector(stresses.sums[i] + VOLUME), own[i][VOLUME], around[i] + READERS};
    const double per_volume = is_known ? 1.0 / own[i][VOLUME] : 0.0,
                 per_all = is_known ? 1.0 / around[i][VOLUME] : 0.0;
    for (int c = 0; c < VOLUME; c++) {
      stress.own[c] = own[i][c] * per_volume;
      stress.mean[c] = around[i][c] * per_all;
    }
    for (int c = READERS; c < width; c++) around[i][c] /= around[i][COUNT];
    for (StressReader *const reader : readers) {
      reader->stress_known(i, stress);
      stress.means += reader->averaged_width();
    }
  }
}

// By the laws one by one, as the force loop would note what flows
static BlockLaw law_of(const PairData &pairs, const PairList &list)
{
  BlockLaw law;
  law.evaluate = [&pairs, &list](PairBlock &block, const BlockLaw::Asked &) {
    const auto first = (size_t) (block.inv_deq - list.inv_deq.data());
    for (int k = 0; k < block.n; k++) {
      const PackedPair pair = list.pair(first + k);
      const double d = std::sqrt(block.distance_squared(k));
      const bool is_apart =
          pair.flow == Flow::PLASTIC_CONTACT && d * pair.inv_deq > 1.0 - CONTACT_MARGIN;
      block.force[k] = block.distance_squared(k) > pair.cutsq || is_apart
          ? 0.0
          : pairs.law_of(pair).state(d * pair.inv_deq, pair).force / d;
    }
  };
  return law;
}

void find_stresses_now(PairData &pairs, StressSums &stresses)
{
  PairLists &lists = pairs.lists();
  AtomValues forces(3, lists.nall);
  const ParticleView view = {pairs.positions(), nullptr, forces.rows(), lists.nreact};
  stresses.start(lists.nall, view);
  for (PairList *const list : {&lists.bonds, &lists.contacts}) {
    std::vector<PairConsumer *> consumers;
    pairs.effects.for_each([&](Effect &one) {
      if (PairConsumer *const adder = one.adds_forces(*list)) consumers.push_back(adder);
    });
    consumers.push_back(&stresses);
    accumulate_forces(*list, law_of(pairs, *list), view, consumers);
  }
  pairs.effects.for_each([&](Effect &one) {
    one.for_each_further_list([&](PairList &list, PairConsumer &adder) {
      accumulate_forces(list, {}, view, {&adder, &stresses});
    });
  });
}

}    // namespace EVP
