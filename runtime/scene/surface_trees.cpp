#include "runtime/scene/surface_trees.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// An upper bound of the largest eigenvalue of a symmetric positive semidefinite matrix, at most 7 % above it:
// (trace C^16)^(1/16).
double eigenvalue_bound(Mat3 c) {
  const double size = c.m[0][0] + c.m[1][1] + c.m[2][2];
  if (!(size > 0)) return 0;
  for (auto& row : c.m)
    for (double& x : row) x /= size;
  for (int i = 0; i < 4; ++i) c = c * c;
  double bound = c.m[0][0] + c.m[1][1] + c.m[2][2];
  for (int i = 0; i < 4; ++i) bound = std::sqrt(bound);
  return size * bound;
}

// Lets each node reach at least as far as the offset's norm, its length over the surface divided by the largest reach, moves it.
void reach_offset(const OffsetRows& rows, double largest, double* reach) {
  for (std::int32_t m = 0; m < rows.count; ++m)
    for (std::int32_t n = 0; n < rows.nodes && rows.longest[m] > 0; ++n)
      reach[n] = std::max(reach[n], largest * (length(rows.at(m, n)) / rows.longest[m]) * (1 + 1e-6));
}

}  // namespace

bool set_reaches(const SectionReader& reader, Body& body, const Tensors& tensors, const std::int32_t* touchable,
                 const BoundSurface* bound, const OffsetRows& offset, SurfaceTree& tree, double* same,
                 double* of_nodes) {
  SceneMemory scratch = reader.memory().of_same_host();
  const std::size_t count = static_cast<std::size_t>(tensors.surface_nodes);
  double* const reach = scratch.array<double>(count);
  if (reach) {
    const bool is_length = body.surface_field() != nullptr;
    double most = 0;
    std::fill(reach, reach + count, -1.0);
    for (std::int32_t k = 0; k < tensors.columns && !is_length; ++k) {
      Mat3 compliance;
      self_compliance(tensors.stiffness + 9 * static_cast<std::size_t>(k), &compliance);
      reach[touchable[k]] = std::sqrt(eigenvalue_bound(compliance));
      most = std::max(most, reach[touchable[k]]);
    }
    std::replace(reach, reach + count, -1.0, is_length ? 1 : most);
    *same = most > 0 ? most : 1;
    if (body.added()) std::fill(reach, reach + count, *same);
    reach_offset(offset, *same, reach);
    if (of_nodes) std::copy(reach, reach + count, of_nodes);
    if (!bound) tree.set_reach(reach);
  }
  double* const of_vertex = bound ? scratch.array<double>(static_cast<std::size_t>(bound->vertex_count())) : nullptr;
  if (reach && of_vertex) {
    for (std::int32_t v = 0; v < bound->vertex_count(); ++v) of_vertex[v] = bound->reach(v, reach);
    tree.set_reach(of_vertex);
  }
  const bool made = !scratch.failed();
  scratch.release_all();
  return made;
}

bool build_tree(SceneMemory& memory, const TouchState& touch, std::int32_t nodes, SurfaceTree& tree) {
  const TouchedSurface& surface = touch.surface;
  const BoundSurface* const bound = surface.bound;
  return bound ? tree.build(memory, bound->rest(), bound->vertex_count(), bound->triangles(), bound->triangle_count())
               : tree.build(memory, surface.rest, nodes, surface.triangles, surface.triangle_count, surface.active);
}

}  // namespace palpate
