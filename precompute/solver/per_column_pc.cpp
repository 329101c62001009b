#include "precompute/solver/per_column_pc.h"

#include <fmt/format.h>

#include <string>

#include "formats/errors.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

class PerColumnPc final : public BatchPreconditioner {
 public:
  explicit PerColumnPc(const ColumnOperator& op)
      : dofs_(op.own_dofs()),
        width_(op.width()),
        direct_(op.per_column_type == PCCHOLESKY || op.per_column_type == PCLU) {
    matrix_ = op.create_matrix(direct_);
    create(op);
    set_up(op);
    MatSolverType package = nullptr;
    if (direct_) check(PCFactorGetMatSolverType(pc_, &package));
    description_ = fmt::format("{}{}", op.per_column_type, package ? fmt::format(" ({})", package) : "");
    const auto rows = static_cast<PetscInt>(dofs_);
    for (Mat* columns : {&in_, &out_})
      check(MatCreateDense(op.communicator(), rows, PETSC_DECIDE, PETSC_DETERMINE, width_, nullptr, columns));
  }
  ~PerColumnPc() override {
    PCDestroy(&pc_);
    MatDestroy(&matrix_);
    MatDestroy(&in_);
    MatDestroy(&out_);
  }
  PerColumnPc(const PerColumnPc&) = delete;
  PerColumnPc& operator=(const PerColumnPc&) = delete;

  void apply(const double* r, double* z) override;
  std::string description() const override { return description_; }
  bool is_exact() const override { return direct_; }
  PC pc() const { return pc_; }

 private:
  void create(const ColumnOperator& op);
  void set_up(const ColumnOperator& op);

  std::int64_t dofs_;  // of this rank's rows
  int width_;
  bool direct_;
  Mat matrix_ = nullptr;  // K, entry by entry
  PC pc_ = nullptr;
  Mat in_ = nullptr, out_ = nullptr;  // a batch, one column after another
  std::string description_;
};

void PerColumnPc::create(const ColumnOperator& op) {
  // The default smoother is Chebyshev with Jacobi: with sor or pbjacobi CG has diverged.
  if (op.per_column_type == PCGAMG) set_default_petsc_option("-column_mg_levels_pc_type", PCJACOBI);
  check(PCCreate(op.communicator(), &pc_));
  check(PCSetOptionsPrefix(pc_, "column_"));
  check(PCSetOperators(pc_, matrix_, matrix_));
  check(PCSetType(pc_, op.per_column_type.c_str()));
  if (direct_) check(PCFactorSetMatSolverType(pc_, op.factor_package()));
  check(PCSetFromOptions(pc_));
}

void PerColumnPc::set_up(const ColumnOperator& op) {
  try {
    check(PCSetUp(pc_));
    check(PCSetUpOnBlocks(pc_));
  } catch (const OperationError& error) {
    throw OperationError(fmt::format(
        "the preconditioner \"{}\" of {} degrees of freedom cannot be set up: {}; if memory ran out, {}",
        op.per_column_type, op.dofs(), error.what(),
        op.whole() ? "try \"-- -column_pc_type gamg\"" : "raise --ranks-per-operator or use more machines"));
  }
  PCFailedReason failed = PC_NOERROR;
  check(PCGetFailedReason(pc_, &failed));
  if (failed != PC_NOERROR)
    throw OperationError(fmt::format(
        "the preconditioner \"{}\" failed ({}): the stiffness matrix is not positive definite to working precision, or "
        "memory ran out{}",
        op.per_column_type, PCFailedReasons[failed],
        op.whole() ? "" : "; with more memory, or a larger --ranks-per-operator, it may hold"));
}

void PerColumnPc::apply(const double* r, double* z) {
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

std::unique_ptr<BatchPreconditioner> make_per_column_pc(const ColumnOperator& op) {
  return std::make_unique<PerColumnPc>(op);
}

PetscErrorCode view_inner_pc(const BatchPreconditioner& preconditioner, PetscViewer viewer) {
  const auto* inner = dynamic_cast<const PerColumnPc*>(&preconditioner);
  return inner ? PCView(inner->pc(), viewer) : 0;
}

}  // namespace palpate
