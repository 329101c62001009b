// Which vector instructions the hot loops use: one source, compiled for each, chosen when it runs. What they compute is the
// same to the bit with any.
#pragma once

#if defined(__GNUC__)
#define PALPATE_INLINE inline __attribute__((always_inline))
#define PALPATE_PREFETCH(address) __builtin_prefetch(address)
#else
#define PALPATE_INLINE inline
#define PALPATE_PREFETCH(address) static_cast<void>(address)
#endif

#if defined(__GNUC__) && defined(__x86_64__)
#define PALPATE_DISPATCHES 1
// A build may be held to fewer: 0 the baseline, 1 AVX2, 2 AVX-512. Tests are.
#ifndef PALPATE_MOST_INSTRUCTIONS
#define PALPATE_MOST_INSTRUCTIONS 2
#endif
#define PALPATE_AVX2 "avx2,f16c"
// Clang has the wish for whole registers as an option of the command line alone.
#ifdef __clang__
#define PALPATE_AVX512 "avx512f"
#else
#define PALPATE_AVX512 "avx512f,prefer-vector-width=512"
#endif
#endif

namespace palpate {

// baseline: what the build targets, SSE2 on x86-64, NEON on AArch64.
enum class Instructions { baseline, avx2, avx512 };

// So many doubles are worked on at once.
#if defined(__GNUC__)
typedef double Two __attribute__((vector_size(16)));
typedef double Four __attribute__((vector_size(32)));
typedef double Eight __attribute__((vector_size(64)));
#else
using Two = double;
#endif

// The best that this processor has.
inline Instructions best_instructions() {
#ifdef PALPATE_DISPATCHES
  if (PALPATE_MOST_INSTRUCTIONS >= 2 && __builtin_cpu_supports("avx512f")) return Instructions::avx512;
  // Every processor with AVX2 has F16C; not every compiler can ask for the latter.
  if (PALPATE_MOST_INSTRUCTIONS >= 1 && __builtin_cpu_supports("avx2")) return Instructions::avx2;
#endif
  return Instructions::baseline;
}

}  // namespace palpate
