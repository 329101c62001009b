#include "runtime/cut/rest_mesh.h"

#include <algorithm>

#include "runtime/base/vec3.h"

namespace palpate {

// A face of a tetrahedron, or a triangle of the surface, by its nodes in ascending order.
struct RestMesh::Side {
  std::int32_t node[3];
  std::int32_t of;     // face, or -1 - triangle
  std::int32_t turns;  // 1: its nodes ran in the other sense before they were sorted
  bool same_nodes(const Side& other) const {
    return node[0] == other.node[0] && node[1] == other.node[1] && node[2] == other.node[2];
  }
  bool operator<(const Side& other) const {
    for (int c = 0; c < 3; ++c)
      if (node[c] != other.node[c]) return node[c] < other.node[c];
    return of > other.of;  // tetrahedra in front of the triangle
  }
  static Side made(std::int32_t of, std::int32_t a, std::int32_t b, std::int32_t c) {
    std::int32_t turns = 0;
    if (a > b) std::swap(a, b), turns ^= 1;
    if (b > c) std::swap(b, c), turns ^= 1;
    if (a > b) std::swap(a, b), turns ^= 1;
    return {{a, b, c}, of, turns};
  }
};

std::int32_t RestMesh::other_side(std::int32_t face) const {
  const std::int32_t beyond = neighbours_[face];
  if (beyond < 0) return -1;
  const std::int32_t* const nodes = nodes_of(face / 4);
  const std::int32_t own = face % 4;
  return corner_at(beyond, fourth_node(beyond, nodes[(own + 1) % 4], nodes[(own + 2) % 4], nodes[(own + 3) % 4]));
}

const char* RestMesh::check_numbers() const {
  if (body_.node_count < 4 || body_.tetrahedron_count < 1 || body_.tetrahedron_count > (1 << 27) ||
      body_.triangle_count < 4)
    return "a body that can be cut has 4 nodes, a tetrahedron and 4 triangles or more";
  for (std::int32_t n = 0; n < body_.node_count; ++n)
    if (!is_finite(load3(body_.nodes + 3 * n))) return "a node of the body to be cut is not finite";
  for (std::int32_t c = 0; c < 4 * body_.tetrahedron_count; ++c)
    if (node(c) < 0 || node(c) >= body_.node_count)
      return "a tetrahedron of the body to be cut has a node that is not there";
  for (std::int32_t c = 0; c < 3 * body_.triangle_count; ++c)
    if (body_.triangles[c] < 0 || body_.triangles[c] >= body_.node_count)
      return "a triangle of the body to be cut has a node that is not there";
  for (std::int32_t t = 0; t < body_.tetrahedron_count; ++t) {
    const std::int32_t* const nodes = nodes_of(t);
    const Vec3 at = load3(body_.nodes + 3 * nodes[0]);
    const auto edge = [&](int c) { return load3(body_.nodes + 3 * nodes[c]) - at; };
    if (!(dot(cross(edge(1), edge(2)), edge(3)) > 0)) return "a tetrahedron of the body to be cut has no volume";
  }
  return nullptr;
}

void RestMesh::make_stars() {
  const std::int32_t corners = 4 * tetrahedra();
  for (std::int32_t c = 0; c < corners; ++c) ++star_begin_[node(c) + 1];
  for (std::int32_t n = 0; n < body_.node_count; ++n) star_begin_[n + 1] += star_begin_[n];
  // Each begin is moved to its end while the stars are filled, and back afterwards.
  for (std::int32_t c = 0; c < corners; ++c) stars_[star_begin_[node(c)]++] = c;
  for (std::int32_t n = body_.node_count; n > 0; --n) star_begin_[n] = star_begin_[n - 1];
  star_begin_[0] = 0;
}

const char* RestMesh::match(Side* sides) {
  const std::int32_t corners = 4 * tetrahedra(), count = corners + body_.triangle_count;
  for (std::int32_t f = 0; f < corners; ++f) {
    const std::int32_t* const nodes = nodes_of(f / 4);
    const std::uint8_t* const at = kFaceCorners[f % 4];
    sides[f] = Side::made(f, nodes[at[0]], nodes[at[1]], nodes[at[2]]);
  }
  for (std::int32_t i = 0; i < body_.triangle_count; ++i) {
    const std::int32_t* const nodes = body_.triangles + 3 * i;
    sides[corners + i] = Side::made(-1 - i, nodes[0], nodes[1], nodes[2]);
  }
  std::sort(sides, sides + count);
  for (std::int32_t i = 0; i < count; i += 2) {
    if (i + 1 == count || !sides[i].same_nodes(sides[i + 1]) || sides[i].of < 0 ||
        (i + 2 < count && sides[i].same_nodes(sides[i + 2])))
      return "a face of the body to be cut has not two tetrahedra, or one and a triangle of the surface";
    const Side &one = sides[i], &two = sides[i + 1];
    if ((one.turns == two.turns) != (two.of < 0))
      return "a triangle or a tetrahedron of the body to be cut is turned over";
    neighbours_[one.of] = two.of < 0 ? -1 : two.of / 4;
    if (two.of < 0)
      face_of_triangle_[-1 - two.of] = one.of;
    else
      neighbours_[two.of] = one.of / 4;
  }
  return nullptr;
}

// Each edge runs once in each sense around the triangles of a closed, manifold surface.
const char* RestMesh::check_edges(std::uint64_t* edges) const {
  const std::int32_t count = 3 * body_.triangle_count;
  for (std::int32_t c = 0; c < count; ++c)
    edges[c] = static_cast<std::uint64_t>(body_.triangles[c]) << 32 |
               static_cast<std::uint64_t>(body_.triangles[c % 3 == 2 ? c - 2 : c + 1]);
  std::sort(edges, edges + count);
  if (std::adjacent_find(edges, edges + count) != edges + count)
    return "the surface of the body to be cut is not manifold at an edge";
  return nullptr;
}

const char* RestMesh::create(SceneMemory& memory, const CutBody& body) {
  body_ = body;
  if (const char* const wrong = check_numbers()) return wrong;
  const auto corners = 4 * static_cast<std::size_t>(body.tetrahedron_count);
  neighbours_ = memory.array<std::int32_t>(corners);
  stars_ = memory.array<std::int32_t>(corners);
  star_begin_ = memory.array<std::int32_t>(static_cast<std::size_t>(body.node_count) + 1);
  face_of_triangle_ = memory.array<std::int32_t>(static_cast<std::size_t>(body.triangle_count));
  SceneMemory scratch = memory.of_same_host();
  Side* const sides = scratch.array<Side>(corners + static_cast<std::size_t>(body.triangle_count));
  std::uint64_t* const edges = scratch.array<std::uint64_t>(3 * static_cast<std::size_t>(body.triangle_count));
  const char* wrong = nullptr;
  if (memory.failed() || scratch.failed()) {
    wrong = "no memory for a body that can be cut";
  } else {
    make_stars();
    wrong = match(sides);
    if (!wrong) wrong = check_edges(edges);
  }
  scratch.release_all();
  return wrong;
}

}  // namespace palpate
