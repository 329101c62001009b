// What the tests of this folder share: PETSc for the whole test program, small bodies, dense views of K.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <functional>
#include <memory>
#include <string>

#include "precompute/discretisation.h"
#include "precompute/elastic_body.h"
#include "precompute/petsc_session.h"
#include "tests/support/box_mesh.h"

namespace palpate::tests {

class PetscEnvironment : public ::testing::Environment {
 public:
  void SetUp() override { session_ = std::make_unique<PetscSession>(std::vector<std::string>{}); }
  void TearDown() override { session_.reset(); }

 private:
  std::unique_ptr<PetscSession> session_;
};
inline const ::testing::Environment* const petsc_environment =
    ::testing::AddGlobalTestEnvironment(new PetscEnvironment);

// The mesh as a body in metres (mesh unit: m), nothing held, everything touchable.
inline ElasticBody body_of(const TetrahedralMesh& mesh, const std::vector<Material>& materials) {
  OrganConfig organ;
  for (std::size_t r = 0; r < mesh.region_names.size(); ++r)
    organ.regions.push_back({mesh.region_names[r], {materials[r].young, "test"}, {materials[r].poisson, "test"}, {}});
  return make_elastic_body(mesh, organ, {}, {});
}

// Holds the dofs of every node that which(point) names: bits 1, 2, 4 for x, y, z. Touchable nodes follow.
inline void hold(ElasticBody& body, const std::function<int(const std::array<double, 3>&)>& which) {
  body.touchable.clear();
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const int dofs = which(body.nodes[n]);
    for (int d = 0; d < 3; ++d) body.fixed[n][d] |= static_cast<std::uint8_t>((dofs >> d) & 1);
    const auto& f = body.fixed[n];
    if (static_cast<std::int32_t>(n) < body.surface_count && !(f[0] && f[1] && f[2]))
      body.touchable.push_back(static_cast<std::int32_t>(n));
  }
}

inline BlockMatrix assemble_stiffness(const ElasticBody& body, Element element = Element::p1) {
  return discretise(body, element).stiffness;
}

inline Eigen::MatrixXd dense(const BlockMatrix& k) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * k.rows, 3 * k.rows);
  for (std::int32_t row = 0; row < k.rows; ++row)
    for (auto at = k.first[row]; at < k.first[row + 1]; ++at)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) result(3 * row + i, 3 * k.column[at] + j) = k.block[at][3 * i + j];
  return result;
}

// Dofs 3 n + d that are not held.
inline std::vector<Eigen::Index> free_dofs(const ElasticBody& body) {
  std::vector<Eigen::Index> result;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (!body.fixed[n][d]) result.push_back(static_cast<Eigen::Index>(3 * n) + d);
  return result;
}

}  // namespace palpate::tests
