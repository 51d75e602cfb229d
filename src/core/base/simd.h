// SPDX-License-Identifier: GPL-2.0-only
// Instruction sets, and what is done with bytes.
//
// Files that use the macros must be compiled with -ffp-contract=off: a fused multiply-add on one
// machine only would give it other numbers.
#pragma once

#include <cstddef>
#include <cstring>

// Compilers and machines without a choice of instruction set at run time use the base.
#if defined(__GNUC__) && defined(__x86_64__)
#define EVP_HAS_LEVELS
#define EVP_INLINE __attribute__((always_inline)) inline
#define EVP_KERNEL __attribute__((always_inline))
#define EVP_AVX2 __attribute__((target("avx2")))
#define EVP_AVX512 __attribute__((target("avx512f")))
#else
#define EVP_INLINE inline
#define EVP_KERNEL
#define EVP_AVX2
#define EVP_AVX512
#endif

// Of the loop that follows: its iterations do not depend on each other; rows are short, and the overhead counts.
#if defined(__clang__)
#define EVP_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#define EVP_UNROLL _Pragma("clang loop unroll_count(4)")
#elif defined(__GNUC__)
#define EVP_INDEPENDENT _Pragma("GCC ivdep")
#define EVP_UNROLL _Pragma("GCC unroll 4")
#else
#define EVP_INDEPENDENT
#define EVP_UNROLL
#endif

namespace EVP {

/// Instruction sets that loops are compiled for, one of which a machine takes when it runs; it has all
/// up to its best.
enum class InstructionSet { BASE, AVX2, AVX512 };

/// The best that this compiler and this machine have.
inline InstructionSet best_instruction_set()
{
#ifdef EVP_HAS_LEVELS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f")) return InstructionSet::AVX512;
  if (__builtin_cpu_supports("avx2")) return InstructionSet::AVX2;
#endif
  return InstructionSet::BASE;
}

/// The one that loops take; tests try them all.
inline InstructionSet instruction_set = best_instruction_set();

/// Calls f, an EVP_KERNEL lambda, compiled for that instruction set; the machine must have it.
template <class F> EVP_AVX2 auto call_avx2(const F &f)
{
  return f();
}
template <class F> EVP_AVX512 auto call_avx512(const F &f)
{
  return f();
}
template <class F> auto call_vectorized(const F &f)
{
  if (instruction_set == InstructionSet::AVX512) return call_avx512(f);
  if (instruction_set == InstructionSet::AVX2) return call_avx2(f);
  return f();
}

/// Memory that the vectors hold [bytes].
template <class... Vectors> double bytes_of(const Vectors &...vectors)
{
  return (0.0 + ... + ((double) vectors.capacity() * sizeof(typename Vectors::value_type)));
}

/// The bits of a number as one of another type, of the same size.
template <class To, class From> To bits_as(const From &from)
{
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &from, sizeof(to));
  return to;
}

/// Brings [begin, begin + bytes) nearer before it is needed. Never faults, wherever it points; does
/// nothing with compilers other than g++ and clang++.
inline void prefetch([[maybe_unused]] const void *begin, [[maybe_unused]] size_t bytes)
{
#if defined(__GNUC__)
  const char *const at = static_cast<const char *>(begin);
  for (size_t k = 0; k < bytes; k += 64) {
    __builtin_prefetch(at + k);
    __asm__ volatile("");    // g++ drops a loop that does nothing else
  }
#endif
}

}    // namespace EVP
