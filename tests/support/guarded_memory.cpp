#include "tests/support/guarded_memory.h"

namespace palpate::tests {

GuardedMemory::~GuardedMemory() {
  while (!blocks_.empty()) release(blocks_.begin()->first);
}

palpate_allocator GuardedMemory::allocator() {
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

long GuardedMemory::written_outside() const {
  long written = written_;
  for (const auto& [block, bytes] : blocks_) written += changed_around(block, bytes);
  return written;
}

void* GuardedMemory::allocate(std::size_t bytes) {
  auto* const begin = static_cast<unsigned char*>(std::aligned_alloc(64, (bytes + 2 * kGuard + 63) / 64 * 64));
  if (!begin) return nullptr;
  unsigned char* const block = begin + kGuard;
  std::fill(begin, block, kByte), std::fill(block + bytes, block + bytes + kGuard, kByte);
  ASAN_POISON_MEMORY_REGION(begin, kGuard);
  ASAN_POISON_MEMORY_REGION(block + bytes, kGuard);
  blocks_[block] = bytes;
  return block;
}

void GuardedMemory::release(unsigned char* block) {
  const auto found = blocks_.find(block);
  if (found == blocks_.end()) return;  // nullptr
  written_ += changed_around(block, found->second);
  ASAN_UNPOISON_MEMORY_REGION(block - kGuard, kGuard);
  ASAN_UNPOISON_MEMORY_REGION(block + found->second, kGuard);
  std::free(block - kGuard);
  blocks_.erase(found);
}

long GuardedMemory::changed_around(unsigned char* block, std::size_t bytes) {
  long changed = 0;
  for (unsigned char* const guard : {block - kGuard, block + bytes}) {
    ASAN_UNPOISON_MEMORY_REGION(guard, kGuard);
    changed += static_cast<long>(kGuard) - static_cast<long>(std::count(guard, guard + kGuard, kByte));
    ASAN_POISON_MEMORY_REGION(guard, kGuard);
  }
  return changed;
}

}  // namespace palpate::tests
