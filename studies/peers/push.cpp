#include "studies/peers/push.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "formats/errors.h"
#include "precompute/elements/discretisation.h"
#include "studies/peers/cholmod_factor.h"
#include "studies/peers/dirichlet_problem.h"

namespace palpate::studies {
namespace {

Eigen::Vector3d position(const ElasticBody& body, std::int32_t node) {
  return Eigen::Vector3d(body.nodes[node].data());
}

bool is_held(const ElasticBody& body, std::int32_t node) {
  return body.fixed[node][0] || body.fixed[node][1] || body.fixed[node][2];
}

std::int32_t node_at_median_distance(const ElasticBody& body) {
  std::vector<Eigen::Vector3d> held;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    if (is_held(body, static_cast<std::int32_t>(n))) held.push_back(position(body, static_cast<std::int32_t>(n)));
  std::vector<std::pair<double, std::int32_t>> candidates;
  for (const std::int32_t node : body.touchable) {
    if (is_held(body, node)) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& p : held) nearest = std::min(nearest, (p - position(body, node)).squaredNorm());
    candidates.emplace_back(nearest, node);
  }
  if (candidates.empty()) throw std::runtime_error("no touchable node is free in all directions");
  const auto middle = candidates.begin() + static_cast<std::ptrdiff_t>(candidates.size() / 2);
  std::nth_element(candidates.begin(), middle, candidates.end());
  return middle->second;
}

}  // namespace

Push make_push(ElasticBody body, Element element) {
  Push push;
  push.body = std::move(body);
  Discretisation discretisation = discretise(push.body, element);
  if (discretisation.coordinates.size() != push.body.nodes.size())
    throw InputError(fmt::format("expected an element on the mesh's own nodes, found {}", name_of(element)));
  push.stiffness = std::move(discretisation.stiffness);
  push.node = node_at_median_distance(push.body);
  auto triangle = std::find_if(push.body.triangles.begin(), push.body.triangles.end(),
                               [&](const auto& t) { return std::find(t.begin(), t.end(), push.node) != t.end(); });
  std::array<std::int32_t, 3> corner = *triangle;
  std::rotate(corner.begin(), std::find(corner.begin(), corner.end(), push.node), corner.end());
  const Eigen::Vector3d a = position(push.body, corner[0]), b = position(push.body, corner[1]),
                        c = position(push.body, corner[2]);
  push.entry = 0.9 * a + 0.05 * b + 0.05 * c;
  push.outward = (b - a).cross(c - a).normalized();
  const Eigen::Vector3d along = (b - a).normalized(), across = push.outward.cross(along);
  for (int tick = 0; tick < 250; ++tick) {
    const double time = tick * kTick, angle = 4 * std::numbers::pi * time;
    push.displacements.push_back(-(2.5e-3 + 1e-2 * time) * push.outward +
                                 1e-3 * ((std::cos(angle) - 1) * along + std::sin(angle) * across));
  }
  return push;
}

SparseMatrix sparse(const BlockMatrix& matrix) {
  SparseMatrix result(3 * matrix.rows, 3 * matrix.rows);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * matrix.block.size());
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (std::int64_t at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          if (const double value = matrix.block[at][3 * i + j]; value != 0)
            entries.emplace_back(3 * row + i, 3 * matrix.column[at] + j, value);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

Exact::Exact(const Push& push) {
  const DirichletProblem problem(push, push.node);
  CholmodFactor factor(sparse(problem.held.matrix));
  const auto solved = factor.solve(problem.load_of_unit);
  surface_.resize(3 * push.body.surface_count, 3);
  Answer answer;
  for (int j = 0; j < 3; ++j) {
    problem.read(solved.col(j), Eigen::Vector3d::Unit(j), answer);
    surface_.col(j) = answer.surface, force_.col(j) = answer.force;
  }
}

Answer Exact::at(const Eigen::Vector3d& displacement) const {
  return {surface_ * displacement, force_ * displacement};
}

}  // namespace palpate::studies
