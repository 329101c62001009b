// A tool that presses a flat disc of radius a: the nodes that carry the disc with their weights, and the compliance below it
// that the mesh does not resolve.
//
// The force for a displaced point of a mesh falls with the mesh size, because a point of an elastic continuum has no
// stiffness; a disc has one. The rows of a patch are the disc's mean displacement, weighted by the pressure under a rigid flat
// punch, which is proportional to 1 / sqrt(1 - r^2 / a^2): mean displacement over force is then the punch's compliance c(a)
// (surface_measure.h). On a mesh whose node spacing s is not small against a, the contact acts through a wider disc of radius
// b = max(a, kResolved s), which the mesh resolves, and
//     c(a) - c(b + blur s)
// is added to the contact's own compliance: the compliance of the small disc minus that of the wide disc as the mesh shows it.
// Across the normal a term for the surface's curvature between the two radii is added. The sum is never negative, and both it
// and the weights are continuous in the disc's position, so a dragged tool feels no element boundaries.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/disc_compliance.h"
#include "runtime/surface/surface_measure.h"

namespace palpate {

class ContactPatch {
 public:
  static constexpr double kResolved = kResolvedSpacings;
  static constexpr int kRings = 6, kSpokes = 20, kPoints = kRings * kSpokes;
  static constexpr int kMaxNodes = 3 * kPoints;

  // surface, measure and triangles ([F][3]) are borrowed; nodes: Ns. Sets up the quadrature points of the unit disc. fans: of a surface that
  // changes, whose parts may lie on one another or side by side without hanging together: a disc then has the triangles that hang together with
  // its own, across edges and within the disc. nullptr: all that are below it.
  bool create(SceneMemory& memory, SurfaceIndex* surface, const SurfaceMeasure* measure, const std::int32_t* triangles,
              std::int32_t nodes, const NodeFans* fans = nullptr);

  // Of press() and measure_slopes() together.
  static constexpr Operations kToPress = 2000;

  // m: a smaller disc is computed as one of this radius, so that 1 / a stays finite.
  static constexpr double kLeastRadius = 1e-9;

  // Computes the disc of radius a (m, above 0) around a surface point. outward: unit normal; tangent: unit, across outward: the
  // direction in which the pattern of quadrature points is laid; resolved: in place of kResolved. The results stay until the next
  // call. Cost: some microseconds, more for more triangles below the disc.
  void press(const SurfacePoint& surface_point, Vec3 outward, Vec3 tangent, double a, double resolved = kResolved);

  int count() const { return count_; }
  const std::int32_t* nodes() const { return node_; }  // [count()]
  // [count()] above 0; the sum is 1 minus the weight of the quadrature points that lie beside the surface.
  const double* weights() const { return weight_; }
  // [count()] m: of each node the sum of the quadrature points' shares times their place along the tangent and across it, from the disc's
  // centre. sum_n along_n u_n is then the first moment of the interpolated displacement, which weights times places of nodes are not.
  void first_moments(double* along, double* across);
  // After press(), with the same arguments and kResolved: how the disc changes as its place moves across `outward`. slope: [count()] 1/m, of the
  // weights, whose sum stays `whole`. Of place, `outward` is not written. Cost: about half of press().
  void measure_slopes(const SurfacePoint& surface_point, Vec3 outward, Vec3 tangent, double a, Vec3* slope,
                      DiscPlace* place);
  const Mat3& local() const { return local_; }       // m/N, symmetric: added to the contact's own compliance
  const ContactDisc& disc() const { return disc_; }  // its frame: x, y, z

 private:
  static constexpr int kBins = 8;
  struct Hit {
    std::int32_t triangle;
    float height;
    double barycentric[3];
  };
  bool find_points(std::int32_t triangle, Vec3 centre, Vec3 outward, Vec3 u, Vec3 v, double b);
  template <class Find>
  void find_connected(std::int32_t first, Find find);
  void gather_nodes(const SurfacePoint& surface_point);
  Vec3 spacing_slope(std::int32_t triangle, Vec3 u, Vec3 v) const;
  void measure_local(const SurfacePoint& surface_point, Vec3 outward, Vec3 u, Vec3 v, double a, double b);

  SurfaceIndex* surface_ = nullptr;
  const SurfaceMeasure* measure_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  const NodeFans* fans_ = nullptr;
  std::int32_t* connected_ = nullptr;  // [F] where there are fans
  std::uint32_t* seen_ = nullptr;      // [F] the call that has met a triangle
  std::uint32_t call_ = 0;
  // Quadrature points of the unit disc and their weights, sorted by the bins of a square grid over the disc.
  double x_[kPoints] = {}, y_[kPoints] = {}, share_[kPoints] = {};
  int bin_begin_[kBins * kBins + 1] = {};
  Hit hit_[kPoints] = {};
  std::int32_t* index_of_node_ = nullptr;  // [nodes] or -1, outside a call
  std::int32_t node_[kMaxNodes] = {};
  double weight_[kMaxNodes] = {};
  int count_ = 0;
  double radius_ = 0;  // m, of the disc through which the contact acts
  Mat3 local_;
  ContactDisc disc_;
};

// The unit vector across n that is nearest to `like`, so that it turns with n and does not jump; any such vector where like is
// zero or along n.
Vec3 across(Vec3 n, Vec3 like);

}  // namespace palpate
