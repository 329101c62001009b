// The memory of a scene: arrays from the host's allocator, taken while the scene is created, released together.
#pragma once

#include <cstddef>

#include "runtime/include/palpate/palpate.h"

namespace palpate {

class SceneMemory {
 public:
  explicit SceneMemory(const palpate_allocator& host) : host_(host) {}

  // [count] of T, zeroed, 64-byte aligned. nullptr where the host has no more memory; failed() is then true. T must be trivial.
  template <class T>
  T* array(std::size_t count) {
    return static_cast<T*>(take(count, sizeof(T)));
  }
  // Takes from the same host; released on its own.
  SceneMemory of_same_host() const { return SceneMemory(host_); }
  bool failed() const { return failed_; }

  void release_all();

 private:
  void* take(std::size_t count, std::size_t each);
  static constexpr int kMaxArrays = 128;
  palpate_allocator host_;
  void* arrays_[kMaxArrays] = {};
  int array_count_ = 0;
  bool failed_ = false;
};

}  // namespace palpate
