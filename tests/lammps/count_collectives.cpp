// SPDX-License-Identifier: GPL-2.0-only
//
// Loaded before MPI (LD_PRELOAD): counts the reductions over all MPI ranks of a process, and the messages that it sends to others, and writes
// both numbers to the file that EVP_COUNT_COLLECTIVES names, when the process ends. Only of lmp, as count_allocations.cpp, and of its first rank.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <errno.h>
#include <mpi.h>

static long reductions = 0, messages = 0;

extern "C" int MPI_Allreduce(const void *in, void *out, int n, MPI_Datatype type, MPI_Op op,
                             MPI_Comm comm)
{
  reductions++;
  return PMPI_Allreduce(in, out, n, type, op, comm);
}

extern "C" int MPI_Send(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm)
{
  messages++;
  return PMPI_Send(data, n, type, to, tag, comm);
}

extern "C" int MPI_Isend(const void *data, int n, MPI_Datatype type, int to, int tag, MPI_Comm comm,
                         MPI_Request *request)
{
  messages++;
  return PMPI_Isend(data, n, type, to, tag, comm, request);
}

__attribute__((destructor)) static void report()
{
  if (std::strncmp(program_invocation_short_name, "lmp", 3) != 0) return;
  const char *const name = std::getenv("EVP_COUNT_COLLECTIVES");
  const char *const rank = std::getenv("OMPI_COMM_WORLD_RANK");
  std::FILE *const file = name && (!rank || std::atoi(rank) == 0) ? std::fopen(name, "w") : nullptr;
  if (!file) return;
  std::fprintf(file, "%ld %ld\n", reductions, messages);
  std::fclose(file);
}
