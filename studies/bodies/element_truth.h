// By how much an element is stiffer than p2-p0 on the same mesh, under the loads of element_excess.h.
#pragma once

#include <algorithm>
#include <vector>

#include "precompute/tensors/element_excess.h"

namespace palpate {

// f . u of each probe's load f, where K u = f.
inline std::vector<double> probe_compliances(const ElasticBody& body, Element element) {
  const Discretisation d = discretise(body, element);
  const HeldStiffness held = remove_held_dofs(d.stiffness, d.fixed);
  const auto probes = element_probes(body);
  ColumnSolver solver(held.matrix, row_coordinates(d, held), {.width = static_cast<int>(probes.size())});
  const auto width = static_cast<std::size_t>(solver.width());
  std::vector<double> b(width * static_cast<std::size_t>(solver.dofs()), 0.0), x(b.size());
  for (std::size_t c = 0; c < probes.size(); ++c) {
    std::vector<double> load(3 * d.coordinates.size(), 0.0);
    if (d.touch.weight.empty()) load = probes[c];
    for (std::size_t v = 0; v < d.touch.nodes.size(); ++v)
      for (auto at = d.touch.nodes.first[v]; at < d.touch.nodes.first[v + 1]; ++at)
        for (std::size_t i = 0; i < 3; ++i)
          load[3 * static_cast<std::size_t>(d.touch.nodes.item[at]) + i] += d.touch.weight[at] * probes[c][3 * v + i];
    for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto node = static_cast<std::size_t>(held.node_of_row[row]);
        if (!d.fixed[node][i]) b[width * (3 * row + i) + c] = load[3 * node + i];
      }
  }
  std::vector<ColumnReport> reports(width);
  solver.solve(b.data(), x.data(), reports);
  std::vector<double> result(probes.size(), 0.0);
  for (std::size_t i = 0; i < b.size(); ++i)
    if (i % width < result.size()) result[i % width] += b[i] * x[i];
  return result;
}

inline ElementExcess element_truth(const ElasticBody& body, Element element) {
  const std::vector<double> own = probe_compliances(body, element), truth = probe_compliances(body, Element::p2_p0);
  std::vector<double> excess;
  for (std::size_t c = 0; c < own.size(); ++c) excess.push_back(truth[c] / own[c] - 1);
  std::sort(excess.begin(), excess.end());
  return {static_cast<int>(excess.size()), excess.back(), excess[excess.size() / 2]};
}

// As palpate-precompute measures it.
inline ElementExcess estimated_excess(const ElasticBody& body, Element element) {
  const Discretisation d = discretise(body, element);
  const HeldStiffness held = remove_held_dofs(d.stiffness, d.fixed);
  ColumnSolverOptions options;
  options.width = 8;
  ColumnSolver solver(held.matrix, row_coordinates(d, held), options);
  return measure_element_excess(body, element, d, held, solver);
}

}  // namespace palpate
