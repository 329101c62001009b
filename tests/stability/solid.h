// Small solids for the cases: held, solved with the program's solver, and compared.
#pragma once

#include "formats/organ_config.h"
#include "precompute/tensors/probe_columns.h"
#include "tests/precompute/support.h"

namespace palpate::tests {

using Point = std::array<double, 3>;

// Holds the face of lowest x.
inline ElasticBody held_body(const TetrahedralMesh& mesh, const std::vector<Material>& materials) {
  ElasticBody body = body_of(mesh, materials);
  double lowest = INFINITY;
  for (const Point& p : body.nodes) lowest = std::min(lowest, p[0]);
  hold(body, [&](const Point& p) { return p[0] == lowest ? 7 : 0; });
  return body;
}

// T^u and T^f of a few nodes in one list; T^f divided by newton_per_metre.
inline std::vector<double> tensors_of(const ElasticBody& body, Element element, double newton_per_metre) {
  std::vector<std::int32_t> nodes;
  for (std::size_t k = 0; k < body.touchable.size(); k += body.touchable.size() / 4) nodes.push_back(body.touchable[k]);
  std::vector<double> all;
  for (const NodeTensor& t : solve_node_tensors(body, element, nodes, 1e-12)) {
    all.insert(all.end(), t.displacement.begin(), t.displacement.end());
    for (const double f : t.stiffness) all.push_back(f / newton_per_metre);
  }
  return all;
}

// Largest difference over the largest absolute value in b.
inline double off(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0, largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i)
    most = std::max(most, std::abs(a[i] - b[i])), largest = std::max(largest, std::abs(b[i]));
  return std::isfinite(most) && a.size() == b.size() ? most / largest : INFINITY;
}

}  // namespace palpate::tests
