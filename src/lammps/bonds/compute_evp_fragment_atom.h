// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "compute.h"
#include "lammps/base/per_atom.h"

#include "memory.h"

namespace LAMMPS_NS {

/// Per atom: the fragment that it is in, all atoms that bonds hold together, by the lowest ID in it; 0 outside the group.
class ComputeEVPFragmentAtom : public EVP::WithPerAtomComm<Compute> {
 public:
  ComputeEVPFragmentAtom(class LAMMPS *, int, char **);
  ~ComputeEVPFragmentAtom() override { memory->destroy(vector_atom); }

  void init() override;
  void compute_peratom() override;
  double memory_usage() override;
  void unpack_reverse_comm(int, int *, double *) override;

 private:
  EVP::AtomValues lowest{1};    // ID in the fragment, of atoms and ghosts
  int nmax = 0;
};

}    // namespace LAMMPS_NS
