#include "precompute/elements/discretisation.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "formats/averaged_shear.h"
#include "precompute/elements/linear_tetrahedra.h"
#include "precompute/elements/quadratic_tetrahedra.h"

namespace palpate {
namespace {

// A surface vertex k is touched through its linear hat function phi_k: node j has the weight int(phi_k N_j) dA /
// int(phi_k) dA over the straight triangles around k. A triangle of area A adds A / 30 to k itself, -A / 60 to its
// other two vertices, 2 A / 15 to the middles of the two edges at k and A / 15 to the middle of the opposite edge: A /
// 3 in sum.
TouchFunctionals hat_functionals(const QuadraticMesh& mesh, const ElasticBody& body) {
  struct Term {
    std::int32_t node;
    double weight;
  };
  std::vector<std::vector<Term>> terms(static_cast<std::size_t>(body.surface_count));
  std::vector<double> total(terms.size(), 0.0);
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a(body.nodes[t[0]].data()), b(body.nodes[t[1]].data()), c(body.nodes[t[2]].data());
    const double area = (b - a).cross(c - a).norm() / 2;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t next = (i + 1) % 3, last = (i + 2) % 3;
      auto& own = terms[static_cast<std::size_t>(t[i])];
      own.insert(own.end(), {{t[i], area / 30}, {t[next], -area / 60}, {t[last], -area / 60}});
      own.insert(own.end(), {{t[3 + i], 2 * area / 15}, {t[3 + last], 2 * area / 15}, {t[3 + next], area / 15}});
      total[static_cast<std::size_t>(t[i])] += area / 3;
    }
  }
  TouchFunctionals touch;
  std::vector<std::int32_t> nodes;
  for (std::size_t v = 0; v < body.nodes.size(); ++v) {
    if (v >= terms.size()) {  // inside the body: the node itself
      touch.nodes.append(std::vector<std::int32_t>{static_cast<std::int32_t>(v)});
      touch.weight.push_back(1);
      continue;
    }
    auto& own = terms[v];
    std::stable_sort(own.begin(), own.end(), [](const Term& a, const Term& b) { return a.node < b.node; });
    nodes.clear();
    for (const auto& term : own) {
      if (nodes.empty() || nodes.back() != term.node) nodes.push_back(term.node), touch.weight.push_back(0);
      touch.weight.back() += term.weight / total[v];
    }
    touch.nodes.append(nodes);
  }
  return touch;
}

std::vector<std::array<std::int32_t, 2>> ends_of_middles(const QuadraticMesh& mesh, std::size_t vertices) {
  constexpr int edge[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
  std::vector<std::array<std::int32_t, 2>> ends(mesh.nodes.size() - vertices);
  for (const auto& cell : mesh.cells)
    for (std::size_t e = 0; e < 6; ++e)
      ends[static_cast<std::size_t>(cell[4 + e]) - vertices] = {cell[edge[e][0]], cell[edge[e][1]]};
  return ends;
}

void discretise_quadratically(const ElasticBody& body, Discretisation& result) {
  const QuadraticMesh mesh = quadratic_mesh(body);
  result.coordinates = mesh.nodes;
  result.fixed = mesh.fixed;
  result.mass = quadratic_mass(mesh, body);
  result.stiffness = quadratic_stiffness(mesh, body);
  add_supports(body, mesh, result.stiffness);
  result.touch = hat_functionals(mesh, body);
  result.triangles = mesh.triangles;
  result.ends = ends_of_middles(mesh, body.nodes.size());
  result.curved_edges = mesh.curved_edges;
  result.straightened_edges = mesh.straightened_edges;
}

}  // namespace

double averaged_shear_of(Element element) {
  return element == Element::p1_ang ? formats::kAveragedShear : 0;
}

Discretisation discretise_vertices(const ElasticBody& body) {
  Discretisation result;
  result.vertices = static_cast<std::int32_t>(body.nodes.size());
  result.coordinates = body.nodes;
  result.fixed = body.fixed;
  result.mass = linear_mass(body);
  return result;
}

Discretisation discretise(const ElasticBody& body, Element element) {
  Discretisation result;
  if (element == Element::p2_p0) {
    result.vertices = static_cast<std::int32_t>(body.nodes.size());
    discretise_quadratically(body, result);
    return result;
  }
  result = discretise_vertices(body);
  result.stiffness =
      element == Element::p1 ? linear_stiffness(body) : nodal_dilatation_stiffness(body, averaged_shear_of(element));
  add_supports(body, result.stiffness);
  return result;
}

std::vector<std::array<double, 3>> row_coordinates(const Discretisation& discretisation, const HeldStiffness& held) {
  std::vector<std::array<double, 3>> result;
  for (const auto n : held.node_of_row) result.push_back(discretisation.coordinates[n]);
  return result;
}

std::vector<double> read_vertices(const Discretisation& discretisation, std::span<const double> nodes) {
  const auto& touch = discretisation.touch;
  const auto count = static_cast<std::size_t>(discretisation.vertices);
  std::vector<double> result(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(3 * count));
  if (!touch.weight.empty()) std::fill(result.begin(), result.end(), 0.0);
  for (std::size_t v = 0; v < touch.nodes.size(); ++v)
    for (auto at = touch.nodes.first[v]; at < touch.nodes.first[v + 1]; ++at)
      for (std::size_t d = 0; d < 3; ++d)
        result[3 * v + d] += touch.weight[at] * nodes[3 * static_cast<std::size_t>(touch.nodes.item[at]) + d];
  for (std::size_t v = 0; v < count; ++v)
    for (std::size_t d = 0; d < 3; ++d)
      if (discretisation.fixed[v][d]) result[3 * v + d] = 0;
  return result;
}

}  // namespace palpate
