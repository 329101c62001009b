// All memory of a scene, taken while it is created and released with it.
#pragma once

#include <cstddef>

#include "runtime/include/palpate/palpate.h"

namespace palpate {

class SceneMemory {
 public:
  explicit SceneMemory(const palpate_allocator& host) : host_(host) {}

  // Zeroed, 64-byte aligned; nullptr, and failed(), when the host has no more. T must be trivial.
  template <class T>
  T* array(std::size_t count) {
    return static_cast<T*>(take(count, sizeof(T)));
  }
  bool failed() const { return failed_; }

  void release_all();

 private:
  void* take(std::size_t count, std::size_t each);
  static constexpr int kMaxBlocks = 128;
  palpate_allocator host_;
  void* blocks_[kMaxBlocks] = {};
  int block_count_ = 0;
  bool failed_ = false;
};

}  // namespace palpate
