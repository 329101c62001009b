// PETSc and MPI for the life of a program, and PETSc's errors as ours. Included by this folder only.
#pragma once

#include <petscsys.h>

#include <string>
#include <vector>

namespace palpate {

// Starts MPI (unless it runs already) and PETSc with these options, without reading a .petscrc file; ends both.
// Errors: OperationError.
class PetscSession {
 public:
  explicit PetscSession(const std::vector<std::string>& options);
  PetscSession(const PetscSession&) = delete;
  PetscSession& operator=(const PetscSession&) = delete;
  ~PetscSession();

 private:
  bool owns_mpi_ = false;
  std::vector<std::string> texts_;
  std::vector<char*> arguments_;
};

// Throws OperationError with PETSc's own sentence when code is not 0.
void check(PetscErrorCode code);

// Sets an option that the user has not set; it does not count as unused.
void set_default_petsc_option(const std::string& name, const std::string& value);

// The value of an option, otherwise where it is not given.
std::string petsc_option_or(const char* name, const char* otherwise);

// The user's options that nothing has asked for so far, as "-name value"; empty when all were used.
std::string unused_petsc_options();

// All options in force, sorted, as one line.
std::string petsc_options_in_force();

// "PETSc 3.18.5".
std::string petsc_version();

}  // namespace palpate
