// SPDX-License-Identifier: GPL-2.0-only

#ifndef LMP_COMPUTE_EVP_STATE_ATOM_H
#define LMP_COMPUTE_EVP_STATE_ATOM_H

#include "compute.h"
#include "core/bytes.h"
#include "nodal_exchange.h"

namespace LAMMPS_NS {

/// Per atom: pairs recorded, share of them in the second regime, share beyond dlim, new pairs.
class ComputeEVPStateAtom : public NodalExchange<Compute> {
 public:
  ComputeEVPStateAtom(class LAMMPS *, int, char **);
  ~ComputeEVPStateAtom() override;

  void init() override;
  void compute_peratom() override;
  double memory_usage() override
  {
    return (double) nmax * size_peratom_cols * sizeof(double) + EVP::bytes_of(counts);
  }

 private:
  /// Of an atom: bonds within dlim, of these in the second regime; new pairs.
  enum Count { WITHIN, SECOND, FRESH, NCOUNTS };

  Nodal counts;    // NCOUNTS per atom and ghost
  int nmax = 0;
};

}    // namespace LAMMPS_NS

#endif
