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

// The elements, and what the names of a suite's tests end with that run with each of them.
inline constexpr Element kElements[] = {Element::p1, Element::p1_anp, Element::p1_ang, Element::p2_p0};
std::string name_of_instance(const ::testing::TestParamInfo<Element>& instance);

Selector patch(const char* name);
Selector nearest(const std::array<double, 3>& point);

// All regions of one material. Refusals name the files box.msh, organ.toml and bc.toml.
ElasticBody supported(const TetrahedralMesh& mesh, const Material& material, const BoundaryConfig& boundary);

// Regions of these names on both sides of x = half.
void part_in_two(TetrahedralMesh& mesh, double half, const std::vector<std::string>& names = {"left", "right"});

// The dofs (numbered 3 n + d) that are not held.
std::vector<Eigen::Index> free_dofs(const ElasticBody& body);

// The error message of check_support(), or "" where the supports hold the body.
std::string refusal(const ElasticBody& body);

}  // namespace palpate::tests
