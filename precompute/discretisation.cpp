#include "precompute/discretisation.h"

#include "precompute/linear_tetrahedra.h"

namespace palpate {

Discretisation discretise(const ElasticBody& body, Element element) {
  Discretisation result;
  result.vertices = static_cast<std::int32_t>(body.nodes.size());
  result.coordinates = body.nodes;
  result.fixed = body.fixed;
  result.mass = linear_mass(body);
  result.stiffness = element == Element::p1 ? linear_stiffness(body) : nodal_dilatation_stiffness(body);
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
