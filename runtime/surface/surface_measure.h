// Quantities of the rest surface that a patch needs: the spacing of the mesh, the normal, the curvature, and the compliance of a
// half-space of the tissue there.
#pragma once

#include <cstdint>

#include "runtime/surface/node_fans.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

// The finite element that the tensors were computed with.
enum class StoredElement { p1, p1_anp, p1_ang, p2_p0 };

// The compliance of tissue under a rigid disc of a given radius.
//
// On a half-space: c = normal / radius along the normal, c = tangent / radius across it (m/N).
// Source: rigid flat punch, (1 - nu^2) / (2 E r); Mindlin 1949, (2 - nu)(1 + nu) / (4 E r).
//
// On a mesh: a disc of radius b yields locally like a disc of radius b + blur s in the continuum, where s^2 is a node's share of
// the surface area. The blur was measured on a block of gel; docs/accuracy.md has the table and the command.
//
// Against a turn it yields like one of radius b + first s + second s^2 / b. Measured on a block of gel against
// the closed forms of a rigid disc that tilts and that twists.
//
// On a curved surface the tangential compliance between the radii a and b has one more part:
//     ln(b / a) (curved K + curved_trace tr(K) I),
// with K the curvature tensor (1/m), positive where the surface bulges. Source: our own first-order calculation. A bulge lacks a
// layer of thickness kappa(theta) r^2 / 2 below its tangent plane. The absence of that layer adds the in-plane energy
// sigma : epsilon that Cerruti's solution has there, which falls as 1 / r^4. Integrated over angle and radius:
//     curved = (1 + nu)(1 + 6 nu - 4 nu^2) / (8 pi E),  curved_trace = (1 + nu)(5 - 10 nu + 12 nu^2) / (16 pi E).
// Along the normal, Boussinesq's solution gives (1 + nu)(1 - 2 nu)^2 tr(K) / (4 pi E): zero for incompressible tissue and 1 % of
// c at nu = 0.3, so it is left out.
struct TurnBlur {
  double first = 0, second = 0;
};
struct LocalCompliance {
  double normal = 0, tangent = 0;            // m^2/N
  double normal_blur = 0, tangent_blur = 0;  // in units of s
  double curved = 0, curved_trace = 0;       // m^2/N
  TurnBlur tilt_blur, twist_blur;
};
// A disc acts through one of this many node spacings at least (contact/contact_patch.h).
inline constexpr double kResolvedSpacings = 0.75;

void add_weighted(LocalCompliance& sum, double weight, const LocalCompliance& a);
LocalCompliance local_compliance(double young, double poisson, StoredElement element);

class SurfaceMeasure {
 public:
  // position: [nodes][3] m; triangles: [triangle_count][3] node indices, checked; both borrowed. active: [triangle_count], read during the call,
  // 0: the triangle counts for nothing; nullptr: all count. A node without a triangle has zeros.
  bool build(SceneMemory& memory, const double* position, std::int32_t nodes, const std::int32_t* triangles,
             std::int32_t triangle_count, const std::uint8_t* active = nullptr);
  bool is_built() const { return outward_ != nullptr; }
  // After fans.change(), of the fans of the same triangles. Cost: the fans of the nodes whose fans changed and of their neighbours.
  void change(const NodeFans& fans);

  // The tissue: one everywhere, or one for each node in an array that the caller fills ([nodes]), before tissue() is called.
  void set_tissue(const LocalCompliance& everywhere) { everywhere_ = everywhere; }
  LocalCompliance* tissue_of_nodes(SceneMemory& memory);
  // A node that is split off has its origin's.
  void copy_tissue(std::int32_t to, std::int32_t from) {
    if (of_node_) of_node_[to] = of_node_[from];
  }

  // K at a node, 1/m, symmetric, in the tangent plane: the gradient of the interpolated normal, averaged over the triangles around
  // the node.
  const Mat3& curvature(std::int32_t node) const { return curvature_[node]; }

  Vec3 outward(std::int32_t node) const { return outward_[node]; }
  double spacing(std::int32_t node) const { return spacing_[node]; }

  // Interpolated between the three nodes of the triangle, so continuous over the surface.
  Vec3 outward(const SurfacePoint& surface_point) const;    // unit normal; zero where it is not defined
  double spacing(const SurfacePoint& surface_point) const;  // s, m: root of a node's share of the surface area
  LocalCompliance tissue(const SurfacePoint& surface_point) const;

 private:
  Vec3 edge(std::int32_t triangle, int from, int to) const;
  Vec3 twice_area(std::int32_t triangle) const;
  Mat3 turn_of(std::int32_t triangle) const;
  void add_area(std::int32_t node, Vec3 twice_area);
  void end_area(std::int32_t node);
  void end_curvature(std::int32_t node);

  const double* position_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  std::int32_t nodes_ = 0;
  Vec3* outward_ = nullptr;    // [nodes]
  double* spacing_ = nullptr;  // [nodes]
  Mat3* curvature_ = nullptr;  // [nodes]
  LocalCompliance everywhere_;
  LocalCompliance* of_node_ = nullptr;  // [nodes]; nullptr: one tissue
};

}  // namespace palpate
