#include "runtime/base/scene_memory.h"

#include <cstring>

#include "runtime/base/aligned_memory.h"

namespace palpate {

void* SceneMemory::take(std::size_t count, std::size_t each) {
  if (count == 0) count = 1;
  void* memory = nullptr;
  if (count <= static_cast<std::size_t>(-1) / 2 / each && array_count_ < kMaxArrays) {
    const std::size_t bytes = (count * each + 63) / 64 * 64;
    memory = host_.allocate ? host_.allocate(host_.user, bytes, 64) : take_aligned(bytes);
    if (memory) arrays_[array_count_++] = std::memset(memory, 0, bytes), bytes_ += bytes;
  }
  if (!memory) failed_ = true;
  return memory;
}

void SceneMemory::release_all() {
  while (array_count_ > 0) {
    void* memory = arrays_[--array_count_];
    if (host_.allocate)
      host_.release(host_.user, memory);
    else
      release_aligned(memory);
  }
}

}  // namespace palpate
