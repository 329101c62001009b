#include "precompute/solver/column_operator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <utility>

#include "formats/errors.h"
#include "precompute/elements/column_buffer.h"
#include "precompute/solver/batch_product.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

constexpr const char* kOperatorName = "palpate_column_operator";

PetscErrorCode free_buffer(void* values) {
  FreeColumns()(values);
  return 0;
}

PetscErrorCode duplicate(Vec vector, Vec* result);

// Of size numbers that are not set. The system takes a page of it when it is first written, so that CG's work vectors cost nothing
// where the initial guess meets the tolerance; PETSc's own vectors are written with zeros.
Vec create_batch_vector(PetscInt size) {
  Vec vector = nullptr;
  PetscContainer container = nullptr;
  ColumnBuffer values = make_column_buffer(size, 1);
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, size, values.get(), &vector));
  check(PetscContainerCreate(PETSC_COMM_SELF, &container));
  check(PetscContainerSetPointer(container, values.release()));
  check(PetscContainerSetUserDestroy(container, free_buffer));
  check(PetscObjectCompose(reinterpret_cast<PetscObject>(vector), "palpate_batch_numbers",
                           reinterpret_cast<PetscObject>(container)));
  check(PetscContainerDestroy(&container));
  check(VecSetOperation(vector, VECOP_DUPLICATE, reinterpret_cast<void (*)(void)>(duplicate)));
  return vector;
}

template <class Work>
PetscErrorCode guarded(const Work& work) {  // no exception may pass through PETSc's C code
  try {
    work();
  } catch (const std::bad_alloc&) {
    return PetscError(PETSC_COMM_SELF, __LINE__, "column_operator", __FILE__, PETSC_ERR_MEM, PETSC_ERROR_INITIAL,
                      "out of memory for a batch of columns");
  } catch (const OperationError&) {
    return PETSC_ERR_LIB;  // PETSc has told
  }
  return 0;
}

PetscErrorCode duplicate(Vec vector, Vec* result) {
  PetscInt size = 0;
  PetscCall(VecGetSize(vector, &size));
  return guarded([&] { *result = create_batch_vector(size); });
}

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
        width_(countable_width(3 * static_cast<std::int64_t>(matrix_.matrix.rows), width)),
        norm_(largest_row_sum(matrix_.matrix)) {
    check(MatCreateShell(PETSC_COMM_SELF, size(), size(), size(), size(), this, &batch_));
    check(MatShellSetOperation(batch_, MATOP_MULT, reinterpret_cast<void (*)(void)>(multiply_shell)));
    check(MatShellSetOperation(batch_, MATOP_CREATE_VECS, reinterpret_cast<void (*)(void)>(create_vectors)));
    check(MatSetOption(batch_, MAT_SPD, PETSC_TRUE));
    attach_operator(batch_, this);
  }
  ~WholeOperator() override { MatDestroy(&batch_); }
  WholeOperator(const WholeOperator&) = delete;
  WholeOperator& operator=(const WholeOperator&) = delete;

  MPI_Comm communicator() const override { return PETSC_COMM_SELF; }
  int width() const override { return width_; }
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

  Vec create_vector() const override { return create_batch_vector(size()); }
  void set_loads(Vec b, std::span<const Load> loads) const override {
    PetscScalar* values = nullptr;
    check(VecGetArray(b, &values));
    if (b != loaded_) std::fill_n(values, size(), 0.0), loads_.clear();
    for (const Load& load : loads_) values[load.dof * width_ + load.column] = 0;
    loads_.assign(loads.begin(), loads.end());
    for (const Load& load : loads_) values[load.dof * width_ + load.column] += load.value;
    check(VecRestoreArray(b, &values));
    loaded_ = b;
  }
  const std::vector<Load>* loads_of(Vec b) const override { return b == loaded_ ? &loads_ : nullptr; }
  void begin(Vec x, double* solution) const override {
    check(VecPlaceArray(x, solution));
    solution_ = x;
    norms_.clear();
  }
  void end(Vec x, double*) const override {
    check(VecResetArray(x));
    solution_ = nullptr;
  }
  std::vector<double> column_norms(Vec v) const override {
    const PetscScalar* values = nullptr;
    check(VecGetArrayRead(v, &values));
    auto norms = palpate::column_norms(values, dofs(), width());
    check(VecRestoreArrayRead(v, &values));
    return norms;
  }
  std::vector<double> take_residual_norms() override { return std::exchange(norms_, {}); }

 private:
  PetscInt size() const { return static_cast<PetscInt>(dofs() * width_); }
  // The product of the solution comes with its residual: the rows are in the cache.
  void multiply(Vec in, Vec out) {
    const PetscScalar* from = nullptr;
    PetscScalar* to = nullptr;
    check(VecGetArrayRead(in, &from));
    check(VecGetArrayWrite(out, &to));
    if (in == solution_)
      norms_ = palpate::residual_norms(matrix_.matrix, loads_, from, width_, to);
    else
      multiply_batch(matrix_.matrix, from, to, width_);
    check(VecRestoreArrayWrite(out, &to));
    check(VecRestoreArrayRead(in, &from));
  }
  static WholeOperator& of(Mat shell) {
    void* context = nullptr;
    check(MatShellGetContext(shell, &context));
    return *static_cast<WholeOperator*>(context);
  }
  static PetscErrorCode multiply_shell(Mat shell, Vec in, Vec out) {
    return guarded([&] { of(shell).multiply(in, out); });
  }
  static PetscErrorCode create_vectors(Mat shell, Vec* right, Vec* left) {
    return guarded([&] {
      if (right) *right = of(shell).create_vector();
      if (left) *left = of(shell).create_vector();
    });
  }

  WholeMatrix matrix_;
  int width_;
  double norm_;
  Mat batch_ = nullptr;
  // Of the batch that is being solved: b and what it was loaded with, x, and ||b - K x|| of each column once K x is computed.
  mutable Vec loaded_ = nullptr, solution_ = nullptr;
  mutable std::vector<Load> loads_;
  mutable std::vector<double> norms_;
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
