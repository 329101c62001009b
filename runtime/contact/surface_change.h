// A touched surface whose triangles change. The effect that changes them is a body (runtime/scene/effect.h): in its prepare() it gives
// TouchedSurface the triangles that there may be, with a flag for each, and the places of all nodes at rest. The scene needs collision with the
// deformed surface, and the body has a field of its own whose norm is a length.
#pragma once

#include <cstdint>

namespace palpate {

struct TouchState;

// After the flags, the corners and the places at rest of new nodes have changed: what keeps something of these triangles follows. A contact whose
// triangle is no longer part of the surface ends, and each tool point is tested in the next step, because the bound on its distance was that from
// another surface. Between steps, in the thread of the touch; nothing is allocated. Not told are the effects: whoever keeps nodes of a triangle
// (links, grasps, loads) keeps them.
void change_surface(TouchState& touch, std::int32_t max_tools, std::int32_t max_points, const std::int32_t* triangles,
                    std::int32_t count);

}  // namespace palpate
