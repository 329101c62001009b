// Code for vector registers of several widths: the same function is compiled for each width, and the widest one that the
// processor has runs. The columns of a batch stand side by side in memory, so that one register holds several columns.
#pragma once

#define PALPATE_INLINE inline __attribute__((always_inline))

// For a function whose plain loops the compiler vectorises: compiles it for three widths and chooses when the program is
// loaded. A function that it calls must be inlined (PALPATE_INLINE), or it would be compiled for the narrowest width only.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__)
#define PALPATE_VECTOR_VERSIONS __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#else
#define PALPATE_VECTOR_VERSIONS
#endif

// For a function that is written in registers: PALPATE_FOR_EACH_REGISTER(name, parameters, arguments, body, most8, most4,
// most2) compiles the template body<lanes, most> for registers of 8, 4 and 2 doubles and defines name(lanes), which returns a
// pointer to the version for that register. body must be PALPATE_INLINE, for the same reason as above.
#if defined(__x86_64__)
#define PALPATE_FOR_EACH_REGISTER(name, parameters, arguments, body, most8, most4, most2) \
  __attribute__((target("avx512f"))) void name##_512 parameters {                         \
    body<8, most8> arguments;                                                             \
  }                                                                                       \
  __attribute__((target("avx2,fma"))) void name##_256 parameters {                        \
    body<4, most4> arguments;                                                             \
  }                                                                                       \
  void name##_128 parameters {                                                            \
    body<2, most2> arguments;                                                             \
  }                                                                                       \
  auto* name(int lanes) {                                                                 \
    return lanes == 8 ? name##_512 : lanes == 4 ? name##_256 : name##_128;                \
  }
#else
#define PALPATE_FOR_EACH_REGISTER(name, parameters, arguments, body, most8, most4, most2) \
  void name##_128 parameters {                                                            \
    body<2, most2> arguments;                                                             \
  }                                                                                       \
  auto* name(int) {                                                                       \
    return name##_128;                                                                    \
  }
#endif

namespace palpate {

template <int kLanes, class Number = double>
struct VectorOf;
template <>
struct VectorOf<8> {
  typedef double Type __attribute__((vector_size(64), aligned(8), may_alias));
};
template <>
struct VectorOf<4> {
  typedef double Type __attribute__((vector_size(32), aligned(8), may_alias));
};
template <>
struct VectorOf<2> {
  typedef double Type __attribute__((vector_size(16), aligned(8), may_alias));
};
template <>
struct VectorOf<16, float> {
  typedef float Type __attribute__((vector_size(64), aligned(4), may_alias));
};
template <>
struct VectorOf<8, float> {
  typedef float Type __attribute__((vector_size(32), aligned(4), may_alias));
};
template <>
struct VectorOf<4, float> {
  typedef float Type __attribute__((vector_size(16), aligned(4), may_alias));
};

// Calls work.template operator()<registers>(column) for strips of kMost registers and then for the rest of the width.
// width: a multiple of kLanes; kMost: at most 8.
template <int kLanes, int kMost, class Work>
PALPATE_INLINE void over_strips(int width, const Work& work) {
  int at = 0;
  for (; at + kMost * kLanes <= width; at += kMost * kLanes) work.template operator()<kMost>(at);
  const int left = (width - at) / kLanes;
  if constexpr (kMost > 4)
    if (left & 4) work.template operator()<4>(at), at += 4 * kLanes;
  if constexpr (kMost > 2)
    if (left & 2) work.template operator()<2>(at), at += 2 * kLanes;
  if constexpr (kMost > 1)
    if (left & 1) work.template operator()<1>(at);
}

// Doubles in the widest vector register that this processor has; determined once.
inline int lanes_here() {
#if defined(__x86_64__)
  static const int lanes = __builtin_cpu_supports("avx512f")                                 ? 8
                           : __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? 4
                                                                                             : 2;
  return lanes;
#else
  return 2;
#endif
}

}  // namespace palpate
