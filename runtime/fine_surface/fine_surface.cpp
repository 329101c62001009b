#include "runtime/fine_surface/fine_surface.h"

#include <algorithm>

#include "formats/checksum.h"
#include "runtime/base/alignment.h"
#include "runtime/base/error_text.h"

namespace palpate {
namespace {

// Farther from the mesh than this many of its mean edges, a vertex is not on the same organ.
constexpr double kFarthest = 1;
// An offset below this share of a mean edge turns by no more than the rounding of the host's positions.
constexpr double kNoOffset = 1e-6;
constexpr std::int32_t kMostVertices = 10'000'000;

palpate_status no_memory(palpate_error* error) {
  return fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene's fine surface");
}

double mean_edge(const double* nodes, const std::int32_t* triangles, std::int32_t count) {
  double sum = 0;
  for (std::int32_t t = 0; t < count; ++t)
    for (int v = 0; v < 3; ++v)
      sum += length(load3(nodes + 3 * static_cast<std::size_t>(triangles[3 * t + v])) -
                    load3(nodes + 3 * static_cast<std::size_t>(triangles[3 * t + (v + 1) % 3])));
  return count > 0 ? sum / (3.0 * count) : 0;
}

}  // namespace

// Copies and checks the numbers that the host gave.
palpate_status FineSurface::take(SceneMemory& memory, SceneMemory& scratch, const palpate_fine_surface& from,
                                 palpate_error* error) {
  const auto bad = [&](const char* what) {
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_fine_surface: %s", what);
  };
  if (from.vertex_count < 4 || from.triangle_count < 4)
    return bad("a closed surface has 4 vertices or more and 4 triangles or more");
  if (from.vertex_count > kMostVertices || from.triangle_count > 2 * kMostVertices)
    return bad("vertex_count must be 10 million or less, and triangle_count 20 million or less");
  if (!from.positions || !from.triangles || !is_aligned(from.positions) || !is_aligned(from.triangles))
    return bad("positions and triangles must not be NULL, and must be aligned as their numbers are");
  const std::size_t numbers = 3 * static_cast<std::size_t>(from.vertex_count),
                    indices = 3 * static_cast<std::size_t>(from.triangle_count);
  rest_ = memory.array<double>(numbers);
  triangles_ = memory.array<std::int32_t>(indices);
  if (memory.failed()) return no_memory(error);
  std::copy(from.positions, from.positions + numbers, rest_);
  std::copy(from.triangles, from.triangles + indices, triangles_);
  for (std::size_t i = 0; i < numbers; ++i)
    if (!(std::fabs(rest_[i]) <= 1e6))
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_fine_surface: vertex %d at %g %g %g is not finite or beyond 1e6 m; give metres",
                  static_cast<int>(i / 3), rest_[i / 3 * 3], rest_[i / 3 * 3 + 1], rest_[i / 3 * 3 + 2]);
  for (std::size_t i = 0; i < indices; ++i)
    if (triangles_[i] < 0 || triangles_[i] >= from.vertex_count)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_fine_surface: triangle %d has vertex %d; expected 0 .. %d",
                  static_cast<int>(i / 3), static_cast<int>(triangles_[i]), static_cast<int>(from.vertex_count - 1));
  vertex_count_ = from.vertex_count, triangle_count_ = from.triangle_count;
  formats::Xxh64 sum;
  sum.update(rest_, numbers * sizeof *rest_);
  sum.update(triangles_, indices * sizeof *triangles_);
  identity_ = sum.digest();
  return check_closed(scratch, error);
}

// Every edge belongs to two triangles, once in each direction, and the surface encloses a volume.
palpate_status FineSurface::check_closed(SceneMemory& scratch, palpate_error* error) const {
  const std::size_t count = 3 * static_cast<std::size_t>(triangle_count_);
  // An edge from a to b as a number, the lower vertex first; the last bit is its direction.
  auto* const edges = scratch.array<std::uint64_t>(count);
  if (!edges) return no_memory(error);
  double volume = 0;
  for (std::int32_t t = 0; t < triangle_count_; ++t) {
    const std::int32_t* vertex = corners(t);
    if (vertex[0] == vertex[1] || vertex[1] == vertex[2] || vertex[2] == vertex[0])
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_fine_surface: triangle %d has a vertex twice; leave such triangles out", t);
    Vec3 at[3];
    for (int v = 0; v < 3; ++v) {
      at[v] = load3(rest_ + 3 * static_cast<std::size_t>(vertex[v]));
      const auto a = static_cast<std::uint64_t>(vertex[v]), b = static_cast<std::uint64_t>(vertex[(v + 1) % 3]);
      edges[3 * static_cast<std::size_t>(t) + static_cast<std::size_t>(v)] =
          std::min(a, b) << 33 | std::max(a, b) << 1 | (a < b);
    }
    volume += dot(at[0] - load3(rest_), cross(at[1] - at[0], at[2] - at[0])) / 6;
  }
  std::sort(edges, edges + count);
  for (std::size_t e = 0; e < count; e += 2) {
    const bool pair = e + 1 < count && edges[e] + 1 == edges[e + 1] && (edges[e] & 1) == 0,
               third = e + 2 < count && edges[e + 2] >> 1 == edges[e] >> 1;
    if (!pair || third)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_fine_surface: the edge between vertices %d and %d does not belong to two triangles that run "
                  "through it in opposite directions; give a closed surface, counter-clockwise from outside, and "
                  "each vertex once",
                  static_cast<int>(edges[e] >> 33), static_cast<int>(edges[e] >> 1 & 0xffffffff));
  }
  if (!(volume > 0))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_fine_surface: the surface encloses %g m^3; give its triangles counter-clockwise from outside",
                volume);
  return PALPATE_OK;
}

bool FineSurface::find_fans(SceneMemory& memory, const Mesh& mesh) {
  const std::size_t count = 3 * static_cast<std::size_t>(mesh.triangle_count),
                    nodes = static_cast<std::size_t>(mesh.node_count);
  fan_start_ = memory.array<std::int32_t>(nodes + 1);
  fan_ = memory.array<std::int32_t>(count);
  if (memory.failed()) return false;
  for (std::size_t i = 0; i < count; ++i) ++fan_start_[mesh.triangles[i] + 1];
  for (std::size_t n = 0; n < nodes; ++n) fan_start_[n + 1] += fan_start_[n];
  // Filled from the back: each start moves to its own place, and a fan is in the order of the triangles.
  for (std::size_t i = count; i-- > 0;) fan_[--fan_start_[mesh.triangles[i] + 1]] = static_cast<std::int32_t>(i / 3);
  for (std::size_t n = 0; n < nodes; ++n) fan_start_[n] = fan_start_[n + 1];
  fan_start_[nodes] = static_cast<std::int32_t>(count);
  return true;
}

void FineSurface::measure_normals() {
  for (std::int32_t t = 0; t < triangle_count_; ++t) {
    const Vec3 a = index_.corner(t, 0), twice = cross(index_.corner(t, 1) - a, index_.corner(t, 2) - a);
    for (int v = 0; v < 3; ++v) area_[corners(t)[v]] += (1.0 / 6) * twice;
  }
}

// What the vertices' motion is made of: the gradients of the mesh's triangles.
class FineSurface::Binding {
 public:
  bool create(SceneMemory& scratch, const FineSurface& fine, const Mesh& mesh) {
    fine_ = &fine, mesh_ = &mesh;
    triangles_ = scratch.array<Triangle>(static_cast<std::size_t>(mesh.triangle_count));
    area_about_ = scratch.array<double>(static_cast<std::size_t>(mesh.node_count));
    slot_ = scratch.array<std::int32_t>(static_cast<std::size_t>(mesh.node_count));
    node_ = scratch.array<std::int32_t>(static_cast<std::size_t>(mesh.node_count));
    sum_ = scratch.array<Mat3>(static_cast<std::size_t>(mesh.node_count));
    if (scratch.failed()) return false;
    std::fill(slot_, slot_ + mesh.node_count, -1);
    for (std::int32_t t = 0; t < mesh.triangle_count; ++t) describe(t);
    return true;
  }

  // Gathers the nodes of a vertex' turns with their parts. Returns their number.
  std::int32_t gather(const Vertex& bound) {
    for (std::int32_t e = 0; e < count_; ++e) slot_[node_[e]] = -1;
    count_ = 0;
    for (int i = 0; i < 3; ++i) {
      const std::int32_t node = mesh_->triangles[3 * static_cast<std::size_t>(bound.triangle) + i];
      if (bound.weight[i] == 0 || !(area_about_[node] > 0)) continue;
      for (std::int32_t f = fine_->fan_start_[node]; f < fine_->fan_start_[node + 1]; ++f)
        add(fine_->fan_[f], bound.weight[i] * triangles_[fine_->fan_[f]].area / area_about_[node], bound.offset);
    }
    return count_;
  }
  void write(Turn* turn) const {
    for (std::int32_t e = 0; e < count_; ++e, ++turn) {
      turn->node = node_[e];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) turn->m[i][j] = static_cast<float>(sum_[e].m[i][j]);
    }
  }

 private:
  struct Triangle {
    Vec3 gradient[3];  // 1/m, of the barycentric weights; zero for a triangle without area, like all fields
    Vec3 normal;
    double area;
  };
  Vec3 at(std::int32_t node) const { return load3(mesh_->nodes + 3 * static_cast<std::size_t>(node)); }
  void describe(std::int32_t t) {
    const std::int32_t* node = mesh_->triangles + 3 * static_cast<std::size_t>(t);
    Triangle& out = triangles_[t];
    const Vec3 normal = cross(at(node[1]) - at(node[0]), at(node[2]) - at(node[0]));
    const double square = dot(normal, normal);
    out.normal = unit_or_zero(normal);
    if (!(square > 0) || !(length(out.normal) > 0)) return;
    out.area = std::sqrt(square);
    for (int v = 0; v < 3; ++v) {
      out.gradient[v] = (1 / square) * cross(normal, at(node[(v + 2) % 3]) - at(node[(v + 1) % 3]));
      area_about_[node[v]] += out.area;
    }
  }
  // Adds share times the triangle's part of H o.
  void add(std::int32_t t, double share, Vec3 offset) {
    const Triangle& triangle = triangles_[t];
    if (!(triangle.area > 0)) return;
    const double across = dot(triangle.normal, offset);
    for (int v = 0; v < 3; ++v) {
      const std::int32_t node = mesh_->triangles[3 * static_cast<std::size_t>(t) + v];
      std::int32_t& entry = slot_[node];
      if (entry < 0) {
        entry = count_++;
        node_[entry] = node, sum_[entry] = Mat3{};
      }
      const Vec3 g = triangle.gradient[v];
      Mat3& sum = sum_[entry];
      for (int i = 0; i < 3; ++i) {
        sum.m[i][i] += share * dot(g, offset);
        for (int j = 0; j < 3; ++j) sum.m[i][j] -= share * across * g[i] * triangle.normal[j];
      }
    }
  }

  const FineSurface* fine_ = nullptr;
  const Mesh* mesh_ = nullptr;
  Triangle* triangles_ = nullptr;  // [triangles]
  double* area_about_ = nullptr;   // [nodes] m^2, twice the area
  std::int32_t* slot_ = nullptr;   // [nodes] in the list below, or -1
  std::int32_t* node_ = nullptr;   // [count_]
  Mat3* sum_ = nullptr;            // [count_]
  std::int32_t count_ = 0;
};

palpate_status FineSurface::bind(SceneMemory& memory, SceneMemory& scratch, const palpate_fine_surface& from,
                                 const Mesh& mesh, const double* rest, palpate_error* error) {
  mesh_triangles_ = mesh.triangles, mesh_rest_ = rest;
  if (mesh.triangle_count < 1)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_fine_surface: the bundle's surface has no triangles to follow");
  if (const palpate_status status = take(memory, scratch, from, error)) return status;
  const std::size_t count = static_cast<std::size_t>(vertex_count_);
  vertices_ = memory.array<Vertex>(count);
  area_ = memory.array<Vec3>(count);
  SurfaceIndex surface;
  Binding binding;
  if (!find_fans(memory, mesh) || !surface.build(scratch, mesh.nodes, mesh.triangles, mesh.triangle_count) ||
      !binding.create(scratch, *this, mesh))
    return no_memory(error);

  const double edge = mean_edge(mesh.nodes, mesh.triangles, mesh.triangle_count);
  std::int64_t turns = 0;
  for (std::int32_t v = 0; v < vertex_count_; ++v) {
    const Vec3 place = load3(rest_ + 3 * static_cast<std::size_t>(v));
    const SurfacePoint nearest = surface.nearest(place);
    Vertex& bound = vertices_[v];
    bound.triangle = nearest.triangle;
    if (nearest.triangle >= 0) bound.offset = place - surface.position(nearest);
    const double off = length(bound.offset);
    if (nearest.triangle < 0 || !(off <= kFarthest * edge))
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_fine_surface: vertex %d at %g %g %g m is %g m from the mesh; expected at most %g m, the "
                  "mesh's mean edge: give the same organ, in metres and in the bundle's frame",
                  v, place.x, place.y, place.z, off, kFarthest * edge);
    std::copy(nearest.barycentric, nearest.barycentric + 3, bound.weight);
    if (off > kNoOffset * edge) bound.turns = binding.gather(bound);
    bound.first = static_cast<std::int32_t>(turns);
    turns += bound.turns;
    if (turns > 0x7fffffff) return no_memory(error);
  }
  turns_ = memory.array<Turn>(static_cast<std::size_t>(turns));
  if (memory.failed()) return no_memory(error);
  for (std::int32_t v = 0; v < vertex_count_; ++v) {
    if (vertices_[v].turns == 0) continue;
    binding.gather(vertices_[v]);
    binding.write(turns_ + vertices_[v].first);
  }
  if (mesh.preload)
    for (std::int32_t v = 0; v < vertex_count_; ++v) {
      double* place = rest_ + 3 * static_cast<std::size_t>(v);
      store3(load3(place) +
                 displacement(
                     v, [&](std::int32_t node) { return load3(mesh.preload + 3 * static_cast<std::size_t>(node)); }),
             place);
    }
  if (!index_.build(memory, rest_, triangles_, triangle_count_)) return no_memory(error);
  measure_normals();
  return PALPATE_OK;
}

}  // namespace palpate
