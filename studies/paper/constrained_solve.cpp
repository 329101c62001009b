#include "studies/paper/constrained_solve.h"

#include <fmt/format.h>
#include <petscksp.h>

#include "formats/errors.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate::studies {

struct ConstrainedSolve::Petsc {
  Mat matrix = nullptr;
  KSP solver = nullptr;
  Vec load = nullptr, solution = nullptr;  // share the memory of the Eigen vectors

  ~Petsc() {
    KSPDestroy(&solver);
    VecDestroy(&load);
    VecDestroy(&solution);
    MatDestroy(&matrix);
  }
};

ConstrainedSolve::ConstrainedSolve(const Push& push, std::int32_t node, const std::string& preconditioner,
                                   double tolerance)
    : problem_(push, node), petsc_(std::make_unique<Petsc>()) {
  const HeldStiffness& held = problem_.held;
  const bool multigrid = preconditioner == "gamg";
  load_.setZero(3 * held.matrix.rows), solution_ = load_;
  Petsc& p = *petsc_;
  p.matrix = create_petsc_matrix(held.matrix, multigrid);
  if (multigrid) {
    std::vector<std::array<double, 3>> points;
    for (const auto n : held.node_of_row) points.push_back(push.body.nodes[static_cast<std::size_t>(n)]);
    set_rigid_near_nullspace(p.matrix, points);
  }
  const auto size = static_cast<PetscInt>(load_.size());
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, size, load_.data(), &p.load));
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, size, solution_.data(), &p.solution));
  check(KSPCreate(PETSC_COMM_SELF, &p.solver));
  check(KSPSetOperators(p.solver, p.matrix, p.matrix));
  check(KSPSetType(p.solver, KSPCG));
  check(KSPSetNormType(p.solver, KSP_NORM_UNPRECONDITIONED));
  check(KSPSetTolerances(p.solver, tolerance, 0, PETSC_DEFAULT, 20000));
  PC pc = nullptr;
  check(KSPGetPC(p.solver, &pc));
  check(PCSetType(pc, preconditioner.c_str()));
  check(KSPSetUp(p.solver));
}

ConstrainedSolve::~ConstrainedSolve() = default;

void ConstrainedSolve::move(const Eigen::Vector3d& displacement, bool from_last, Answer& answer) {
  Petsc& p = *petsc_;
  PetscScalar* load = nullptr;  // get and restore tell PETSc that the vector changed
  check(VecGetArray(p.load, &load));
  load_.noalias() = problem_.load_of_unit * displacement;
  check(VecRestoreArray(p.load, &load));
  check(KSPSetInitialGuessNonzero(p.solver, from_last ? PETSC_TRUE : PETSC_FALSE));
  check(KSPSolve(p.solver, p.load, p.solution));
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(p.solver, &reason));
  PetscInt iterations = 0;
  check(KSPGetIterationNumber(p.solver, &iterations));
  iterations_ = iterations;
  if (reason < 0)
    throw OperationError(
        fmt::format("the conjugate gradients did not converge in {} iterations; raise the tolerance", iterations));
  problem_.read(solution_, displacement, answer);
}

}  // namespace palpate::studies
