// A host's memory with guard bytes around each block. A library that writes outside of its blocks changes them. Under the address
// sanitizer reading them ends the test, too.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>

#include "runtime/include/palpate/palpate.h"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/asan_interface.h>
#else
#define ASAN_POISON_MEMORY_REGION(at, bytes) ((void)(at), (void)(bytes))
#define ASAN_UNPOISON_MEMORY_REGION(at, bytes) ((void)(at), (void)(bytes))
#endif

namespace palpate::tests {

class GuardedMemory {
 public:
  GuardedMemory() = default;
  GuardedMemory(const GuardedMemory&) = delete;
  ~GuardedMemory() {
    while (!blocks_.empty()) release(blocks_.begin()->first);
  }

  palpate_allocator allocator() {
    palpate_allocator made = {};
    made.user = this;
    made.allocate = [](void* user, std::size_t bytes, std::size_t) {
      return static_cast<GuardedMemory*>(user)->allocate(bytes);
    };
    made.release = [](void* user, void* memory) {
      static_cast<GuardedMemory*>(user)->release(static_cast<unsigned char*>(memory));
    };
    return made;
  }
  // Guard bytes that have changed so far.
  long written_outside() const {
    long written = written_;
    for (const auto& [block, bytes] : blocks_) written += changed_around(block, bytes);
    return written;
  }

 private:
  // On either side: an index that is some hundred elements too large meets them. A multiple of every alignment that is asked for.
  static constexpr std::size_t kGuard = 16384;
  static constexpr unsigned char kByte = 0xa5;

  void* allocate(std::size_t bytes) {
    auto* const begin = static_cast<unsigned char*>(std::aligned_alloc(64, (bytes + 2 * kGuard + 63) / 64 * 64));
    if (!begin) return nullptr;
    unsigned char* const block = begin + kGuard;
    std::fill(begin, block, kByte), std::fill(block + bytes, block + bytes + kGuard, kByte);
    ASAN_POISON_MEMORY_REGION(begin, kGuard);
    ASAN_POISON_MEMORY_REGION(block + bytes, kGuard);
    blocks_[block] = bytes;
    return block;
  }
  void release(unsigned char* block) {
    const auto found = blocks_.find(block);
    if (found == blocks_.end()) return;  // nullptr
    written_ += changed_around(block, found->second);
    ASAN_UNPOISON_MEMORY_REGION(block - kGuard, kGuard);
    ASAN_UNPOISON_MEMORY_REGION(block + found->second, kGuard);
    std::free(block - kGuard);
    blocks_.erase(found);
  }
  static long changed_around(unsigned char* block, std::size_t bytes) {
    long changed = 0;
    for (unsigned char* const guard : {block - kGuard, block + bytes}) {
      ASAN_UNPOISON_MEMORY_REGION(guard, kGuard);
      changed += static_cast<long>(kGuard) - static_cast<long>(std::count(guard, guard + kGuard, kByte));
      ASAN_POISON_MEMORY_REGION(guard, kGuard);
    }
    return changed;
  }

  std::map<unsigned char*, std::size_t> blocks_;
  long written_ = 0;  // around blocks that were released
};

}  // namespace palpate::tests
