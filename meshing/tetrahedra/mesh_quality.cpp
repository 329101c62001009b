#include "meshing/tetrahedra/mesh_quality.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/errors.h"

namespace palpate {
namespace {

using Eigen::Vector3d;

Vector3d node(const TetrahedralMesh& mesh, std::size_t e, int corner) {
  return Vector3d::Map(mesh.nodes[mesh.tetrahedra[e][corner]].data());
}

// Radius ratio 3 r_in / r_circ of the element with the edge vectors a, b, c from one corner: r_in = 3 V / (sum of the
// face areas), r_circ = |a^2 (b x c) + b^2 (c x a) + c^2 (a x b)| / (12 V).
double radius_ratio(const Vector3d& a, const Vector3d& b, const Vector3d& c, double volume) {
  const double areas = (a.cross(b).norm() + b.cross(c).norm() + c.cross(a).norm() + (b - a).cross(c - a).norm()) / 2;
  const double circumsphere =
      (a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b)).norm();
  if (!(areas > 0) || !(circumsphere > 0)) return 0;
  return 108 * volume * std::abs(volume) / (areas * circumsphere);
}

std::string describe(const TetrahedralMesh& mesh, std::size_t e) {
  const Vector3d centroid = (node(mesh, e, 0) + node(mesh, e, 1) + node(mesh, e, 2) + node(mesh, e, 3)) / 4;
  return fmt::format("tetrahedron {} (counted from 0) of region \"{}\" at ({:.6g}, {:.6g}, {:.6g})", e,
                     mesh.region_names[mesh.region[e]], centroid.x(), centroid.y(), centroid.z());
}

}  // namespace

ElementShape shape_of(const TetrahedralMesh& mesh, std::size_t e) {
  const Vector3d p[4] = {node(mesh, e, 0), node(mesh, e, 1), node(mesh, e, 2), node(mesh, e, 3)};
  const Vector3d a = p[1] - p[0], b = p[2] - p[0], c = p[3] - p[0];
  const double volume = a.dot(b.cross(c)) / 6;
  ElementShape shape = {volume, 0, 180, radius_ratio(a, b, c, volume)};
  if (!(volume > 0)) return shape;
  // Outward normals of the faces opposite each corner. The dihedral angle at an edge is pi minus the angle between
  // the normals of its two faces.
  Vector3d normal[4];
  for (int i = 0; i < 4; ++i) {
    const Vector3d &q = p[(i + 1) % 4], &r = p[(i + 2) % 4], &s = p[(i + 3) % 4];
    normal[i] = (r - q).cross(s - q).normalized();
    if (normal[i].dot(p[i] - q) > 0) normal[i] = -normal[i];
  }
  shape.smallest_dihedral = 180;
  shape.largest_dihedral = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = i + 1; j < 4; ++j) {
      // atan2 stays accurate near 0 and 180 degrees; acos does not.
      const double angle = std::atan2(normal[i].cross(normal[j]).norm(), -normal[i].dot(normal[j]));
      shape.smallest_dihedral = std::min(shape.smallest_dihedral, angle * 180 / std::numbers::pi);
      shape.largest_dihedral = std::max(shape.largest_dihedral, angle * 180 / std::numbers::pi);
    }
  return shape;
}

MeshQuality measure_quality(const TetrahedralMesh& mesh) {
  MeshQuality quality;
  quality.region_volume.assign(mesh.region_names.size(), 0.0);
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    const ElementShape shape = shape_of(mesh, e);
    const bool first = e == 0;
    if (first || shape.volume < quality.volume.value) quality.volume = {shape.volume, e};
    if (first || shape.smallest_dihedral < quality.dihedral.value) quality.dihedral = {shape.smallest_dihedral, e};
    if (first || shape.largest_dihedral > quality.largest_dihedral.value)
      quality.largest_dihedral = {shape.largest_dihedral, e};
    if (first || shape.radius_ratio < quality.radius_ratio.value) quality.radius_ratio = {shape.radius_ratio, e};
    quality.mean_smallest_dihedral += shape.smallest_dihedral;
    quality.mean_radius_ratio += shape.radius_ratio;
    quality.region_volume[mesh.region[e]] += shape.volume;
  }
  const double count = std::max<double>(1, static_cast<double>(mesh.tetrahedra.size()));
  quality.mean_smallest_dihedral /= count;
  quality.mean_radius_ratio /= count;
  return quality;
}

void pass_gate(const TetrahedralMesh& mesh, const MeshQuality& quality, const QualityGate& gate,
               const std::string& cure) {
  if (!(quality.volume.value > 0))
    throw VerificationError(
        fmt::format("{} has volume {:g}, but every element must have a positive one; look for a fold "
                    "or a sliver of the surface there, or change --size",
                    describe(mesh, quality.volume.tetrahedron), quality.volume.value));
  // The limits to state so that this mesh passes, rounded down.
  std::string accept;
  if (!(quality.dihedral.value >= gate.min_dihedral))
    accept += fmt::format(" --min-dihedral {:.1f}", std::floor(quality.dihedral.value * 10) / 10);
  if (!(quality.radius_ratio.value >= gate.min_radius_ratio))
    accept += fmt::format(" --min-radius-ratio {:.3f}", std::floor(quality.radius_ratio.value * 1000) / 1000);
  if (!(quality.dihedral.value >= gate.min_dihedral))
    throw VerificationError(fmt::format(
        "{} has a dihedral angle of {:.3g} degrees, less than the {:g} that --min-dihedral asks for; "
        "{}; accept it with{}",
        describe(mesh, quality.dihedral.tetrahedron), quality.dihedral.value, gate.min_dihedral, cure, accept));
  if (!(quality.radius_ratio.value >= gate.min_radius_ratio))
    throw VerificationError(
        fmt::format("{} has a radius ratio of {:.3g}, less than the {:g} that --min-radius-ratio asks for; "
                    "{}; accept it with{}",
                    describe(mesh, quality.radius_ratio.tetrahedron), quality.radius_ratio.value, gate.min_radius_ratio,
                    cure, accept));
}

}  // namespace palpate
