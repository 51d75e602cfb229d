// SPDX-License-Identifier: GPL-2.0-only
//
// Instruction sets that loops are compiled for, one of which a machine takes when it runs.
// Pure C++17. Files that use the macros must be compiled with -ffp-contract=off: a fused
// multiply-add on one machine only would give it other numbers.

#ifndef EVP_CORE_LEVELS_H
#define EVP_CORE_LEVELS_H

// Compilers and machines without a choice of instruction set at run time do with the base.
#if defined(__GNUC__) && defined(__x86_64__)
#define EVP_HAS_LEVELS 1
#define EVP_INLINE __attribute__((always_inline)) inline
#define EVP_AVX2 __attribute__((target("avx2")))
#define EVP_AVX512 __attribute__((target("avx512f")))
#else
#define EVP_HAS_LEVELS 0
#define EVP_INLINE inline
#define EVP_AVX2
#define EVP_AVX512
#endif

// The iterations of the loop that follows do not depend on each other.
#if defined(__clang__)
#define EVP_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define EVP_INDEPENDENT _Pragma("GCC ivdep")
#else
#define EVP_INDEPENDENT
#endif

namespace EVP {

/// Instruction sets that loops were compiled for; a machine has all up to its best.
enum class Level { BASE, AVX2, AVX512 };

/// The best that this compiler and this machine have.
inline Level best_level()
{
#if EVP_HAS_LEVELS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f")) return Level::AVX512;
  if (__builtin_cpu_supports("avx2")) return Level::AVX2;
#endif
  return Level::BASE;
}

}    // namespace EVP

#endif
