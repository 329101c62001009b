#include "runtime/contact/surface_change.h"

#include "runtime/contact/touch.h"

namespace palpate {

void change_surface(TouchedSurface& surface, SurfaceTree& tree, TouchPoints& points, std::int32_t max_points,
                    const std::int32_t* triangles, std::int32_t count) {
  ++surface.changes, ++surface.versions;
  tree.change(triangles, count);
  surface.index.change(triangles, count);
  if (surface.measure.is_built()) surface.measure.change(tree.fans());
  for (PointState* const of_tool : points.of_tool)
    for (std::int32_t i = 0; of_tool && i < max_points; ++i) {
      PointState& point = of_tool[i];
      point.clear = {};
      if (!point.contact || surface.is_active(point.anchor.triangle)) continue;
      point.contact = point.through = point.doubted = false;
      point.has_ended = true;
    }
}

}  // namespace palpate
