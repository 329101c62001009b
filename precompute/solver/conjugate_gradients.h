// PETSc's conjugate gradients on K (x) I, with what the user's -ksp_ options make of them. Included by this folder only.
#pragma once

#include <petscksp.h>

#include <string>

namespace palpate {

class ConjugateGradients {
 public:
  using Apply = PetscErrorCode (*)(PC, Vec, Vec);

  // matrix: K (x) I on this communicator; apply: z = M^-1 r, which finds context by PCShellGetContext.
  // Errors: OperationError.
  ConjugateGradients(MPI_Comm communicator, Mat matrix, Apply apply, void* context);
  ~ConjugateGradients() { KSPDestroy(&ksp_); }
  ConjugateGradients(const ConjugateGradients&) = delete;
  ConjugateGradients& operator=(const ConjugateGradients&) = delete;

  // One run from zero; a -ksp_rtol of the user's counts and not relative_tolerance. PETSc's error code, not yet checked.
  PetscErrorCode run(Vec b, Vec x, double relative_tolerance);

  // Of the last run.
  int iterations() const;
  std::string reason() const;

  std::string type() const;  // "cg"

 private:
  KSP ksp_ = nullptr;
  PetscBool rtol_given_ = PETSC_FALSE;  // then the user decides how far each run goes; more runs do the rest
};

}  // namespace palpate
