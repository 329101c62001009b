// Draws of the bootstraps.
#pragma once

#include <cstddef>
#include <random>

namespace palpate::fit {

// Below count and uniform; the standard's distributions differ between libraries.
inline std::size_t draw(std::mt19937_64& generator, std::size_t count) {
  return static_cast<std::size_t>(static_cast<double>(generator() >> 11) * 0x1p-53 * static_cast<double>(count));
}

}  // namespace palpate::fit
