// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "lammps/pairs/effect.h"
#include "lammps/pairs/pair_data.h"
#include "lammps/pairs/step_work.h"

#include <vector>

namespace EVP {

/// Permanent flow ('plasticity isotropic'): deq moves, and spheres harden by their plastic strain.
class Plasticity final : public Effect, protected Pointers {
 public:
  Plasticity(LAMMPS *lmp, PairData &pair_data) : Pointers(lmp), pairs(pair_data), step_work(lmp) {}

  void pairs_packed(const NeighList *) override { sums.reset(pairs.lists().nall); }

  bool was_changed() const override { return pairs.store().has_given(); }
  void begin_update() override { collect_sums(); }
  void update_effect() override;

  int shared_width(Sharing) const override { return weakens() ? 2 : 1; }
  void put_shared(Sharing, const ValuesOfAtoms &) const override;
  void set_shared(Sharing, const ValuesOfAtoms &) override;

  void commit() override;
  void bond_ends(const EndingPair &pair) override { count_end(pair, 1.0); }
  void contact_joins(const EndingPair &pair) override { count_end(pair, -1.0); }
  void unlisted_bonds_end(const std::vector<UnlistedBond> &) override;
  void return_to_records(bool are_due) override;

 private:
  PairData &pairs;
  FlowSums sums;
  std::vector<double> work;    // of own atoms, since the last time
  StepWork step_work;
  bool were_given = false;    // strains, since the last update

  bool weakens() const { return pairs.effects.any(&Effect::weakens_bonds); }
  void collect_sums();
  void count_end(const EndingPair &pair, double change)
  {
    sums.add(pair.i, pair.j, pairs.lists().nreact, FlowSums::ENDED, change);
  }
  void set_limits(bool keeps_below);
  double keep_below_limit(PairList &, int i, int n, double before);
};

}    // namespace EVP
