// All memory of a scene, taken while it is created and released with it.
#pragma once

#include <cstdlib>
#include <cstring>

#include "runtime/include/palpate/palpate.h"

namespace palpate {

class SceneMemory {
 public:
  explicit SceneMemory(const palpate_allocator& host) : host_(host) {}

  // Zeroed, 64-byte aligned; nullptr, and failed(), when the host has no more. T must be trivial.
  template <class T>
  T* array(std::size_t count) {
    if (count == 0) count = 1;
    if (count > static_cast<std::size_t>(-1) / 2 / sizeof(T)) return fail<T>();
    if (block_count_ == kMaxBlocks) return fail<T>();
    const std::size_t bytes = (count * sizeof(T) + 63) / 64 * 64;
    void* memory = host_.allocate ? host_.allocate(host_.user, bytes, 64) : std::aligned_alloc(64, bytes);
    if (!memory) return fail<T>();
    std::memset(memory, 0, bytes);
    blocks_[block_count_++] = memory;
    return static_cast<T*>(memory);
  }
  bool failed() const { return failed_; }

  void release_all() {
    while (block_count_ > 0) {
      void* memory = blocks_[--block_count_];
      if (host_.allocate)
        host_.release(host_.user, memory);
      else
        std::free(memory);
    }
  }

 private:
  template <class T>
  T* fail() {
    failed_ = true;
    return nullptr;
  }
  static constexpr int kMaxBlocks = 128;
  palpate_allocator host_;
  void* blocks_[kMaxBlocks] = {};
  int block_count_ = 0;
  bool failed_ = false;
};

}  // namespace palpate
