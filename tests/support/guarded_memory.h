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
  ~GuardedMemory();

  palpate_allocator allocator();
  // Guard bytes that have changed so far.
  long written_outside() const;

 private:
  // On either side: an index that is some hundred elements too large meets them. A multiple of every alignment that is asked for.
  static constexpr std::size_t kGuard = 16384;
  static constexpr unsigned char kByte = 0xa5;

  void* allocate(std::size_t bytes);
  void release(unsigned char* block);
  static long changed_around(unsigned char* block, std::size_t bytes);

  std::map<unsigned char*, std::size_t> blocks_;
  long written_ = 0;  // around blocks that were released
};

}  // namespace palpate::tests
