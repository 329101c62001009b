#include "tests/precompute/support.h"

#include <algorithm>

#include "tests/support/texts.h"

namespace palpate::tests {

BlockMatrix assemble_stiffness(const ElasticBody& body, Element element) {
  return discretise(body, element).stiffness;
}

Eigen::MatrixXd dense(const BlockMatrix& k) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * k.rows, 3 * k.rows);
  for (std::int32_t row = 0; row < k.rows; ++row)
    for (auto at = k.first[row]; at < k.first[row + 1]; ++at)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) result(3 * row + i, 3 * k.column[at] + j) = k.block[at][3 * i + j];
  return result;
}

std::string name_of_instance(const ::testing::TestParamInfo<Element>& instance) {
  std::string name = name_of(instance.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

Selector patch(const char* name) {
  return {.kind = Selector::Kind::patch, .whole_mesh = true, .names = {name}};
}

Selector nearest(const std::array<double, 3>& point) {
  return {.kind = Selector::Kind::nearest, .points = {point}};
}

ElasticBody supported(const TetrahedralMesh& mesh, const Material& material, const BoundaryConfig& boundary) {
  OrganConfig organ;
  for (const auto& name : mesh.region_names) {
    organ.regions.push_back({name, {material.young, "test"}, {material.poisson, "test"}, {}});
    if (material.density > 0) organ.regions.back().density = SourcedValue{material.density, "test"};
  }
  return make_elastic_body(mesh, organ, boundary, {"box.msh", "organ.toml", "bc.toml"});
}

void part_in_two(TetrahedralMesh& mesh, double half, const std::vector<std::string>& names) {
  mesh.region_names = names;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    double x = 0;
    for (const auto n : mesh.tetrahedra[t]) x += mesh.nodes[n][0] / 4;
    mesh.region[t] = x > half;
  }
}

std::vector<Eigen::Index> free_dofs(const ElasticBody& body) {
  std::vector<Eigen::Index> result;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (!body.fixed[n][d]) result.push_back(static_cast<Eigen::Index>(3 * n) + d);
  return result;
}

std::string refusal(const ElasticBody& body) {
  return input_error([&] { check_support(body, "bc.toml"); });
}

}  // namespace palpate::tests
