// SPDX-License-Identifier: GPL-2.0-only
//
// Loaded before the C library (LD_PRELOAD): counts the allocations of a process and writes their number to the file that
// EVP_COUNT_ALLOCATIONS names, when the process ends. Only of lmp: not of what MPI or the launcher start beside it.

#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <errno.h>

extern "C" {
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *__libc_memalign(size_t, size_t);
}

static std::atomic<long> allocations{0};

extern "C" {
void *malloc(size_t size)
{
  allocations++;
  return __libc_malloc(size);
}
void *calloc(size_t n, size_t size)
{
  allocations++;
  return __libc_calloc(n, size);
}
void *realloc(void *old, size_t size)
{
  allocations++;
  return __libc_realloc(old, size);
}
void *memalign(size_t alignment, size_t size)
{
  allocations++;
  return __libc_memalign(alignment, size);
}
void *aligned_alloc(size_t alignment, size_t size)
{
  return memalign(alignment, size);
}
int posix_memalign(void **place, size_t alignment, size_t size)
{
  *place = memalign(alignment, size);
  return *place ? 0 : ENOMEM;
}
}

__attribute__((destructor)) static void report()
{
  if (std::strncmp(program_invocation_short_name, "lmp", 3) != 0) return;
  const char *const name = std::getenv("EVP_COUNT_ALLOCATIONS");
  const long count = allocations;
  std::FILE *const file = name ? std::fopen(name, "w") : nullptr;
  if (!file) return;
  std::fprintf(file, "%ld\n", count);
  std::fclose(file);
}
