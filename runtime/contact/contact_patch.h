// A tool of radius a that presses a disc: which nodes carry it with which weights, and what the mesh leaves out.
//
// A point has no stiffness: the force for a displaced point of a mesh falls with the mesh size. A disc has one. Its rows
// are the disc's mean displacement, weighted by the pressure under a rigid flat punch, 1 / sqrt(1 - r^2 / a^2): then
// mean displacement over force is the punch's compliance c(a) (surface_measure.h). On a mesh whose spacing s is not small
// against a the contact acts through a wider disc that the mesh resolves, of radius b = max(a, kResolved s), and
//     c(a) - c(b + blur s)
// is added to the contact's own compliance: what the small disc has beyond the wide one as the mesh shows it; and, across
// the normal, what the surface's curvature adds between the two. It is never negative, and it and the weights are
// continuous in the place, so that a dragged tool feels no element boundaries.
#pragma once

#include <cstdint>

#include "runtime/surface/surface_measure.h"

namespace palpate {

class ContactPatch {
 public:
  static constexpr double kResolved = 0.75;
  static constexpr int kRings = 6, kSpokes = 20, kPoints = kRings * kSpokes;
  static constexpr int kMaxNodes = 3 * kPoints;

  // surface, measure and triangles ([][3]) are borrowed; nodes: of the surface. Sets up the points of the unit disc.
  bool create(SceneMemory& memory, SurfaceIndex* surface, const SurfaceMeasure* measure, const std::int32_t* triangles,
              std::int32_t nodes);

  // Discs below this radius, m, are taken for one of it: 1 / a stays a number.
  static constexpr double kLeastRadius = 1e-9;

  // The disc of radius a (m, above 0) about a place, across `outward` (unit); tangent: a unit vector across it, along
  // which the pattern of points is laid. Results until the next call. Cost: some microseconds, more with the triangles
  // under the disc.
  void press(const SurfacePlace& place, Vec3 outward, Vec3 tangent, double a);

  int count() const { return count_; }
  const std::int32_t* nodes() const { return node_; }  // [count()]
  // [count()] above 0; they sum to one, but for points that fell beside the surface.
  const double* weights() const { return weight_; }
  const Mat3& local() const { return local_; }  // m/N, symmetric: what is added to the contact's compliance

 private:
  static constexpr int kBins = 8;
  struct Hit {
    std::int32_t triangle;
    float height;
    double barycentric[3];
  };
  void find_points(std::int32_t triangle, Vec3 centre, Vec3 outward, Vec3 u, Vec3 v, double b);
  void gather_nodes(const SurfacePlace& place);
  void measure_local(const SurfacePlace& place, Vec3 outward, Vec3 u, Vec3 v, double a, double b);

  SurfaceIndex* surface_ = nullptr;
  const SurfaceMeasure* measure_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  // The points of the unit disc, bin by bin of a square grid over it.
  double x_[kPoints] = {}, y_[kPoints] = {}, share_[kPoints] = {};
  int bin_begin_[kBins * kBins + 1] = {};
  Hit hit_[kPoints] = {};
  std::int32_t* entry_of_node_ = nullptr;  // [nodes] or -1, outside a call
  std::int32_t node_[kMaxNodes] = {};
  double weight_[kMaxNodes] = {};
  int count_ = 0;
  Mat3 local_;
};

// A unit vector across n, as near to `like` as can be, so that it turns with n and does not jump; any where like is zero.
Vec3 across(Vec3 n, Vec3 like);

}  // namespace palpate
