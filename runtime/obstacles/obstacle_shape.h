// The surface of an obstacle in its own frame: which place of it is nearest to a point, and on which side the point is.
#pragma once

#include <cstdint>

#include "runtime/base/error_text.h"
#include "runtime/base/scene_memory.h"
#include "runtime/include/palpate/palpate_obstacles.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

struct ObstaclePlace {
  Vec3 at;         // m, of the surface
  Vec3 normal;     // unit, outward; over an edge the way to the point
  double gap = 0;  // m, of the point along the normal; below 0 inside
};

class ObstacleShape {
 public:
  // Copies the surface. The sentence of what is wrong with it; nullptr: nothing, unless the memory has failed.
  const char* create(SceneMemory& memory, const palpate_obstacle& from);

  // The place nearest to p within `within` metres. False: there is none, or it is on the border of an open surface and p is behind that.
  bool nearest(Vec3 p, double within, QueryWork* work, ObstaclePlace* place);

  Vec3 low() const { return tree_.low(); }
  Vec3 high() const { return tree_.high(); }
  std::int32_t triangles() const { return tree_.triangle_count(); }

 private:
  const char* copy(SceneMemory& memory, const palpate_obstacle& from);
  const char* find_normals(SceneMemory& memory);
  std::int32_t count_edge(std::int32_t from, std::int32_t to) const;
  bool is_on_border(const SurfacePoint& place) const;
  Vec3 normal_at(const SurfacePoint& place, Vec3 flat) const;

  SurfaceTree tree_;
  Vec3* normal_ = nullptr;             // [vertices] unit: of the triangles around, by their areas
  std::int32_t* on_border_ = nullptr;  // [vertices] 1: an edge there has one triangle
};

}  // namespace palpate
