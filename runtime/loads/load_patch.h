// A patch of the surface that bears a load: the nodes below it, with the share of the patch's area that belongs to each.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

struct LoadPatch {
  std::int32_t* node = nullptr;  // [count]
  double* weight = nullptr;      // [count] above 0, with the sum 1
  std::int32_t count = 0;
  double area = 0;  // m^2
};

// What of the surface is within `radius` of the surface point nearest to `centre`, on triangles that face as that point's does, within 60 degrees. A patch that is
// smaller than the parts into which triangles are divided is that point alone, with the area of the disc. triangles: [][3]; nodes: of the surface.
// *patch: without nodes where `centre` is farther than `radius` from the surface. False: there is no memory.
bool find_patch(SceneMemory& memory, SurfaceIndex& surface, const std::int32_t* triangles, std::int32_t nodes,
                Vec3 centre, double radius, LoadPatch* patch);

}  // namespace palpate
