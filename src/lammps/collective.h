// SPDX-License-Identifier: GPL-2.0-only
//
// What all MPI ranks decide together. All of these are collective.

#ifndef EVP_COLLECTIVE_H
#define EVP_COLLECTIVE_H

#include "core/text.h"
#include "lmptype.h"

#include <array>
#include <cstdint>
#include <mpi.h>

namespace EVP {

inline MPI_Datatype mpi_type(int)
{
  return MPI_INT;
}
inline MPI_Datatype mpi_type(int64_t)
{
  return MPI_LL;
}
inline MPI_Datatype mpi_type(double)
{
  return MPI_DOUBLE;
}

/// A value of each MPI rank, or values one by one, taken together.
template <class T> T reduce_all(T value, MPI_Op op, MPI_Comm world)
{
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, mpi_type(value), op, world);
  return value;
}
template <class T, size_t N>
std::array<T, N> reduce_all(std::array<T, N> values, MPI_Op op, MPI_Comm world)
{
  MPI_Allreduce(MPI_IN_PLACE, values.data(), N, mpi_type(T()), op, world);
  return values;
}

template <class T> T sum_all(T here, MPI_Comm world)
{
  return reduce_all(here, MPI_SUM, world);
}
template <class T> T max_all(T here, MPI_Comm world)
{
  return reduce_all(here, MPI_MAX, world);
}
template <class T> T min_all(T here, MPI_Comm world)
{
  return reduce_all(here, MPI_MIN, world);
}
inline bool on_any(bool here, MPI_Comm world)
{
  return max_all((int) here, world);
}
inline bool on_all(bool here, MPI_Comm world)
{
  return min_all((int) here, world);
}

/// If any MPI rank has a complaint, that of the first such rank is thrown as BadInput on all.
inline void throw_together(std::string complaint, MPI_Comm world)
{
  int me, nprocs;
  MPI_Comm_rank(world, &me);
  MPI_Comm_size(world, &nprocs);
  const int first = min_all(complaint.empty() ? nprocs : me, world);
  if (first == nprocs) return;
  int length = (int) complaint.size();
  MPI_Bcast(&length, 1, MPI_INT, first, world);
  complaint.resize(length);
  MPI_Bcast(&complaint[0], length, MPI_CHAR, first, world);
  throw BadInput(complaint);
}

}    // namespace EVP

#endif
