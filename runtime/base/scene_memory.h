// The memory of a scene: arrays from the host's allocator, taken while the scene is created, released together. And the list of
// what a step leaves for the next one, in these arrays and in members of the scene: palpate_scene_save copies it.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <type_traits>

#include "runtime/include/palpate/palpate.h"

namespace palpate {

// Whether T has bytes that belong to no member. A saved state would hold whatever stands in them, and two states that are the same
// would differ. Known where the compiler is GCC, else false.
template <class T>
bool has_padding() {
#if defined(__GNUC__) && !defined(__clang__)
  alignas(T) unsigned char bytes[sizeof(T)];
  std::memset(bytes, 0xff, sizeof bytes);
  __builtin_clear_padding(reinterpret_cast<T*>(bytes));
  for (const unsigned char byte : bytes)
    if (byte != 0xff) return true;
#endif
  return false;
}

class SceneMemory {
 public:
  explicit SceneMemory(const palpate_allocator& host) : host_(host) {}

  // [count] of T, zeroed, 64-byte aligned. nullptr where the host has no more memory; failed() is then true. T must be trivial.
  template <class T>
  T* array(std::size_t count) {
    return static_cast<T*>(take(count, sizeof(T)));
  }
  // One T, as its default constructor makes it. Its destructor is not called. nullptr as above.
  template <class T>
  T* make() {
    static_assert(std::is_trivially_destructible_v<T> && alignof(T) <= 64);
    void* const at = take(1, sizeof(T));
    return at ? new (at) T : nullptr;
  }
  // Takes from the same host; released on its own.
  SceneMemory of_same_host() const { return SceneMemory(host_); }
  bool failed() const { return failed_; }
  // Of all arrays so far, as they were asked of the host.
  std::uint64_t bytes() const { return bytes_; }

  void release_all();

  // Marks what a step leaves for the next one. Everything that is neither constant after the creation nor written anew before it
  // is read in a step must be marked; state_test.cpp plays on from a restored state and compares bits.
  // A number, or a struct without pointers and without padding.
  template <class T>
  void keep(T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    assert(!has_padding<T>());
    add_kept({&value, sizeof(T), 1, nullptr, false});
  }
  // The array that `array` points to when the state is saved or restored: [count]. Its elements have no pointers. used: how many
  // times `each` elements of it are in use then, a number that was marked before; nullptr: all.
  template <class T>
  void keep_array(T*& array, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    assert(!has_padding<T>());
    add_kept({&array, sizeof(T), count, nullptr, true});
  }
  template <class T>
  void keep_array(T*& array, std::size_t count, const std::int32_t& used, std::size_t each = 1) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    assert(!has_padding<T>());
    add_kept({&array, sizeof(T) * each, each > 0 ? count / each : 0, &used, true});
  }

  struct Kept {
    void* at;                  // the value, or the pointer to the array
    std::size_t bytes, count;  // of one element; elements at most
    const std::int32_t* used;  // elements in use; nullptr: all
    bool is_array;
    void* memory() const {
      void* array = at;
      if (is_array) std::memcpy(&array, at, sizeof array);
      return array;
    }
    // Where a number stands in a marked value, in bytes; -1: elsewhere.
    std::ptrdiff_t find(const std::int32_t* number) const {
      const auto begin = reinterpret_cast<std::uintptr_t>(at), asked = reinterpret_cast<std::uintptr_t>(number);
      return !is_array && asked >= begin && asked < begin + bytes ? static_cast<std::ptrdiff_t>(asked - begin) : -1;
    }
  };
  static constexpr int kMaxKept = 704;
  const Kept* kept() const { return kept_; }
  int kept_count() const { return kept_count_; }

 private:
  void add_kept(const Kept& kept) {
    if (kept_count_ == kMaxKept)
      failed_ = true;
    else
      kept_[kept_count_++] = kept;
  }
  void* take(std::size_t count, std::size_t each);
  static constexpr int kMaxArrays = 704;
  palpate_allocator host_;
  void* arrays_[kMaxArrays] = {};
  int array_count_ = 0;
  Kept kept_[kMaxKept] = {};
  int kept_count_ = 0;
  std::uint64_t bytes_ = 0;
  bool failed_ = false;
};

}  // namespace palpate
