// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_COLLECTIVE_ERROR_H
#define EVP_COLLECTIVE_ERROR_H

#include "core/text.h"

#include <mpi.h>

namespace EVP {

/// Collective. If any MPI rank has a complaint, that of the first such rank is thrown as BadInput on all.
inline void throw_together(std::string complaint, MPI_Comm world)
{
  int me, nprocs, here, first;
  MPI_Comm_rank(world, &me);
  MPI_Comm_size(world, &nprocs);
  here = complaint.empty() ? nprocs : me;
  MPI_Allreduce(&here, &first, 1, MPI_INT, MPI_MIN, world);
  if (first == nprocs) return;
  int length = (int) complaint.size();
  MPI_Bcast(&length, 1, MPI_INT, first, world);
  complaint.resize(length);
  MPI_Bcast(&complaint[0], length, MPI_CHAR, first, world);
  throw BadInput(complaint);
}

}    // namespace EVP

#endif
