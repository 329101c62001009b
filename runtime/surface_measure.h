// What a patch needs to know of the surface beside its places: how coarse the mesh is there, which way is out, and how a
// half-space of that tissue gives way.
#pragma once

#include <cstdint>

#include "runtime/surface_index.h"

namespace palpate {

// Finite element of the tensors.
enum class StoredElement { p1, p1_anp, p2_p0 };

// How soft a place is under a rigid disc pressed on it: compliance = over_radius / radius, m/N, along the normal and
// across it. Source: rigid punch, (1 - nu^2) / (2 E r); Mindlin, (2 - nu)(1 + nu) / (4 E r).
//
// blur: a disc of radius b on a mesh gives way locally like one of radius b + blur s in the continuum, s^2 being a
// node's share of the surface there; from measurements on a block of gel, bench/README.md has the table and the command.
struct LocalCompliance {
  double normal = 0, tangent = 0;            // m^2/N
  double normal_blur = 0, tangent_blur = 0;  // of s
};
LocalCompliance local_compliance(double young, double poisson, StoredElement element);

class SurfaceMeasure {
 public:
  // position: [nodes][3] m; triangles: [triangle_count][3] checked. Both are borrowed while building.
  bool build(SceneMemory& memory, const double* position, std::int32_t nodes, const std::int32_t* triangles,
             std::int32_t triangle_count);

  // One tissue everywhere; or of each node, before the places are asked for. local: [nodes], kept.
  void set_tissue(const LocalCompliance& everywhere) { everywhere_ = everywhere; }
  LocalCompliance* tissue_of_nodes(SceneMemory& memory);

  // Interpolated at a place; continuous over the surface.
  Vec3 outward(const SurfacePlace& place) const;    // unit, or zero where it is not defined
  double spacing(const SurfacePlace& place) const;  // s: the root of a node's share of the area, m
  LocalCompliance tissue(const SurfacePlace& place) const;

 private:
  const std::int32_t* triangles_ = nullptr;
  std::int32_t nodes_ = 0;
  Vec3* outward_ = nullptr;    // [nodes]
  double* spacing_ = nullptr;  // [nodes]
  LocalCompliance everywhere_;
  LocalCompliance* of_node_ = nullptr;  // [nodes] where there are several tissues
};

}  // namespace palpate
