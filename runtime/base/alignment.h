// Whether a pointer that a host passed may be read as the type it claims: some processors fault on one that is not aligned.
#pragma once

#include <cstdint>

namespace palpate {

template <class T>
bool is_aligned(const T* pointer) {
  return reinterpret_cast<std::uintptr_t>(pointer) % alignof(T) == 0;
}

}  // namespace palpate
