#include "precompute/elements/motion_loads.h"

#include <Eigen/Geometry>

#include "precompute/elements/quadratic_tetrahedra.h"
#include "precompute/elements/quadratic_triangle.h"
#include "precompute/elements/supports.h"

namespace palpate {
namespace {

using Eigen::Vector3d;
using formats::MotionKind;

Vector3d at(const std::vector<std::array<double, 3>>& points, std::int32_t n) {
  return Vector3d(points[n].data());
}

void add(std::vector<double>& sum, std::int32_t node, const Vector3d& value) {
  for (int d = 0; d < 3; ++d) sum[3 * static_cast<std::size_t>(node) + static_cast<std::size_t>(d)] += value[d];
}

// By how much the support of a vertex moves, whose place is p.
Vector3d way_of(const Motion& motion, std::int32_t vertex, const Vector3d& p) {
  const Vector3d axis(motion.axis.data());
  if (motion.kind == MotionKind::piston) return axis;
  if (motion.kind == MotionKind::rotation) return axis.cross(p - Vector3d(motion.point.data()));
  return at(motion.way, vertex);
}

// [3 nodes] m. A middle node between two vertices that move has the motion of its own place, or for a field their mean. Beside a vertex
// that stays it has half of the other one's.
std::vector<double> way_of_nodes(const Motion& motion, const Discretisation& d) {
  std::vector<double> way(3 * d.coordinates.size(), 0.0);
  for (std::int32_t v = 0; v < d.vertices; ++v)
    if (motion.moves[v]) add(way, v, way_of(motion, v, at(d.coordinates, v)));
  for (std::size_t m = 0; m < d.ends.size(); ++m) {
    const auto node = static_cast<std::int32_t>(m) + d.vertices;
    const auto [a, b] = d.ends[m];
    if (motion.moves[a] && motion.moves[b] && motion.kind != MotionKind::field) {
      add(way, node, way_of(motion, a, at(d.coordinates, node)));
      continue;
    }
    for (const auto end : {a, b})
      if (motion.moves[end]) add(way, node, way_of(motion, end, at(d.coordinates, end)) / 2);
  }
  return way;
}

MotionLoad of_supports(const Motion& motion, const Discretisation& d, const BlockMatrix& base) {
  MotionLoad load;
  const std::vector<double> way = way_of_nodes(motion, d);
  load.imposed.assign(way.size(), 0.0);
  for (std::size_t i = 0; i < way.size(); ++i)
    if (d.fixed[i / 3][i % 3]) load.imposed[i] = way[i];
  const std::vector<double> held = multiply(d.stiffness, load.imposed);
  load.force = multiply(base, way);
  for (std::size_t i = 0; i < way.size(); ++i) load.force[i] = d.fixed[i / 3][i % 3] ? 0 : load.force[i] - held[i];
  return load;
}

// -int(N n) dA over flat triangles.
std::vector<double> linear_sweep(const Motion& motion, const ElasticBody& body) {
  std::vector<double> sweep(3 * body.nodes.size(), 0.0);
  for (const auto triangle : motion.triangles) {
    const auto& t = body.triangles[triangle];
    const Vector3d a = at(body.nodes, t[0]);
    const Vector3d third = (at(body.nodes, t[1]) - a).cross(at(body.nodes, t[2]) - a) / 6;
    for (const auto n : t) add(sweep, n, -third);
  }
  return sweep;
}

// The same over curved ones.
std::vector<double> quadratic_sweep(const Motion& motion, const Discretisation& d) {
  std::vector<double> sweep(3 * d.coordinates.size(), 0.0);
  for (const auto triangle : motion.triangles) {
    const auto& t = d.triangles[triangle];
    for (const TrianglePoint& point : triangle_points()) {
      const TriangleShapes s = shapes_of(point.at);
      const Vector3d area = point.weight / 2 * twice_area(s, [&](std::size_t i) { return at(d.coordinates, t[i]); });
      for (std::size_t i = 0; i < 6; ++i) add(sweep, t[i], -s.value[i] * area);
    }
  }
  return sweep;
}

MotionLoad of_pressure(const Motion& motion, const ElasticBody& body, const Discretisation& d) {
  MotionLoad load;
  load.sweep = d.triangles.empty() ? linear_sweep(motion, body) : quadratic_sweep(motion, d);
  load.force = load.sweep;
  for (std::size_t i = 0; i < load.force.size(); ++i)
    if (d.fixed[i / 3][i % 3]) load.force[i] = 0;
  return load;
}

MotionLoad of_gravity(const Motion& motion, const Discretisation& d) {
  MotionLoad load;
  load.force.assign(3 * d.coordinates.size(), 0.0);
  for (std::size_t i = 0; i < load.force.size(); ++i)
    if (!d.fixed[i / 3][i % 3]) load.force[i] = d.mass[i / 3] * motion.axis[i % 3];
  return load;
}

}  // namespace

std::vector<MotionLoad> motion_loads(const ElasticBody& body, const Discretisation& discretisation) {
  std::vector<MotionLoad> loads;
  if (body.motions.empty()) return loads;
  QuadraticMesh mesh;
  const bool quadratic = !discretisation.triangles.empty();
  if (quadratic) mesh.nodes = discretisation.coordinates, mesh.triangles = discretisation.triangles;
  const BlockMatrix base = base_stiffness(body, quadratic ? &mesh : nullptr);
  for (const Motion& motion : body.motions) {
    if (motion.kind == MotionKind::pressure)
      loads.push_back(of_pressure(motion, body, discretisation));
    else if (motion.kind == MotionKind::gravity)
      loads.push_back(of_gravity(motion, discretisation));
    else
      loads.push_back(of_supports(motion, discretisation, base));
  }
  return loads;
}

}  // namespace palpate
