#include "meshing/tetrahedra/repeatable_heap.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "formats/errors.h"

namespace {

// Size of the range. It takes address space only: the kernel provides memory page by page when it is used. Where a
// limit of the process (ulimit -v) does not leave the largest size, half of it is tried, and so on down to the least.
constexpr std::size_t kMostRange = std::size_t{64} << 30, kLeastRange = std::size_t{1} << 28;
constexpr std::size_t kLargest = std::size_t{1}
                                 << 20;  // larger allocations hold arrays; gmsh orders nothing by their addresses
constexpr std::size_t kFineSteps = 64;   // size classes: up to 1024 bytes in steps of 16, then powers of two

struct FreeBlock {
  FreeBlock* next;
};

char *first = nullptr, *next_free = nullptr, *last = nullptr;
FreeBlock* free_blocks[kFineSteps + 11] = {};

std::size_t class_of(std::size_t size) {
  return size <= 1024 ? (size + 15) / 16 - 1 : kFineSteps + std::bit_width(size - 1) - 11;
}
std::size_t size_of_class(std::size_t c) {
  return c < kFineSteps ? 16 * (c + 1) : std::size_t{2048} << (c - kFineSteps);
}

// A header of 16 bytes stores the size class, because operator delete may not get the size.
constexpr std::size_t kHeader = 16;

void* allocate(std::size_t size) noexcept {
  if (size == 0) size = 1;
  if (first == nullptr || size > kLargest) return std::malloc(size);
  const std::size_t c = class_of(size);
  if (FreeBlock* block = free_blocks[c]) {
    free_blocks[c] = block->next;
    return block;
  }
  const std::size_t bytes = size_of_class(c) + kHeader;
  if (static_cast<std::size_t>(last - next_free) < bytes)
    return nullptr;  // no fallback to malloc: its addresses would change the order
  char* header = next_free;
  next_free += bytes;
  *reinterpret_cast<std::size_t*>(header) = c;
  return header + kHeader;
}

void release(void* block) noexcept {
  char* bytes = static_cast<char*>(block);
  if (bytes < first || bytes >= last) return std::free(block);  // nullptr too
  auto*& list = free_blocks[*reinterpret_cast<std::size_t*>(bytes - kHeader)];
  list = new (block) FreeBlock{list};
}

void* allocate_or_throw(std::size_t size) {
  for (;;) {
    if (void* block = allocate(size)) return block;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

}  // namespace

namespace palpate {

void use_repeatable_heap() {
  if (first != nullptr) return;
  for (std::size_t size = kMostRange; size >= kLeastRange; size /= 2) {
    void* range = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (range == MAP_FAILED) continue;
    first = next_free = static_cast<char*>(range);
    last = first + size;
    return;
  }
  throw OperationError(fmt::format(
      "expected at least {} MB of address space, which the same mesh from the same input needs, found less; raise "
      "the limit (ulimit -v)",
      kLeastRange >> 20));
}

bool is_in_repeatable_heap(const void* block) {
  return first != nullptr && block >= first && block < last;
}

}  // namespace palpate

void* operator new(std::size_t size) {
  return allocate_or_throw(size);
}
void* operator new[](std::size_t size) {
  return allocate_or_throw(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return allocate(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return allocate(size);
}
void operator delete(void* block) noexcept {
  release(block);
}
void operator delete[](void* block) noexcept {
  release(block);
}
void operator delete(void* block, std::size_t) noexcept {
  release(block);
}
void operator delete[](void* block, std::size_t) noexcept {
  release(block);
}
void operator delete(void* block, const std::nothrow_t&) noexcept {
  release(block);
}
void operator delete[](void* block, const std::nothrow_t&) noexcept {
  release(block);
}
