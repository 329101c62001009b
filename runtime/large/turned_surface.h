// How the deformed surface has turned at a contact: laws act along its present normal.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/surface/node_fans.h"

namespace palpate {

class TurnedSurface {
 public:
  // All borrowed.
  struct Source {
    const double* rest = nullptr;  // [nodes][3] m
    std::int32_t nodes = 0, triangle_count = 0;
    const std::int32_t* triangles = nullptr;  // [triangle_count][3] node indices, checked
    const NodeFans* fans = nullptr;           // of a surface that changes; nullptr: of all triangles, for good
  };
  bool create(SceneMemory& memory, const Source& source);
  bool made() const { return source_.fans != nullptr; }

  // The mean normals of some nodes, weighted; unit, or zero where they are not defined.
  struct Normals {
    Vec3 rest, now;
  };
  // displacement(node): Vec3, m. Cost: some six triangles a node.
  template <class Displacement>
  Normals normals(const ContactNode* nodes, std::int32_t count, Displacement displacement) const {
    Normals mean;
    for (std::int32_t e = 0; e < count; ++e) {
      mean.rest += nodes[e].weight * unit_or_zero(normal(nodes[e].node, [](std::int32_t) { return Vec3{}; }));
      mean.now += nodes[e].weight * unit_or_zero(normal(nodes[e].node, displacement));
    }
    return {unit_or_zero(mean.rest), unit_or_zero(mean.now)};
  }
  // The smallest rotation between two such normals. The identity where one is not defined, or where they are more than 150 degrees apart.
  static Mat3 rotation(Vec3 from, Vec3 to);

 private:
  // The sum of the normals of the triangles around a node, weighted by their areas.
  template <class Displacement>
  Vec3 normal(std::int32_t node, Displacement displacement) const {
    Vec3 sum;
    source_.fans->around(node, [&](std::int32_t triangle, int) {
      Vec3 corner[3];
      for (int v = 0; v < 3; ++v) {
        const std::int32_t n = source_.triangles[3 * static_cast<std::size_t>(triangle) + static_cast<std::size_t>(v)];
        corner[v] = load3(source_.rest + 3 * static_cast<std::size_t>(n)) + displacement(n);
      }
      sum += cross(corner[1] - corner[0], corner[2] - corner[0]);
    });
    return sum;
  }

  Source source_;
  NodeFans own_;
};

}  // namespace palpate
