// Binds a render mesh to the surface, once, while a scene is created.
#include <algorithm>

#include "runtime/base/alignment.h"
#include "runtime/base/error_text.h"
#include "runtime/skin/skin.h"

namespace palpate {
namespace {

void store_float(Vec3 v, float* out) {
  for (int d = 0; d < 3; ++d) out[d] = static_cast<float>(v[d]);
}

struct Box {
  Vec3 low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
  void add(Vec3 p) {
    for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], p[d]), high[d] = std::max(high[d], p[d]);
  }
  double size() const { return length(high - low); }
  double distance(Vec3 p) const {
    Vec3 gap;
    for (int d = 0; d < 3; ++d) gap[d] = std::max(0.0, std::max(low[d] - p[d], p[d] - high[d]));
    return length(gap);
  }
};

}  // namespace

bool Skin::describe_triangles(SceneMemory& memory, SceneMemory& scratch, const double* nodes,
                              const std::int32_t* triangles) {
  triangles_ = memory.array<Triangle>(static_cast<std::size_t>(triangle_count_));
  double* area_about = scratch.array<double>(static_cast<std::size_t>(node_count_));
  if (memory.failed() || scratch.failed()) return false;
  const auto area = [](const Triangle& t) {
    return static_cast<double>(t.share[0]);
  };  // m^2; share[0] holds it until the loop below
  for (std::int32_t t = 0; t < triangle_count_; ++t) {
    Triangle& out = triangles_[t];
    for (int v = 0; v < 3; ++v) out.node[v] = triangles[3 * static_cast<std::size_t>(t) + v];
    const auto at = [&](int v) { return load3(nodes + 3 * static_cast<std::size_t>(out.node[v])); };
    const Vec3 edge[2] = {at(1) - at(0), at(2) - at(0)}, normal = cross(edge[0], edge[1]);
    for (int e = 0; e < 2; ++e) store_float(edge[e], out.edge[e]);
    const double square = dot(normal, normal);
    if (!(square > 0) || !unit_normal(out.edge[0], out.edge[1], out.normal)) continue;
    store_float((1 / square) * cross(edge[1], normal), out.dual[0]);
    store_float((1 / square) * cross(normal, edge[0]), out.dual[1]);
    out.share[0] = static_cast<float>(std::sqrt(square));
    for (const std::int32_t n : out.node) area_about[n] += area(out);
  }
  for (std::int32_t t = 0; t < triangle_count_; ++t) {
    Triangle& out = triangles_[t];
    if (const double own = area(out); own > 0)
      for (int v = 0; v < 3; ++v) out.share[v] = static_cast<float>(own / area_about[out.node[v]]);
  }
  return true;
}

void Skin::bind_vertex(std::int32_t v, const SurfacePoint& surface_point, Vec3 position, Vec3 surface_position) {
  Vertex& vertex = vertices_[v];
  for (int i = 0; i < 3; ++i) {
    vertex.node[i] = triangles_[surface_point.triangle].node[i];
    vertex.weight[i] = static_cast<float>(surface_point.barycentric[i]);
  }
  store_float(position - surface_position, vertex.offset);
  if (triangle_) triangle_[v] = surface_point.triangle;
  store_float(position, positions_ + 3 * static_cast<std::size_t>(v));
}

palpate_status Skin::bind(SceneMemory& memory, SceneMemory& scratch, const palpate_render_mesh& mesh,
                          const double* nodes, std::int32_t node_count, const float* preload,
                          const std::int32_t* triangles, std::int32_t triangle_count, bool dents,
                          palpate_error* error) {
  const auto bad = [&](const char* what) {
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_render_mesh: %s", what);
  };
  if (mesh.vertex_count < 1) return bad("vertex_count must be 1 or more");
  if (!mesh.positions || !is_aligned(mesh.positions) || !is_aligned(mesh.normals))
    return bad("positions must not be NULL, and arrays must be aligned as floats are");
  node_count_ = node_count, triangle_count_ = triangle_count, preload_ = preload;

  const std::size_t count = static_cast<std::size_t>(mesh.vertex_count);
  bones_ = memory.array<Bone>(static_cast<std::size_t>(node_count));
  vertices_ = memory.array<Vertex>(count);
  positions_ = memory.array<float>(3 * count);
  if (mesh.normals) normals_ = memory.array<float>(3 * count);
  if (dents && !mesh.normals) triangle_ = memory.array<std::int32_t>(count);
  SurfaceIndex surface;
  if (!describe_triangles(memory, scratch, nodes, triangles) ||
      !surface.build(scratch, nodes, triangles, triangle_count))
    return fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene's render mesh");
  Box organ;
  for (std::int32_t n = 0; n < node_count; ++n) organ.add(load3(nodes + 3 * static_cast<std::size_t>(n)));

  for (std::int32_t v = 0; v < mesh.vertex_count; ++v) {
    const float* p = mesh.positions + 3 * static_cast<std::size_t>(v);
    const Vec3 position = {p[0], p[1], p[2]};
    const double beside = organ.distance(position);
    if (!is_finite(position) || !(beside <= organ.size()))
      return fail(
          error, PALPATE_ERROR_ARGUMENT, 0,
          "palpate_render_mesh: vertex %d at %g %g %g m is not finite, or stands %g m from an organ that is %g m "
          "large; give metres in the bundle's frame",
          v, position.x, position.y, position.z, beside, organ.size());
    const SurfacePoint surface_point = surface.nearest(position);
    if (surface_point.triangle < 0) return bad("the bundle's surface has no triangles to follow");
    bind_vertex(v, surface_point, position, surface.position(surface_point));
    if (!mesh.normals) continue;
    const float* n = mesh.normals + 3 * static_cast<std::size_t>(v);
    const Vec3 normal = {n[0], n[1], n[2]};
    if (!is_finite(normal))
      return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_render_mesh: normal %d is not finite", v);
    store_float(unit_or_zero(normal), normals_ + 3 * static_cast<std::size_t>(v));
  }
  vertex_count_ = mesh.vertex_count;
  return PALPATE_OK;
}

}  // namespace palpate
