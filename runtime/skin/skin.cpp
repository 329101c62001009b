// The render mesh in a step: displacements of the surface nodes -> bones -> vertices and normals.
#include "runtime/skin/skin.h"
#include "runtime/include/palpate/palpate_skin.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr float kFarthest = 1e6f;  // m, as for tools: a longer displacement counts as not finite

}  // namespace

// Sets each bone to its node's displacement, preload included, and a gradient of zero.
palpate_step_flags Skin::take(const float* displacements) {
  palpate_step_flags flags = 0;
  for (std::int32_t n = 0; n < node_count_; ++n) {
    Bone& bone = bones_[n] = Bone{};
    const float* u = displacements + 3 * static_cast<std::size_t>(n);
    const bool good = std::fabs(u[0]) <= kFarthest && std::fabs(u[1]) <= kFarthest && std::fabs(u[2]) <= kFarthest;
    if (!good) flags = PALPATE_STEP_BAD_INPUT;
    for (int d = 0; d < 3; ++d)
      bone.column[3][d] = (good ? u[d] : 0) + (preload_ ? preload_[3 * static_cast<std::size_t>(n) + d] : 0);
  }
  return flags;
}

// Adds every triangle's displacement gradient to the bones of its three nodes, weighted by area.
void Skin::turn_bones() {
  for (std::int32_t t = 0; t < triangle_count_; ++t) {
    const Triangle& triangle = triangles_[t];
    const float *u0 = bones_[triangle.node[0]].column[3], *u1 = bones_[triangle.node[1]].column[3],
                *u2 = bones_[triangle.node[2]].column[3];
    float change[2][3], edge[2][3], normal[3];
    for (int d = 0; d < 3; ++d) {
      change[0][d] = u1[d] - u0[d], change[1][d] = u2[d] - u0[d];
      edge[0][d] = triangle.edge[0][d] + change[0][d], edge[1][d] = triangle.edge[1][d] + change[1][d];
    }
    // A triangle without area has no normal: its normal counts as unchanged.
    const bool has_normal = unit_normal(edge[0], edge[1], normal);
    for (int d = 0; d < 3; ++d) normal[d] = has_normal ? normal[d] - triangle.normal[d] : 0;
    for (int c = 0; c < 3; ++c)
      for (int d = 0; d < 3; ++d) {
        const float h =
            change[0][d] * triangle.dual[0][c] + change[1][d] * triangle.dual[1][c] + normal[d] * triangle.normal[c];
        for (int v = 0; v < 3; ++v) bones_[triangle.node[v]].column[c][d] += triangle.share[v] * h;
      }
  }
}

Skin::Bone Skin::blended(const Bone* bones, const std::int32_t* node, const float* weight) {
  const float *a = bones[node[0]].column[0], *b = bones[node[1]].column[0], *c = bones[node[2]].column[0];
  Bone bone;
  float* h = bone.column[0];
  for (int i = 0; i < 16; ++i) h[i] = weight[0] * a[i] + weight[1] * b[i] + weight[2] * c[i];
  return bone;
}

// False where the place would not be finite: the vertex then stays where it was bound.
bool Skin::place_vertex(std::int32_t v, const Bone& bone, float* moved) const {
  const Vertex& vertex = vertices_[v];
  const std::size_t first = 3 * static_cast<std::size_t>(v);
  const float* h = bone.column[0];
  for (int d = 0; d < 3; ++d)
    moved[d] = positions_[first + d] +
               (h[d] * vertex.offset[0] + h[4 + d] * vertex.offset[1] + h[8 + d] * vertex.offset[2] + h[12 + d]);
  if (std::fabs(moved[0]) + std::fabs(moved[1]) + std::fabs(moved[2]) < INFINITY) return true;
  std::copy_n(positions_ + first, 3, moved);
  return false;
}

// cofactor(I + H) n, of unit length, or n where that has no direction. The columns of a cofactor are the cross products of the
// columns of I + H.
void Skin::turn_normal(const Bone& bone, const float* n, float* out) {
  Bone deformed = bone;
  float* h = deformed.column[0];
  h[0] += 1, h[5] += 1, h[10] += 1;
  const float *x = h, *y = h + 4, *z = h + 8;
  float turned[3], square = 0;
  for (int d = 0, e = 1, f = 2; d < 3; e = f, f = d++) {
    turned[d] =
        n[0] * (y[e] * z[f] - y[f] * z[e]) + n[1] * (z[e] * x[f] - z[f] * x[e]) + n[2] * (x[e] * y[f] - x[f] * y[e]);
    square += turned[d] * turned[d];
  }
  const float length = std::sqrt(square);
  const bool good = length > 0 && length < INFINITY;
  for (int d = 0; d < 3; ++d) out[d] = good ? turned[d] / length : n[d];
}

palpate_step_flags Skin::move_vertex(std::int32_t v, palpate_skin_out* out) const {
  const Bone bone = blended(bones_, vertices_[v].node, vertices_[v].weight);
  const std::size_t first = 3 * static_cast<std::size_t>(v);
  palpate_step_flags flags = 0;
  if (out->positions) {
    float moved[3];
    if (!place_vertex(v, bone, moved)) flags = PALPATE_STEP_UNSOLVED;
    std::copy_n(moved, 3, out->positions + first);
  }
  if (out->normals) turn_normal(bone, normals_ + first, out->normals + first);
  return flags;
}

palpate_step_flags Skin::move(const float* displacements, palpate_skin_out* out) {
  palpate_step_flags flags = take(displacements);
  turn_bones();
  out->vertex_count = std::min(vertex_count_, out->vertex_capacity);
  for (std::int32_t v = 0; v < out->vertex_count; ++v) flags |= move_vertex(v, out);
  return flags;
}

}  // namespace palpate
