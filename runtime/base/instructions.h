// Which vector instructions the inner loops use. Each loop is one source, compiled for every instruction set; the program
// chooses when it runs. The results are the same to the bit with any instruction set.
#pragma once

#if defined(__GNUC__)
#define PALPATE_INLINE inline __attribute__((always_inline))
#else
#define PALPATE_INLINE inline
#endif

#if defined(__GNUC__) && defined(__x86_64__)
#define PALPATE_DISPATCHES 1
// The best instruction set that a build may use: 0 the baseline, 1 AVX2, 2 AVX-512. Tests build with 0 and 1.
#ifndef PALPATE_MOST_INSTRUCTIONS
#define PALPATE_MOST_INSTRUCTIONS 2
#endif
#define PALPATE_AVX2 "avx2,f16c"
// Clang knows the preference for 512-bit registers as a command-line option alone.
#ifdef __clang__
#define PALPATE_AVX512 "avx512f"
#else
#define PALPATE_AVX512 "avx512f,prefer-vector-width=512"
#endif
#endif

namespace palpate {

// Asks memory for the line of an address; WebAssembly has no instruction for it. The empty asm keeps GCC from dropping the calls of a
// function that does nothing but prefetch.
#if defined(__GNUC__) && !defined(__wasm__)
inline constexpr bool kPrefetches = true;
PALPATE_INLINE void prefetch(const void* address) {
  __builtin_prefetch(address);
  __asm__ volatile("");
}
// Into the second-level cache, where more fits than in the first.
PALPATE_INLINE void prefetch_to_second_level(const void* address) {
  __builtin_prefetch(address, 0, 2);
  __asm__ volatile("");
}
#else
inline constexpr bool kPrefetches = false;
inline void prefetch(const void*) {}
inline void prefetch_to_second_level(const void*) {}
#endif

// baseline: the instruction set that the build targets: SSE2 on x86-64, NEON on AArch64.
enum class Instructions { baseline, avx2, avx512 };

// Vectors of doubles; the name is their number.
#if defined(__GNUC__)
typedef double Two __attribute__((vector_size(16)));
typedef double Four __attribute__((vector_size(32)));
typedef double Eight __attribute__((vector_size(64)));
#else
using Two = double;
#endif

// The best instruction set that this processor has.
inline Instructions best_instructions() {
#ifdef PALPATE_DISPATCHES
  if (PALPATE_MOST_INSTRUCTIONS >= 2 && __builtin_cpu_supports("avx512f")) return Instructions::avx512;
  // Every processor with AVX2 has F16C too; not every compiler can ask for F16C.
  if (PALPATE_MOST_INSTRUCTIONS >= 1 && __builtin_cpu_supports("avx2")) return Instructions::avx2;
#endif
  return Instructions::baseline;
}

}  // namespace palpate
