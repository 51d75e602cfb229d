// SPDX-License-Identifier: GPL-2.0-only
//
// Loaded before MPI (LD_PRELOAD): counts the reductions over all MPI ranks of a process and writes their number to the file that
// EVP_COUNT_COLLECTIVES names, when the process ends. Only of lmp, as count_allocations.cpp.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <errno.h>
#include <mpi.h>

static long reductions = 0;

extern "C" int MPI_Allreduce(const void *in, void *out, int n, MPI_Datatype type, MPI_Op op,
                             MPI_Comm comm)
{
  reductions++;
  return PMPI_Allreduce(in, out, n, type, op, comm);
}

__attribute__((destructor)) static void report()
{
  if (std::strncmp(program_invocation_short_name, "lmp", 3) != 0) return;
  const char *const name = std::getenv("EVP_COUNT_COLLECTIVES");
  std::FILE *const file = name ? std::fopen(name, "w") : nullptr;
  if (!file) return;
  std::fprintf(file, "%ld\n", reductions);
  std::fclose(file);
}
