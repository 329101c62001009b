// Functions compiled for several widths of vector registers; the widest that the processor has is taken when they run.
#pragma once

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__)
#define PALPATE_WIDE __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#else
#define PALPATE_WIDE
#endif
// What a PALPATE_WIDE function calls must be compiled into it.
#define PALPATE_INLINE inline __attribute__((always_inline))
