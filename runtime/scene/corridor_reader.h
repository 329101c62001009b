// The columns of the bundle's corridor become those of the scene.
#pragma once

#include "runtime/scene/scene.h"
#include "runtime/scene/section_reader.h"

namespace palpate {

// tensors: of the bundle; touchable: [S] node of each of their columns, borrowed. The bundle has the section corridor/nodes.
palpate_status read_corridor(const SectionReader& reader, const char* effect, const std::int32_t* touchable,
                             Corridor* corridor, Tensors* tensors);

// The same for a scene, with the rows of the interior where it shapes that, before effects are built. An effect that finds the corridor there has
// nothing to do.
palpate_status read_corridor(const SectionReader& reader, const char* effect, palpate_scene& scene);

}  // namespace palpate
