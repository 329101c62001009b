#include "precompute/solver/petsc_preconditioner.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>

#include "formats/errors.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

constexpr const char* kPrefix = "column_";

class PetscPreconditioner final : public BlockPreconditioner {
 public:
  PetscPreconditioner(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates, int width,
                      const std::string& type)
      : dofs_(3 * static_cast<std::int64_t>(matrix.rows)), width_(width) {
    const bool direct = type == PCCHOLESKY || type == PCLU;
    matrix_ = create_petsc_matrix(matrix, !direct);
    if (!direct) set_rigid_near_nullspace(matrix_, coordinates);
    create(type);
    set_up(type);
    MatSolverType package = nullptr;
    if (direct) check(PCFactorGetMatSolverType(pc_, &package));
    description_ = fmt::format("{}{}", type, package ? fmt::format(" ({})", package) : "");
    const auto rows = static_cast<PetscInt>(dofs_);
    check(MatCreateSeqDense(PETSC_COMM_SELF, rows, width, nullptr, &in_));
    check(MatCreateSeqDense(PETSC_COMM_SELF, rows, width, nullptr, &out_));
  }
  ~PetscPreconditioner() override {
    PCDestroy(&pc_);
    MatDestroy(&matrix_);
    MatDestroy(&in_);
    MatDestroy(&out_);
  }
  PetscPreconditioner(const PetscPreconditioner&) = delete;
  PetscPreconditioner& operator=(const PetscPreconditioner&) = delete;

  void apply(const double* r, double* z) override;
  std::string description() const override { return description_; }

 private:
  void create(const std::string& type);
  void set_up(const std::string& type);

  std::int64_t dofs_;
  int width_;
  Mat matrix_ = nullptr;  // K, entry by entry
  PC pc_ = nullptr;
  Mat in_ = nullptr, out_ = nullptr;  // one block, column after column
  std::string description_;
};

void PetscPreconditioner::create(const std::string& type) {
  // Chebyshev over Jacobi: the smoothers that PETSc or users would take otherwise (sor, pbjacobi) have diverged.
  if (type == PCGAMG) set_default_petsc_option("-column_mg_levels_pc_type", PCJACOBI);
  check(PCCreate(PETSC_COMM_SELF, &pc_));
  check(PCSetOptionsPrefix(pc_, kPrefix));
  check(PCSetOperators(pc_, matrix_, matrix_));
  check(PCSetType(pc_, type.c_str()));
  if (type == PCCHOLESKY) check(PCFactorSetMatSolverType(pc_, MATSOLVERCHOLMOD));
  check(PCSetFromOptions(pc_));
}

void PetscPreconditioner::set_up(const std::string& type) {
  try {
    check(PCSetUp(pc_));
    if (type == PCCHOLESKY) check(PCSetUpOnBlocks(pc_));
  } catch (const OperationError& error) {
    throw OperationError(fmt::format(
        "the preconditioner \"{}\" cannot be set up for {} degrees of freedom: {}; if memory ran out, try \"-- "
        "-column_pc_type gamg\"",
        type, dofs_, error.what()));
  }
  PCFailedReason failed = PC_NOERROR;
  check(PCGetFailedReason(pc_, &failed));
  if (failed != PC_NOERROR)
    throw OperationError(
        fmt::format("the preconditioner \"{}\" failed ({}): the stiffness matrix is not positive definite "
                    "to working precision, or memory ran out",
                    type, PCFailedReasons[failed]));
}

void PetscPreconditioner::apply(const double* r, double* z) {
  PetscScalar* to = nullptr;
  const PetscScalar* from = nullptr;
  check(MatDenseGetArrayWrite(in_, &to));
  transpose(r, to, dofs_, width_);
  check(MatDenseRestoreArrayWrite(in_, &to));
  check(MatAssemblyBegin(in_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(in_, MAT_FINAL_ASSEMBLY));
  check(PCMatApply(pc_, in_, out_));
  check(MatDenseGetArrayRead(out_, &from));
  transpose(from, z, width_, dofs_);
  check(MatDenseRestoreArrayRead(out_, &from));
}

}  // namespace

std::unique_ptr<BlockPreconditioner> make_petsc_preconditioner(const BlockMatrix& matrix,
                                                               std::span<const std::array<double, 3>> coordinates,
                                                               int width, const std::string& type) {
  return std::make_unique<PetscPreconditioner>(matrix, coordinates, width, type);
}

}  // namespace palpate
