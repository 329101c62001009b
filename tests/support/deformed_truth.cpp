#include "tests/support/deformed_truth.h"

namespace palpate::tests {

DeformedTruth::DeformedTruth(const SurfaceFirst& body) : body_(&body), place_(body.surface_nodes) {
  for (std::int32_t n = 0; n < body.surface_nodes; ++n) place_[n] = Eigen::Vector3d(body.mesh.nodes[n].data());
}

void DeformedTruth::move(const std::vector<float>& displacement) {
  for (std::int32_t n = 0; n < body_->surface_nodes; ++n)
    place_[n] = Eigen::Vector3d(body_->mesh.nodes[n].data()) +
                Eigen::Map<const Eigen::Vector3f>(&displacement[3 * n]).cast<double>();
}

double DeformedTruth::signed_distance(const Eigen::Vector3d& p) const {
  double nearest = INFINITY, angle = 0;
  for (const auto& t : body_->triangles) {
    const Eigen::Vector3d a = place_[t[0]] - p, b = place_[t[1]] - p, c = place_[t[2]] - p;
    double k[3];
    nearest = std::min(nearest, closest_on_triangle({}, {a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}, k));
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  const double winding = angle / (4 * 3.14159265358979323846);
  return (winding > 0.5 ? -1 : 1) * std::sqrt(nearest);
}

DeformedTruth::Crossing DeformedTruth::first_crossing(const Eigen::Vector3d& origin, const Eigen::Vector3d& along,
                                                      double longest) const {
  Crossing first;
  for (std::size_t f = 0; f < body_->triangles.size(); ++f) {
    const Eigen::Vector3d a = corner(f, 0), u = corner(f, 1) - a, v = corner(f, 2) - a, n = u.cross(v);
    Eigen::Matrix3d m;
    m << u, v, -along;
    const double area = n.norm();
    if (!(area > 0) || std::abs(m.determinant()) < 1e-14 * area) continue;
    const Eigen::Vector3d x = m.inverse() * (origin - a);
    const double inner = std::min({x[0], x[1], 1 - x[0] - x[1]});
    if (inner < 0 || x[2] < 0 || x[2] > longest || x[2] >= first.distance) continue;
    first = {static_cast<std::int32_t>(f), x[2], n.dot(along) / area, inner};
  }
  return first;
}

Eigen::Vector3d DeformedTruth::outward(std::size_t triangle) const {
  const Eigen::Vector3d a = corner(triangle, 0);
  return (corner(triangle, 1) - a).cross(corner(triangle, 2) - a).normalized();
}

double DeformedTruth::largest_move(const DeformedTruth& other) const {
  double most = 0;
  for (std::size_t n = 0; n < place_.size(); ++n) most = std::max(most, (place_[n] - other.place_[n]).norm());
  return most;
}

}  // namespace palpate::tests
