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

BlockMatrix assemble_stiffness(const ElasticBody& body, Element element = Element::p1);

Eigen::MatrixXd dense(const BlockMatrix& k);

// The dofs (numbered 3 n + d) that are not held.
std::vector<Eigen::Index> free_dofs(const ElasticBody& body);

// The error message of check_support(), or "" where the supports hold the body.
std::string refusal(const ElasticBody& body);

}  // namespace palpate::tests
