// Memory at multiples of 64 bytes. Windows has no aligned_alloc, and what its function returns must not go to free.
#pragma once

#include <cstddef>
#include <cstdlib>

#ifdef _WIN32
#include <malloc.h>
#endif

namespace palpate {

// bytes: a multiple of 64. Returns nullptr where there is no more memory.
inline void* take_aligned(std::size_t bytes) {
#ifdef _WIN32
  return _aligned_malloc(bytes, 64);
#else
  return std::aligned_alloc(64, bytes);
#endif
}

// memory: of take_aligned, or nullptr.
inline void release_aligned(void* memory) {
#ifdef _WIN32
  _aligned_free(memory);
#else
  std::free(memory);
#endif
}

}  // namespace palpate
