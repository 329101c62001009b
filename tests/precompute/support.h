// Shared by the tests of this folder: PETSc for the life of the test program, and K as a dense matrix.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>
#include <string>

#include "formats/errors.h"
#include "precompute/elements/discretisation.h"
#include "precompute/elements/support_check.h"
#include "precompute/solver/petsc_session.h"
#include "studies/bodies/bodies.h"

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

// The dofs (numbered 3 n + d) that are not held.
inline std::vector<Eigen::Index> free_dofs(const ElasticBody& body) {
  std::vector<Eigen::Index> result;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (!body.fixed[n][d]) result.push_back(static_cast<Eigen::Index>(3 * n) + d);
  return result;
}

// The error message of check_support(), or "" where the supports hold the body.
inline std::string refusal(const ElasticBody& body) {
  try {
    check_support(body, "bc.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace palpate::tests
