// What a saved state must have in common with the scene that it is restored into.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"

namespace palpate {

// A checksum of the library's version, of the definition but for its pointers, and of the sizes that the memory keeps.
std::uint64_t definition_of(const palpate_scene_def& def, const SceneMemory& memory, std::uint64_t fine_surface);

}  // namespace palpate
