#include "precompute/solver/column_operator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "precompute/solver/batch_vector.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

constexpr const char* kOperatorName = "palpate_column_operator";

double largest_row_sum(const BlockMatrix& matrix) {
  double most = 0;
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
        for (int j = 0; j < 3; ++j) sum += std::abs(matrix.block[at][3 * i + j]);
      most = std::max(most, sum);
    }
  return most;
}

class WholeOperator final : public ColumnOperator {
 public:
  WholeOperator(WholeMatrix matrix, int width)
      : matrix_(std::move(matrix)),
        space_{matrix_.matrix, countable_width(3 * static_cast<std::int64_t>(matrix_.matrix.rows), width)},
        norm_(largest_row_sum(matrix_.matrix)) {
    const auto size = static_cast<PetscInt>(dofs() * space_.width);
    check(MatCreateShell(PETSC_COMM_SELF, size, size, size, size, this, &batch_));
    check(MatShellSetOperation(batch_, MATOP_MULT, reinterpret_cast<void (*)(void)>(multiply)));
    check(MatShellSetOperation(batch_, MATOP_CREATE_VECS, reinterpret_cast<void (*)(void)>(create_vectors)));
    check(MatSetOption(batch_, MAT_SPD, PETSC_TRUE));
    attach_operator(batch_, this);
  }
  ~WholeOperator() override { MatDestroy(&batch_); }
  WholeOperator(const WholeOperator&) = delete;
  WholeOperator& operator=(const WholeOperator&) = delete;

  MPI_Comm communicator() const override { return PETSC_COMM_SELF; }
  int width() const override { return space_.width; }
  std::int64_t dofs() const override { return 3 * static_cast<std::int64_t>(matrix_.matrix.rows); }
  std::int64_t own_dofs() const override { return dofs(); }
  double infinity_norm() const override { return norm_; }
  Mat batch_matrix() const override { return batch_; }
  Mat create_matrix(bool for_factor) const override {
    Mat result = create_petsc_matrix(matrix_.matrix, !for_factor);
    if (!for_factor) set_rigid_near_nullspace(result, matrix_.coordinates);
    return result;
  }
  MatSolverType factor_package() const override { return MATSOLVERCHOLMOD; }
  const WholeMatrix* whole() const override { return &matrix_; }
  void forget_form() override { matrix_.form.reset(); }

  Vec create_vector() const override { return create_batch_vector(space_); }
  void set_loads(Vec b, std::span<const Load> loads) const override { hold_loads(b, loads); }
  void begin(Vec x, double* solution) const override {
    forget_products_of(x);
    check(VecPlaceArray(x, solution));
  }
  void end(Vec x, double*) const override {
    forget_products_of(x);
    const PetscScalar* values = nullptr;  // a solution that is recorded as zero is written now
    check(VecGetArrayRead(x, &values));
    check(VecRestoreArrayRead(x, &values));
    check(VecResetArray(x));
  }
  std::vector<double> column_norms(Vec v) const override {
    const PetscScalar* values = nullptr;
    check(VecGetArrayRead(v, &values));
    auto norms = palpate::column_norms(values, dofs(), width());
    check(VecRestoreArrayRead(v, &values));
    return norms;
  }
  const std::vector<double>* norms_behind(double norm) const override {
    return norm == space_.norm ? &space_.norms : nullptr;
  }

 private:
  static PetscErrorCode multiply(Mat, Vec in, Vec out) { return hold_product(out, in); }
  static PetscErrorCode create_vectors(Mat shell, Vec* right, Vec* left) {
    void* context = nullptr;
    PetscCall(MatShellGetContext(shell, &context));
    auto& space = static_cast<WholeOperator*>(context)->space_;
    if (right) *right = create_batch_vector(space);
    if (left) *left = create_batch_vector(space);
    return 0;
  }

  WholeMatrix matrix_;
  mutable BatchSpace space_;
  double norm_;
  Mat batch_ = nullptr;
};

}  // namespace

std::unique_ptr<ColumnOperator> whole_operator(WholeMatrix matrix, int width) {
  return std::make_unique<WholeOperator>(std::move(matrix), (std::max(width, 1) + 7) / 8 * 8);
}

ColumnOperator* operator_of(Mat batch_matrix) {
  PetscObject container = nullptr;
  void* op = nullptr;
  if (!batch_matrix || PetscObjectQuery(reinterpret_cast<PetscObject>(batch_matrix), kOperatorName, &container) ||
      !container)
    return nullptr;
  PetscContainerGetPointer(reinterpret_cast<PetscContainer>(container), &op);
  return static_cast<ColumnOperator*>(op);
}

void attach_operator(Mat batch_matrix, ColumnOperator* op) {
  PetscContainer container = nullptr;
  check(PetscContainerCreate(PetscObjectComm(reinterpret_cast<PetscObject>(batch_matrix)), &container));
  check(PetscContainerSetPointer(container, op));
  check(PetscObjectCompose(reinterpret_cast<PetscObject>(batch_matrix), kOperatorName,
                           reinterpret_cast<PetscObject>(container)));
  check(PetscContainerDestroy(&container));
}

int countable_width(std::int64_t dofs, int width) {
  while (dofs * width > std::numeric_limits<PetscInt>::max() && width > 8) width -= 8;
  return width;
}

}  // namespace palpate
