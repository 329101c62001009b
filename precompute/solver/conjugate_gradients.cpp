#include "precompute/solver/conjugate_gradients.h"

#include "precompute/solver/petsc_session.h"

namespace palpate {

ConjugateGradients::ConjugateGradients(MPI_Comm communicator, Mat matrix, Apply apply, void* context) {
  check(KSPCreate(communicator, &ksp_));
  check(KSPSetType(ksp_, KSPCG));
  check(KSPSetNormType(ksp_, KSP_NORM_UNPRECONDITIONED));
  check(KSPSetOperators(ksp_, matrix, matrix));
  PC pc = nullptr;
  check(KSPGetPC(ksp_, &pc));
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetContext(pc, context));
  check(PCShellSetApply(pc, apply));
  // The right-hand side may be tiny.
  check(KSPSetTolerances(ksp_, PETSC_DEFAULT, 1e-300, PETSC_DEFAULT, PETSC_DEFAULT));
  check(PetscOptionsHasName(nullptr, nullptr, "-ksp_rtol", &rtol_given_));
  check(KSPSetFromOptions(ksp_));
  check(KSPSetUp(ksp_));
}

PetscErrorCode ConjugateGradients::run(Vec b, Vec x, double relative_tolerance) {
  if (!rtol_given_) check(KSPSetTolerances(ksp_, relative_tolerance, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  return KSPSolve(ksp_, b, x);
}

int ConjugateGradients::iterations() const {
  PetscInt done = 0;
  check(KSPGetIterationNumber(ksp_, &done));
  return static_cast<int>(done);
}

std::string ConjugateGradients::reason() const {
  KSPConvergedReason why = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(ksp_, &why));
  return KSPConvergedReasons[why];
}

std::string ConjugateGradients::type() const {
  KSPType type = nullptr;
  check(KSPGetType(ksp_, &type));
  return type;
}

}  // namespace palpate
