/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef COMPUTE_CLASS
// clang-format off
ComputeStyle(evp/state/atom,ComputeEVPStateAtom);
// clang-format on
#else

#ifndef LMP_COMPUTE_EVP_STATE_ATOM_H
#define LMP_COMPUTE_EVP_STATE_ATOM_H

#include "compute.h"

#include <vector>

namespace LAMMPS_NS {

/// Per atom: pairs recorded, share of them in the second regime, share beyond dlim, new pairs.
class ComputeEVPStateAtom : public Compute {
 public:
  ComputeEVPStateAtom(class LAMMPS *, int, char **);
  ~ComputeEVPStateAtom() override;

  void init() override;
  void compute_peratom() override;
  double memory_usage() override;

  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;

 private:
  /// What an atom's pairs are now.
  struct Tally {
    double within, second,
        fresh;    ///< bonds within dlim, of these in the second regime; new pairs
  };

  class PairEVPLJ *pair;
  std::vector<Tally> tallies;    // per atom and ghost
  int nmax;

  void count_pairs();
};

}    // namespace LAMMPS_NS

#endif
#endif
