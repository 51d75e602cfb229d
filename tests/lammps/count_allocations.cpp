// SPDX-License-Identifier: GPL-2.0-only
//
// Loaded before the C library (LD_PRELOAD): counts the allocations of a process and writes their number to the file that
// EVP_COUNT_ALLOCATIONS names, when the process ends.

#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

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
int posix_memalign(void **place, size_t alignment, size_t size)
{
  allocations++;
  *place = __libc_memalign(alignment, size);
  return *place ? 0 : 12;    // ENOMEM
}
}

__attribute__((destructor)) static void report()
{
  const char *const name = std::getenv("EVP_COUNT_ALLOCATIONS");
  const long count = allocations;
  std::FILE *const file = name ? std::fopen(name, "w") : nullptr;
  if (!file) return;
  std::fprintf(file, "%ld\n", count);
  std::fclose(file);
}
