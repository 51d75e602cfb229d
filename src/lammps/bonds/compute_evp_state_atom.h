// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "compute.h"
#include "core/stress/stress_sums.h"
#include "lammps/base/per_atom.h"
#include "lammps/pairs/pair_data.h"

#include "memory.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Per atom: pairs recorded, share of them in the second regime, share past dlim, new pairs; behind
/// them what else was asked for.
class ComputeEVPStateAtom : public EVP::WithPerAtomComm<Compute> {
 public:
  ComputeEVPStateAtom(class LAMMPS *, int, char **);
  ~ComputeEVPStateAtom() override { memory->destroy(array_atom); }

  void init() override;
  void compute_peratom() override;
  double memory_usage() override;

 private:
  static constexpr int NCOLUMNS = 4;    // that are always there

  enum class Value { VOLUME_STRAIN, VON_MISES, TRIAXIALITY, BONDS_NOW, JOINTS, OF_SPHERE };
  std::vector<Value> values;               // of the further columns
  std::vector<std::string> value_names;    // of these
  std::vector<EVP::BondStore::Place>
      places;               // of those of spheres, as of now: nobody may keep them
  double fraction = 0.0;    // volume of the spheres over that of the body

  /// Sums of an atom over its pairs: bonds within dlim, of these in the second regime or at their limit; new pairs; bonds with other bodies.
  enum Count { WITHIN, SECOND, UNBONDED, BETWEEN_BODIES, NCOUNTS };

  EVP::AtomValues sums{NCOUNTS};    // of atoms and ghosts
  static constexpr int AROUND_WIDTH = EVP::StressSums::NSTRESS + 1;
  EVP::AtomValues around{AROUND_WIDTH};    // see find_stresses()
  int nmax = 0;

  bool has(Value) const;
  void add_pairs(const EVP::PairData *);
  void find_stresses(EVP::PairData &);
  static double value_of_effects(const std::string &name, int i, const EVP::PairData *);
  double value_of(size_t column, int i, const EVP::PairData *) const;
};

}    // namespace LAMMPS_NS
