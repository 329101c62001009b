#include "precompute/petsc_preconditioner.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "formats/errors.h"
#include "precompute/petsc_session.h"

namespace palpate {
namespace {

constexpr const char* kPrefix = "column_";

// [rows][columns] -> [columns][rows], in tiles that stay in cache.
void transpose(const double* from, double* to, std::int64_t rows, std::int64_t columns) {
  constexpr std::int64_t kTile = 16;
  for (std::int64_t r = 0; r < rows; r += kTile)
    for (std::int64_t c = 0; c < columns; c += kTile)
      for (std::int64_t j = c; j < std::min(c + kTile, columns); ++j)
        for (std::int64_t i = r; i < std::min(r + kTile, rows); ++i) to[j * rows + i] = from[i * columns + j];
}

class PetscPreconditioner final : public BlockPreconditioner {
 public:
  PetscPreconditioner(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates, int width,
                      const std::string& type)
      : dofs_(3 * static_cast<std::int64_t>(matrix.rows)), width_(width) {
    const bool direct = type == PCCHOLESKY || type == PCLU;
    create_matrix(matrix, !direct);
    if (!direct) set_near_nullspace(coordinates);
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
  void create_matrix(const BlockMatrix& matrix, bool blocked);
  void set_near_nullspace(std::span<const std::array<double, 3>> coordinates);
  void create(const std::string& type);
  void set_up(const std::string& type);

  std::int64_t dofs_;
  int width_;
  Mat matrix_ = nullptr;  // K, entry by entry
  PC pc_ = nullptr;
  Mat in_ = nullptr, out_ = nullptr;  // one block, column after column
  std::string description_;
};

// The direct solvers want block size 1; multigrid wants 3, to aggregate nodes and not dofs.
void PetscPreconditioner::create_matrix(const BlockMatrix& matrix, bool blocked) {
  // PETSc counts with 32 bits.
  constexpr auto most = std::numeric_limits<PetscInt>::max();
  if (static_cast<std::int64_t>(matrix.column.size()) > most / 9)
    throw OperationError(
        fmt::format("the stiffness matrix has {} numbers, more than the {} that this PETSc can count; a "
                    "coarser mesh is needed",
                    9 * matrix.column.size(), most));
  const auto n = static_cast<PetscInt>(dofs_);
  std::vector<PetscInt> first(n + 1, 0), column;
  std::vector<PetscScalar> value;
  column.reserve(matrix.column.size() * 9);
  value.reserve(matrix.column.size() * 9);
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (int i = 0; i < 3; ++i) {
      for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
        for (int j = 0; j < 3; ++j) {
          column.push_back(3 * matrix.column[at] + j);
          value.push_back(matrix.block[at][3 * i + j]);
        }
      first[3 * row + i + 1] = static_cast<PetscInt>(column.size());
    }
  check(MatCreate(PETSC_COMM_SELF, &matrix_));
  check(MatSetSizes(matrix_, n, n, n, n));
  check(MatSetType(matrix_, MATSEQAIJ));
  if (blocked) check(MatSetBlockSize(matrix_, 3));
  check(MatSeqAIJSetPreallocationCSR(matrix_, first.data(), column.data(), value.data()));
  check(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
}

void PetscPreconditioner::set_near_nullspace(std::span<const std::array<double, 3>> coordinates) {
  Vec places = nullptr;
  check(VecCreateSeq(PETSC_COMM_SELF, static_cast<PetscInt>(dofs_), &places));
  check(VecSetBlockSize(places, 3));
  PetscScalar* values = nullptr;
  check(VecGetArray(places, &values));
  for (std::size_t r = 0; r < coordinates.size(); ++r)
    for (int d = 0; d < 3; ++d) values[3 * r + d] = coordinates[r][d];
  check(VecRestoreArray(places, &values));
  MatNullSpace rigid = nullptr;
  check(MatNullSpaceCreateRigidBody(places, &rigid));
  check(MatSetNearNullSpace(matrix_, rigid));
  check(MatNullSpaceDestroy(&rigid));
  check(VecDestroy(&places));
}

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
