// IEEE half precision in integers and exact arithmetic. The results equal the processor's own conversion, in every build
// and also where the host flushes subnormal numbers to zero.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace palpate::formats {

// Exact for every half, subnormals included.
inline float float_of_half(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16, magnitude = half & 0x7fffu;
  const std::uint32_t normal = (magnitude << 13) + (magnitude >= 0x7c00u ? 0x70000000u : 0x38000000u);
  const std::uint32_t subnormal =
      std::bit_cast<std::uint32_t>(static_cast<float>(static_cast<std::int32_t>(magnitude)) * 0x1p-24f);
  return std::bit_cast<float>(sign | (magnitude < 0x0400u ? subnormal : normal));
}

// Of a number as a bundle stores it.
inline float float_of(float stored) {
  return stored;
}
inline float float_of(double stored) {
  return static_cast<float>(stored);
}
inline float float_of(std::uint16_t stored) {
  return float_of_half(stored);
}

// Rounds to the nearest half, ties to even; a number that is too large becomes infinite.
inline std::uint16_t half_of(double number) {
  const std::uint32_t sign = std::signbit(number) ? 0x8000u : 0u;
  const double size = std::fabs(number);
  if (size == 0) return static_cast<std::uint16_t>(sign);
  if (!(size < 65520)) return static_cast<std::uint16_t>(sign | (std::isnan(number) ? 0x7e00u : 0x7c00u));
  int exponent = 0;
  std::frexp(size, &exponent);
  // Spacing of halves around size: 2^-24 below 2^-14, 11 bits above. A mantissa that rounds up carries into the exponent.
  const int spacing = exponent - 11 < -24 ? -24 : exponent - 11;
  const auto steps = static_cast<std::uint32_t>(std::nearbyint(std::ldexp(size, -spacing)));
  return static_cast<std::uint16_t>(sign | (steps + (static_cast<std::uint32_t>(spacing + 24) << 10)));
}

}  // namespace palpate::formats
