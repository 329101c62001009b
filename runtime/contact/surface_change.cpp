#include "runtime/contact/surface_change.h"

#include "runtime/contact/touch.h"

namespace palpate {

void change_surface(TouchState& touch, std::int32_t max_tools, std::int32_t max_points, const std::int32_t* triangles,
                    std::int32_t count) {
  TouchedSurface& surface = touch.surface;
  ++surface.changes;
  touch.tree.change(triangles, count);
  surface.index.change(triangles, count);
  if (surface.measure.is_built()) surface.measure.change(touch.tree.fans());
  for (std::int32_t t = 0; t < max_tools; ++t)
    for (std::int32_t i = 0; i < max_points; ++i) {
      PointState& point = touch.points.of_tool[t][i];
      point.clear = {};
      if (!point.contact || surface.is_active(point.anchor.triangle)) continue;
      point.contact = point.through = point.doubted = false;
      point.has_ended = true;
    }
}

}  // namespace palpate
