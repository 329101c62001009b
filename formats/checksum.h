// XXH64 of a range of bytes (the xxHash algorithm, 64 bits, seed 0), whole or streamed. No dependency, no allocation.
#pragma once

#include <cstddef>
#include <cstdint>

namespace palpate::formats {

class Xxh64 {
 public:
  void update(const void* bytes, std::size_t count);
  std::uint64_t digest() const;

 private:
  std::uint64_t lane_[4] = {0x60ea27eeadc0b5d6ull, 0xc2b2ae3d27d4eb4full, 0, 0x61c8864e7a143579ull};
  std::uint64_t total_ = 0;
  unsigned char tail_[32] = {};
  std::size_t tail_count_ = 0;
};

std::uint64_t xxh64(const void* bytes, std::size_t count);

}  // namespace palpate::formats
