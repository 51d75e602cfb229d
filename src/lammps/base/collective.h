// SPDX-License-Identifier: GPL-2.0-only
//
// What all MPI ranks decide together. All of these are collective.
#pragma once

#include "core/base/text.h"
#include "lmptype.h"

#include <array>
#include <mpi.h>
#include <string>
#include <type_traits>

namespace EVP {

/// MPI_Allreduce of values of each MPI rank, one by one.
template <class T, size_t N>
std::array<T, N> reduce_all(std::array<T, N> values, MPI_Op op, MPI_Comm world)
{
  static_assert(std::is_same_v<T, double> || std::is_same_v<T, int> || sizeof(T) == 8);
  const MPI_Datatype integer = sizeof(T) == sizeof(int) ? MPI_INT : MPI_LL;
  MPI_Allreduce(MPI_IN_PLACE, values.data(), N, std::is_same_v<T, double> ? MPI_DOUBLE : integer,
                op, world);
  return values;
}

/// The same of one value.
template <class T> T reduce_all(T value, MPI_Op op, MPI_Comm world)
{
  return reduce_all(std::array<T, 1>{value}, op, world)[0];
}

inline bool on_any(bool here, MPI_Comm world)
{
  return reduce_all((int) here, MPI_MAX, world);
}

inline bool on_all(bool here, MPI_Comm world)
{
  return reduce_all((int) here, MPI_MIN, world);
}

/// The text of that MPI rank becomes that of all.
inline void broadcast(std::string &text, int rank, MPI_Comm world)
{
  int length = (int) text.size();
  MPI_Bcast(&length, 1, MPI_INT, rank, world);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, rank, world);
}

/// If any MPI rank has a complaint, that of the first such rank is thrown as BadInput on all.
inline void throw_together(std::string complaint, MPI_Comm world)
{
  int me, nprocs;
  MPI_Comm_rank(world, &me);
  MPI_Comm_size(world, &nprocs);
  const int first = reduce_all(complaint.empty() ? nprocs : me, MPI_MIN, world);
  if (first == nprocs) return;
  broadcast(complaint, first, world);
  throw BadInput(complaint);
}

}    // namespace EVP
