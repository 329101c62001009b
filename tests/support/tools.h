// Structs that a host passes to the runtime, filled in one expression.
#pragma once

#include "runtime/include/palpate/palpate_complete.h"

namespace palpate::tests {

// How a test opens a bundle's file.
inline palpate_bundle_options options_for(palpate_file_access access) {
  palpate_bundle_options options = palpate_default_bundle_options();
  options.file_access = access;
  return options;
}

// A tool of points alone. points: [count][3] m, borrowed.
inline palpate_tool point_tool(const double* points, std::int32_t count = 1, double disc_radius = 0,
                               double friction = 0, std::int32_t hold = 0) {
  palpate_tool tool = palpate_default_tool();
  tool.points = points, tool.point_count = count;
  tool.disc_radius = disc_radius, tool.friction = friction, tool.hold = hold;
  return tool;
}

// A tool of grips alone. grips: [count], borrowed.
inline palpate_tool grip_tool(const palpate_grip* grips, std::int32_t count = 1, double disc_radius = 0,
                              std::int32_t hold = 0) {
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips, tool.grip_count = count;
  tool.disc_radius = disc_radius, tool.hold = hold;
  return tool;
}

// Arrays of `capacity` rows, borrowed; either may be NULL.
inline palpate_shape_out shape_out(float* displacements, float* positions, std::int32_t capacity) {
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = displacements, out.positions = positions, out.node_capacity = capacity;
  return out;
}
inline palpate_skin_out skin_out(float* positions, float* normals, std::int32_t capacity) {
  palpate_skin_out out = palpate_default_skin_out();
  out.positions = positions, out.normals = normals, out.vertex_capacity = capacity;
  return out;
}

// [count] vertices, borrowed; normals may be NULL.
inline palpate_render_mesh render_mesh(const float* positions, const float* normals, std::int32_t count) {
  palpate_render_mesh mesh = palpate_default_render_mesh();
  mesh.positions = positions, mesh.normals = normals, mesh.vertex_count = count;
  return mesh;
}

}  // namespace palpate::tests
