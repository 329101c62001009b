// What a patch needs to know of the surface beside its places: how coarse the mesh is there, which way is out, how it
// curves, and how a half-space of that tissue gives way.
#pragma once

#include <cstdint>

#include "runtime/surface/surface_index.h"

namespace palpate {

// Finite element of the tensors.
enum class StoredElement { p1, p1_anp, p2_p0 };

// How soft a place is under a rigid disc pressed on it: compliance = over_radius / radius, m/N, along the normal and
// across it. Source: rigid punch, (1 - nu^2) / (2 E r); Mindlin, (2 - nu)(1 + nu) / (4 E r).
//
// blur: a disc of radius b on a mesh gives way locally like one of radius b + blur s in the continuum, s^2 being a
// node's share of the surface there; from measurements on a block of gel, bench/README.md has the table and the command.
//
// Where the surface curves, the tangential compliance between the radii a and b has a part that a half-space has not:
//     ln(b / a) (curved K + curved_trace tr(K) I),
// K the curvature tensor, positive where the surface bulges. Source: to first order in the curvature, what a bulge lacks
// beside its tangent plane is a layer of thickness kappa(theta) r^2 / 2, and its absence adds the in-plane energy
// sigma : epsilon that Cerruti's solution has there, as 1 / r^4; integrated over angle and radius,
//     curved = (1 + nu)(1 + 6 nu - 4 nu^2) / (8 pi E),  curved_trace = (1 + nu)(5 - 10 nu + 12 nu^2) / (16 pi E).
// Along the normal Boussinesq's solution gives (1 + nu)(1 - 2 nu)^2 tr(K) / (4 pi E): nothing in what cannot be
// compressed, and 1 % at nu = 0.3; left out.
struct LocalCompliance {
  double normal = 0, tangent = 0;            // m^2/N
  double normal_blur = 0, tangent_blur = 0;  // of s
  double curved = 0, curved_trace = 0;       // m^2/N
};
void add_weighted(LocalCompliance& sum, double weight, const LocalCompliance& a);
LocalCompliance local_compliance(double young, double poisson, StoredElement element);

class SurfaceMeasure {
 public:
  // position: [nodes][3] m; triangles: [triangle_count][3] checked. Both are borrowed while building.
  bool build(SceneMemory& memory, const double* position, std::int32_t nodes, const std::int32_t* triangles,
             std::int32_t triangle_count);

  // One tissue everywhere; or of each node, before the places are asked for. local: [nodes], kept.
  void set_tissue(const LocalCompliance& everywhere) { everywhere_ = everywhere; }
  LocalCompliance* tissue_of_nodes(SceneMemory& memory);

  // K at a node, 1/m, symmetric, along the surface: the mean over the triangles around of the gradient of the normal,
  // which turns from node to node.
  const Mat3& curvature(std::int32_t node) const { return curvature_[node]; }

  // Interpolated at a place; continuous over the surface.
  Vec3 outward(const SurfacePlace& place) const;    // unit, or zero where it is not defined
  double spacing(const SurfacePlace& place) const;  // s: the root of a node's share of the area, m
  LocalCompliance tissue(const SurfacePlace& place) const;

 private:
  void measure_curvature(const double* position, std::int32_t triangle_count);

  const std::int32_t* triangles_ = nullptr;
  std::int32_t nodes_ = 0;
  Vec3* outward_ = nullptr;    // [nodes]
  double* spacing_ = nullptr;  // [nodes]
  Mat3* curvature_ = nullptr;  // [nodes]
  LocalCompliance everywhere_;
  LocalCompliance* of_node_ = nullptr;  // [nodes] where there are several tissues
};

}  // namespace palpate
