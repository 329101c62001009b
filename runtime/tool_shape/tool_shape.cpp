// The C functions of palpate_tool_shape.h.
#include "runtime/include/palpate/palpate_tool_shape.h"

#include <algorithm>
#include <cstdlib>
#include <new>

#include "runtime/base/host_struct.h"
#include "runtime/base/scene_memory.h"
#include "runtime/pose/pose.h"
#include "runtime/tool_shape/samples.h"

namespace palpate {

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_tool_shape_def> = sizeof(palpate_tool_shape_def);

}  // namespace palpate

using namespace palpate;

struct palpate_tool_shape {
  explicit palpate_tool_shape(const palpate_allocator& host) : allocator(host), memory(host) {}
  palpate_allocator allocator;
  SceneMemory memory;
  double* points = nullptr;  // [count][3] m, in the shape's frame
  double* placed = nullptr;  // [count][3] m, in the world
  std::int32_t count = 0;
  double patch_radius = 0;  // m
};

namespace {

constexpr std::int32_t kMostHullVertices = 256;
constexpr std::int32_t kMostTriangles = 1'000'000;

palpate_status refuse(palpate_error* error, const char* expected, double found) {
  return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_tool_shape_def: expected %s, found %g; change it", expected,
              found);
}

palpate_status no_memory(palpate_error* error) {
  return fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no memory for the tool shape");
}

palpate_status check_vertices(const palpate_tool_shape_def& def, palpate_error* error) {
  const bool hull = def.kind == PALPATE_TOOL_HULL;
  if (def.vertex_count < (hull ? 4 : 3) || (hull && def.vertex_count > kMostHullVertices) || !def.vertices)
    return refuse(error, hull ? "4 to 256 vertices of a hull" : "3 or more vertices of a mesh",
                  def.vertices ? def.vertex_count : 0);
  for (std::int32_t i = 0; i < def.vertex_count; ++i)
    if (!is_position(def.vertices + 3 * static_cast<std::size_t>(i)))
      return refuse(error, "every vertex finite and within 1e6 m; of the vertex with the number", i);
  if (hull) return PALPATE_OK;
  if (def.triangle_count < 1 || def.triangle_count > kMostTriangles || !def.triangles)
    return refuse(error, "1 to 1000000 triangles of a mesh", def.triangles ? def.triangle_count : 0);
  for (std::int32_t i = 0; i < 3 * def.triangle_count; ++i)
    if (def.triangles[i] < 0 || def.triangles[i] >= def.vertex_count)
      return refuse(error, "triangles over the mesh's vertices", def.triangles[i]);
  return PALPATE_OK;
}

palpate_status check(const palpate_tool_shape_def& def, palpate_error* error) {
  const int kind = enum_number(def.kind);
  if (kind < 0 || kind > PALPATE_TOOL_MESH) return refuse(error, "a kind that palpate_tool_shape.h lists", kind);
  if (def.max_points < 1 || def.max_points > PALPATE_MAX_TOOL_SHAPE_POINTS)
    return refuse(error, "max_points of 1 to 4096", def.max_points);
  if (kind == PALPATE_TOOL_POINT)
    return def.radius >= 0 && def.radius <= 1 ? PALPATE_OK : refuse(error, "a radius of 0 to 1 m", def.radius);
  if (!(def.spacing > 0 && def.spacing <= 1)) return refuse(error, "a spacing above 0 m, up to 1 m", def.spacing);
  if (kind >= PALPATE_TOOL_HULL) return check_vertices(def, error);
  if (!(def.radius > 0 && def.radius <= 1e3)) return refuse(error, "a radius above 0 m, up to 1000 m", def.radius);
  if (kind == PALPATE_TOOL_CAPSULE && !(def.length >= 0 && def.length <= 1e3))
    return refuse(error, "a length of 0 to 1000 m", def.length);
  return PALPATE_OK;
}

// Points that the surface needs at least, about: where they are far too many, sampling would take too long to count them.
double estimated_count(double area, double spacing) {
  return area / (spacing * spacing);
}

palpate_status too_many(const palpate_tool_shape_def& def, const char* about, double count, palpate_error* error) {
  return fail(error, PALPATE_ERROR_ARGUMENT, 0,
              "palpate_tool_shape_def: the shape needs %s%.0f points at a spacing of %g m, and max_points is %d; use a "
              "spacing of %.2g m, or raise max_points here and in the scene",
              about, count, def.spacing, static_cast<int>(def.max_points),
              1.25 * def.spacing * std::sqrt(count / def.max_points));
}

// The triangles of a hull or a mesh, in `scratch`.
palpate_status make_triangles(const palpate_tool_shape_def& def, SceneMemory& scratch, const Triangle** out,
                              std::int32_t* count, palpate_error* error) {
  const auto vertex = [&](std::int32_t v) { return load3(def.vertices + 3 * static_cast<std::size_t>(v)); };
  const bool hull = def.kind == PALPATE_TOOL_HULL;
  Triangle* triangles =
      scratch.array<Triangle>(static_cast<std::size_t>(hull ? 2 * def.vertex_count : def.triangle_count));
  if (!triangles) return no_memory(error);
  *out = triangles;
  if (!hull) {
    for (std::int32_t t = 0; t < def.triangle_count; ++t)
      for (int v = 0; v < 3; ++v) triangles[t].corner[v] = vertex(def.triangles[3 * t + v]);
    *count = def.triangle_count;
    return PALPATE_OK;
  }
  Vec3* points = scratch.array<Vec3>(static_cast<std::size_t>(def.vertex_count));
  std::int32_t* lists = scratch.array<std::int32_t>(2 * static_cast<std::size_t>(def.vertex_count));
  if (!points || !lists) return no_memory(error);
  for (std::int32_t v = 0; v < def.vertex_count; ++v) points[v] = vertex(v);
  *count = hull_triangles(points, def.vertex_count, lists, triangles);
  if (*count > 0) return PALPATE_OK;
  return fail(error, PALPATE_ERROR_ARGUMENT, 0,
              "palpate_tool_shape_def: expected vertices of a hull that do not all lie in one plane; use a mesh for a "
              "flat shape");
}

palpate_status sample(const palpate_tool_shape_def& def, SceneMemory& scratch, Samples* out, palpate_error* error) {
  out->capacity = PALPATE_MAX_TOOL_SHAPE_POINTS;
  out->points = scratch.array<Vec3>(static_cast<std::size_t>(out->capacity));
  if (!out->points) return no_memory(error);
  if (def.kind == PALPATE_TOOL_POINT) {
    out->add(Vec3{});
    return PALPATE_OK;
  }
  const Triangle* triangles = nullptr;
  std::int32_t triangle_count = 0;
  const double length = def.kind == PALPATE_TOOL_CAPSULE ? def.length : 0;
  double area = capsule_area(def.radius, length), longest = 0;
  if (def.kind >= PALPATE_TOOL_HULL) {
    if (const palpate_status status = make_triangles(def, scratch, &triangles, &triangle_count, error)) return status;
    area = triangle_area(triangles, triangle_count, &longest);
    if (!(area > 0)) return refuse(error, "triangles with an area", area);
  }
  const double about = std::max(estimated_count(area, def.spacing), longest / def.spacing);
  if (about > 2 * out->capacity) return too_many(def, "about ", about, error);
  out->area = area;
  if (triangles)
    sample_triangles(triangles, triangle_count, def.spacing, out);
  else
    sample_capsule(def.radius, length, def.spacing, out);
  if (out->count > out->capacity) return too_many(def, "more than ", out->capacity, error);
  return out->count > def.max_points ? too_many(def, "", out->count, error) : PALPATE_OK;
}

palpate_status build(palpate_tool_shape& shape, const palpate_tool_shape_def& def, palpate_error* error) {
  SceneMemory scratch(def.allocator);
  Samples samples;
  palpate_status status = sample(def, scratch, &samples, error);
  if (status == PALPATE_OK) {
    shape.count = samples.count;
    shape.points = shape.memory.array<double>(3 * static_cast<std::size_t>(samples.count));
    shape.placed = shape.memory.array<double>(3 * static_cast<std::size_t>(samples.count));
    if (!shape.points || !shape.placed) status = no_memory(error);
  }
  for (std::int32_t i = 0; status == PALPATE_OK && i < samples.count; ++i)
    store3(samples.points[i], shape.points + 3 * static_cast<std::size_t>(i));
  if (status == PALPATE_OK)
    shape.patch_radius = def.kind == PALPATE_TOOL_POINT ? def.radius : disc_of(samples.area / samples.count);
  scratch.release_all();
  return status;
}

}  // namespace

void palpate_init_tool_shape_def(palpate_tool_shape_def* def, size_t struct_bytes) {
  palpate_tool_shape_def defaults = {};
  defaults.kind = PALPATE_TOOL_SPHERE;
  defaults.max_points = 64;
  write_host_struct(defaults, def, struct_bytes);
}

palpate_status palpate_tool_shape_create(const palpate_tool_shape_def* def, palpate_tool_shape** shape,
                                         palpate_error* error) {
  if (shape) *shape = nullptr;
  if (!def || !shape) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "def and shape must not be NULL");
  palpate_tool_shape_def wanted = palpate_default_tool_shape_def();
  if (const palpate_status status = read_host_struct("tool_shape_def", def, &wanted, error)) return status;
  if ((wanted.allocator.allocate == nullptr) != (wanted.allocator.release == nullptr))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_tool_shape_def: the allocator needs both allocate and release, or neither");
  if (const palpate_status status = check(wanted, error)) return status;
  SceneMemory own(wanted.allocator);
  void* memory = own.array<std::max_align_t>((sizeof(palpate_tool_shape) + sizeof(std::max_align_t) - 1) /
                                             sizeof(std::max_align_t));
  if (!memory) return no_memory(error);
  palpate_tool_shape* created = new (memory) palpate_tool_shape(wanted.allocator);
  if (const palpate_status status = build(*created, wanted, error)) {
    palpate_tool_shape_destroy(created);
    return status;
  }
  *shape = created;
  return succeed(error);
}

void palpate_tool_shape_destroy(palpate_tool_shape* shape) {
  if (!shape) return;
  const palpate_allocator host = shape->allocator;
  shape->memory.release_all();
  shape->~palpate_tool_shape();
  if (host.allocate)
    host.release(host.user, shape);
  else
    std::free(shape);
}

int32_t palpate_tool_shape_point_count(const palpate_tool_shape* shape) {
  return shape->count;
}

const double* palpate_tool_shape_points(const palpate_tool_shape* shape) {
  return shape->points;
}

double palpate_tool_shape_patch_radius(const palpate_tool_shape* shape) {
  return shape->patch_radius;
}

void palpate_tool_shape_place(palpate_tool_shape* shape, const double position[3], const double orientation[4],
                              palpate_tool* tool) {
  Pose pose;
  const bool is_pose = read_pose(position, orientation, &pose);
  for (std::int32_t i = 0; i < shape->count; ++i) {
    double* const placed = shape->placed + 3 * static_cast<std::size_t>(i);
    if (is_pose)
      store3(pose.to_world(load3(shape->points + 3 * static_cast<std::size_t>(i))), placed);
    else
      std::fill(placed, placed + 3, static_cast<double>(NAN));  // which the touch refuses
  }
  tool->points = shape->placed, tool->point_count = shape->count;
  tool->disc_radius = shape->patch_radius;
  tool->has_torque = 1;
  std::copy(position, position + 3, tool->reference);
}
