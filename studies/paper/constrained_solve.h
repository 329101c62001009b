// The full constrained solve of every move, as in the paper: PETSc's conjugate gradients on the displaced node's system.
#pragma once

#include <memory>
#include <string>

#include "studies/peers/dirichlet_problem.h"

namespace palpate::studies {

class ConstrainedSolve {
 public:
  // preconditioner: PETSc's name, "jacobi" or "gamg" (which gets the rigid motions). tolerance: of the residual, relative
  // to the right-hand side. Errors: OperationError.
  ConstrainedSolve(const Push& push, std::int32_t node, const std::string& preconditioner, double tolerance);
  ~ConstrainedSolve();

  // from_last: the move before is where the iteration starts. Errors: OperationError where it does not converge.
  void move(const Eigen::Vector3d& displacement, bool from_last, Answer& answer);
  int iterations() const { return iterations_; }  // of the last move

 private:
  struct Petsc;
  DirichletProblem problem_;
  std::unique_ptr<Petsc> petsc_;
  Eigen::VectorXd load_, solution_;
  int iterations_ = 0;
};

}  // namespace palpate::studies
