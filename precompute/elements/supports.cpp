#include "precompute/elements/supports.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/quadratic_tetrahedra.h"
#include "precompute/elements/quadratic_triangle.h"

namespace palpate {
namespace {

using Eigen::Vector3d;

Vector3d at(const std::vector<std::array<double, 3>>& nodes, std::int32_t n) {
  return Vector3d(nodes[n].data());
}

// tangential I + (normal - tangential) n n^T, symmetric to the last bit.
std::array<double, 9> stiffness_per_area(const Foundation& foundation, const Vector3d& n) {
  std::array<double, 9> k;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      k[3 * i + j] =
          (i == j ? foundation.tangential : 0.0) + (foundation.normal - foundation.tangential) * (n[i] * n[j]);
  return k;
}

void add_block(BlockMatrix& matrix, std::int32_t row, std::int32_t column, double factor,
               const std::array<double, 9>& value) {
  auto& block = matrix.block[index_of_block(matrix, row, column)];
  for (int i = 0; i < 9; ++i) block[i] += factor * value[i];
}

void add_linear_foundation(const ElasticBody& body, const Foundation& foundation, BlockMatrix& matrix) {
  for (const auto triangle : foundation.triangles) {
    const auto& t = body.triangles[triangle];
    const Vector3d a = at(body.nodes, t[0]);
    const Vector3d cross = (at(body.nodes, t[1]) - a).cross(at(body.nodes, t[2]) - a);
    const double area = cross.norm() / 2;
    const auto k = stiffness_per_area(foundation, cross.normalized());
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) add_block(matrix, t[i], t[j], area * (i == j ? 2 : 1) / 12, k);
  }
}

void add_quadratic_foundation(const QuadraticMesh& mesh, const Foundation& foundation, BlockMatrix& matrix) {
  for (const auto triangle : foundation.triangles) {
    const auto& t = mesh.triangles[triangle];
    for (const TrianglePoint& point : triangle_points()) {
      const TriangleShapes s = shapes_of(point.at);
      const Vector3d cross = twice_area(s, [&](std::size_t i) { return at(mesh.nodes, t[i]); });
      const auto k = stiffness_per_area(foundation, cross.normalized());
      const double area = point.weight * cross.norm() / 2;
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) add_block(matrix, t[i], t[j], area * (s.value[i] * s.value[j]), k);
    }
  }
}

// The matrix with a zero block for each pair that has none.
BlockMatrix with_blocks(const BlockMatrix& matrix, std::vector<std::array<std::int32_t, 2>> pairs) {
  std::sort(pairs.begin(), pairs.end());
  BlockMatrix result;
  result.rows = matrix.rows;
  result.first.assign(1, 0);
  auto next = pairs.begin();
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    auto from = matrix.first[row];
    while (from < matrix.first[row + 1] || (next != pairs.end() && (*next)[0] == row)) {
      const bool has_old = from < matrix.first[row + 1], has_new = next != pairs.end() && (*next)[0] == row;
      const bool take_new = has_new && (!has_old || (*next)[1] < matrix.column[from]);
      const auto column = take_new ? (*next)[1] : matrix.column[from];
      result.column.push_back(column);
      result.block.push_back(take_new ? std::array<double, 9>{} : matrix.block[from]);
      if (!take_new) ++from;
      while (next != pairs.end() && (*next)[0] == row && (*next)[1] == column) ++next;
    }
    result.first.push_back(static_cast<std::int64_t>(result.column.size()));
  }
  return result;
}

std::array<double, 9> block_of(const Spring& spring) {
  const bool every_way = spring.axis == std::array<double, 3>{0, 0, 0};
  std::array<double, 9> k;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      k[3 * i + j] = spring.stiffness * (every_way ? (i == j ? 1.0 : 0.0) : spring.axis[i] * spring.axis[j]);
  return k;
}

void add_springs(const ElasticBody& body, BlockMatrix& matrix) {
  std::vector<std::array<std::int32_t, 2>> pairs;
  for (const auto& set : body.springs)
    for (const auto& spring : set.springs)
      if (spring.b !=
          Spring::kWorld)  // on a rank's part of a body one end may have no element, and so no diagonal block
        for (const auto row : {spring.a, spring.b})
          for (const auto column : {spring.a, spring.b}) pairs.push_back({row, column});
  if (!pairs.empty()) matrix = with_blocks(matrix, std::move(pairs));
  for (const auto& set : body.springs)
    for (const auto& spring : set.springs) {
      const std::array<double, 9> k = block_of(spring);
      add_block(matrix, spring.a, spring.a, 1, k);
      if (spring.b == Spring::kWorld) continue;
      add_block(matrix, spring.b, spring.b, 1, k);
      add_block(matrix, spring.a, spring.b, -1, k);
      add_block(matrix, spring.b, spring.a, -1, k);
    }
}

}  // namespace

double area_of(const ElasticBody& body, const Foundation& foundation) {
  double area = 0;
  for (const auto triangle : foundation.triangles) {
    const auto& t = body.triangles[triangle];
    const Vector3d a = at(body.nodes, t[0]);
    area += (at(body.nodes, t[1]) - a).cross(at(body.nodes, t[2]) - a).norm() / 2;
  }
  return area;
}

std::vector<std::array<double, 2>> foundation_of_triangles(const ElasticBody& body) {
  std::vector<std::array<double, 2>> result;
  if (body.foundations.empty()) return result;
  result.assign(body.triangles.size(), {0, 0});
  for (const auto& foundation : body.foundations)
    for (const auto t : foundation.triangles) {
      result[t][0] += foundation.normal;
      result[t][1] += foundation.tangential;
    }
  return result;
}

SupportStiffness support_stiffness(const ElasticBody& body) {
  std::vector<std::array<std::int32_t, 2>> pairs;
  for (const auto& foundation : body.foundations)
    for (const auto triangle : foundation.triangles)
      for (const auto row : body.triangles[triangle])
        for (const auto column : body.triangles[triangle]) pairs.push_back({row, column});
  for (const auto& set : body.springs)
    for (const auto& spring : set.springs) pairs.push_back({spring.a, spring.a});
  BlockMatrix matrix;
  matrix.rows = static_cast<std::int32_t>(body.nodes.size());
  matrix.first.assign(body.nodes.size() + 1, 0);
  matrix = with_blocks(matrix, std::move(pairs));
  add_supports(body, matrix);
  SupportStiffness result;
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
      if (matrix.column[at] >= row) {
        result.nodes.push_back({row, matrix.column[at]});
        result.block.push_back(matrix.block[at]);
      }
  return result;
}

BlockMatrix base_stiffness(const ElasticBody& body, const QuadraticMesh* mesh) {
  std::vector<std::array<std::int32_t, 2>> pairs;
  const auto couple = [&pairs](const auto& nodes) {
    for (const auto row : nodes)
      for (const auto column : nodes) pairs.push_back({row, column});
  };
  for (const auto& foundation : body.foundations)
    for (const auto triangle : foundation.triangles) {
      if (mesh)
        couple(mesh->triangles[triangle]);
      else
        couple(body.triangles[triangle]);
    }
  for (const auto& set : body.springs)
    for (const auto& spring : set.springs)
      if (spring.b == Spring::kWorld) pairs.push_back({spring.a, spring.a});
  BlockMatrix matrix;
  const std::size_t nodes = mesh ? mesh->nodes.size() : body.nodes.size();
  matrix.rows = static_cast<std::int32_t>(nodes);
  matrix.first.assign(nodes + 1, 0);
  matrix = with_blocks(matrix, std::move(pairs));
  for (const auto& foundation : body.foundations) {
    if (mesh)
      add_quadratic_foundation(*mesh, foundation, matrix);
    else
      add_linear_foundation(body, foundation, matrix);
  }
  for (const auto& set : body.springs)
    for (const auto& spring : set.springs)
      if (spring.b == Spring::kWorld) add_block(matrix, spring.a, spring.a, 1, block_of(spring));
  return matrix;
}

void add_supports(const ElasticBody& body, BlockMatrix& matrix) {
  for (const auto& foundation : body.foundations) add_linear_foundation(body, foundation, matrix);
  add_springs(body, matrix);
}

void add_supports(const ElasticBody& body, const QuadraticMesh& mesh, BlockMatrix& matrix) {
  for (const auto& foundation : body.foundations) add_quadratic_foundation(mesh, foundation, matrix);
  add_springs(body, matrix);
}

}  // namespace palpate
