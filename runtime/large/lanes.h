// Numbers that the element loops compute with: a plain number, or eight of them side by side. The same source serves both, so
// that tests compute in double precision what a step computes in single precision.
#pragma once

#include <cstddef>
#include <cstring>

#include "runtime/base/instructions.h"

namespace palpate {

#if defined(__GNUC__)
// Every function that takes or returns these is inlined, so no call depends on how the compiler passes them.
#pragma GCC diagnostic ignored "-Wpsabi"
typedef float EightFloats __attribute__((vector_size(32)));
typedef double EightDoubles __attribute__((vector_size(64)));
#else
using EightFloats = float;
using EightDoubles = double;
#endif

// In front of a loop that the compiler leaves as it is written: unrolled, the longest ones would be a tenth of the library.
#if defined(__clang__)
#define PALPATE_ROLLED _Pragma("clang loop unroll(disable)")
#elif defined(__GNUC__)
#define PALPATE_ROLLED _Pragma("GCC unroll 1")
#else
#define PALPATE_ROLLED
#endif

// The plain number of which Real has one or eight.
template <class Real>
struct ScalarOf {
  using type = Real;
};
#if defined(__GNUC__)
template <>
struct ScalarOf<EightFloats> {
  using type = float;
};
template <>
struct ScalarOf<EightDoubles> {
  using type = double;
};
#endif
template <class Real>
using Scalar = typename ScalarOf<Real>::type;
template <class Real>
inline constexpr int kLanesOf = static_cast<int>(sizeof(Real) / sizeof(Scalar<Real>));

template <class Real>
PALPATE_INLINE Real smaller(const Real& a, const Real& b) {
  return a < b ? a : b;
}
template <class Real>
PALPATE_INLINE Real larger(const Real& a, const Real& b) {
  return a > b ? a : b;
}

template <class Real>
PALPATE_INLINE Real magnitude(const Real& a) {
  return larger<Real>(a, -a);
}

// Sets one lane.
template <class Real>
PALPATE_INLINE void put_lane(Real& lanes, int lane, double value) {
  const auto number = static_cast<Scalar<Real>>(value);
  std::memcpy(reinterpret_cast<unsigned char*>(&lanes) + sizeof number * static_cast<std::size_t>(lane), &number,
              sizeof number);
}

}  // namespace palpate
