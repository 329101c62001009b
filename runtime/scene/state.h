// What a saved state is, and what it must have in common with the scene that it is restored into.
#pragma once

#include <cstdint>

#include "formats/checksum.h"
#include "runtime/base/scene_memory.h"

struct palpate_scene;

namespace palpate {

// A running checksum of numbers.
class Digest {
 public:
  template <class... Numbers>
  Digest& add(const Numbers&... numbers) {
    (sum_.update(&numbers, sizeof numbers), ...);
    return *this;
  }
  void add_bytes(const void* bytes, std::size_t count) { sum_.update(bytes, count); }
  std::uint64_t value() const { return sum_.digest(); }

 private:
  formats::Xxh64 sum_;
};

// A checksum of the library's version, of the scene's definition but for its pointers, and of the sizes that its memory keeps.
std::uint64_t definition_of(const palpate_scene& scene);

// The state of the values and arrays that a memory keeps, as bytes behind a head. States are 8-byte aligned, and so are their sizes.
struct SceneState {
  const SceneMemory& memory;
  std::uint64_t definition;
  std::uint64_t bundle;  // its identity; 0: of no bundle

  std::size_t bytes() const;
  // Returns the bytes that it wrote.
  std::size_t write(unsigned char* state) const;
  // Whether a state that begins there, within state_bytes bytes, may be read; *bytes: of the state.
  palpate_status check(const unsigned char* state, std::size_t state_bytes, std::size_t* bytes,
                       palpate_error* error) const;
  // Of a state that was checked.
  void read(const unsigned char* state) const;
};

SceneState state_of(const palpate_scene& scene);

}  // namespace palpate
