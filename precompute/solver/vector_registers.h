// Registers of a few doubles that side by side columns fill, and loops over a block's columns in strips of them.
#pragma once

#define PALPATE_INLINE inline __attribute__((always_inline))

namespace palpate {

template <int kLanes>
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

// Calls work.template operator()<registers>(column) for strips of kMost registers and for what remains of the width,
// which is a multiple of kLanes. kMost: at most 8.
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

// Which registers this processor has; found once.
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
