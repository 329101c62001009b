// A touched surface whose triangles change. The effect that changes them is a body (runtime/scene/effect.h): in its prepare() it gives
// TouchedSurface the triangles that there may be, with a flag for each, and the places of all nodes at rest. The scene needs collision with the
// deformed surface, and the body has a field of its own whose norm is a length.
#pragma once

#include <cstdint>

namespace palpate {

class SurfaceTree;
struct TouchedSurface;
struct TouchPoints;

// After the flags, the corners and the places at rest of new nodes have changed: what keeps something of these triangles follows. A contact whose
// triangle is no longer part of the surface ends, and each tool point is tested in the next step, because the bound on its distance was that from
// another surface. Between steps, in the thread of the touch; nothing is allocated. An effect that keeps nodes of a
// triangle asks TouchedSurface::divided in each step what has become of them. surface, tree, points: of one touch.
void change_surface(TouchedSurface& surface, SurfaceTree& tree, TouchPoints& points, std::int32_t max_points,
                    const std::int32_t* triangles, std::int32_t count);

}  // namespace palpate
