#include "precompute/ranks/divided_operator.h"

#include <algorithm>
#include <cmath>

#include "precompute/solver/column_operator.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

// The mean of K's diagonal; the uncoupled rows of held dofs get it as their diagonal.
double mean_diagonal(MPI_Comm group, const BlockMatrix& own, std::int32_t first_row) {
  double sums[2] = {0, 3.0 * own.rows};
  for (std::int32_t row = 0; row < own.rows; ++row)
    for (auto at = own.first[row]; at < own.first[row + 1]; ++at)
      if (own.column[at] == first_row + row) sums[0] += own.block[at][0] + own.block[at][4] + own.block[at][8];
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, group);
  return sums[0] / sums[1];
}

class DividedOperator final : public ColumnOperator {
 public:
  DividedOperator(MPI_Comm group, const BlockMatrix& own, const RowPartition& partition,
                  std::span<const std::array<double, 3>> nodes, std::span<const std::array<std::uint8_t, 3>> fixed,
                  int width)
      : group_(group) {
    MPI_Comm_rank(group_, &rank_);
    lay_out(partition, width);
    create_k(own, partition, fixed);
    for (auto row = partition.first_row[rank_]; row < partition.first_row[rank_ + 1]; ++row)
      coordinates_.push_back(nodes[partition.node_of_row[row]]);
    set_rigid_near_nullspace(k_, coordinates_);
    check(MatCreateMAIJ(k_, width_, &batch_));
    attach_operator(batch_, this);
  }
  ~DividedOperator() override {
    MatDestroy(&batch_);
    MatDestroy(&k_);
  }
  DividedOperator(const DividedOperator&) = delete;
  DividedOperator& operator=(const DividedOperator&) = delete;

  MPI_Comm communicator() const override { return group_; }
  int width() const override { return width_; }
  std::int64_t dofs() const override { return dofs_; }
  std::int64_t own_dofs() const override { return own_dofs_; }
  double infinity_norm() const override { return norm_; }
  Mat batch_matrix() const override { return batch_; }
  Mat create_matrix(bool) const override {
    check(PetscObjectReference(reinterpret_cast<PetscObject>(k_)));
    return k_;
  }
  MatSolverType factor_package() const override { return MATSOLVERMUMPS; }

  Vec create_vector() const override {
    Vec vector = nullptr;
    check(MatCreateVecs(batch_, &vector, nullptr));
    return vector;
  }
  void set_loads(Vec b, std::span<const Load> loads) const override;
  void end(Vec x, double* solution) const override;
  bool has_result() const override { return rank_ == 0; }
  std::vector<double> column_norms(Vec v) const override;

 private:
  void lay_out(const RowPartition& partition, int width);
  void create_k(const BlockMatrix& own, const RowPartition& partition,
                std::span<const std::array<std::uint8_t, 3>> fixed);

  MPI_Comm group_;
  int rank_ = 0, width_ = 0;
  std::int64_t dofs_ = 0, own_dofs_ = 0, first_dof_ = 0;
  double norm_ = 0;
  std::vector<int> gather_counts_, gather_begin_;  // numbers of x of each rank
  std::vector<std::array<double, 3>> coordinates_;
  Mat k_ = nullptr, batch_ = nullptr;
};

void DividedOperator::lay_out(const RowPartition& partition, int width) {
  dofs_ = 3 * static_cast<std::int64_t>(partition.node_of_row.size());
  own_dofs_ = 3 * static_cast<std::int64_t>(partition.first_row[rank_ + 1] - partition.first_row[rank_]);
  first_dof_ = 3 * static_cast<std::int64_t>(partition.first_row[rank_]);
  refuse_uncountable(dofs_, "degrees of freedom");
  width_ = countable_width(dofs_, std::max(width, 1));  // MPI counts with 32 bits as well
  for (std::size_t other = 0; other + 1 < partition.first_row.size(); ++other) {
    gather_begin_.push_back(3 * width_ * partition.first_row[other]);
    gather_counts_.push_back(3 * width_ * (partition.first_row[other + 1] - partition.first_row[other]));
  }
}

void DividedOperator::create_k(const BlockMatrix& own, const RowPartition& partition,
                               std::span<const std::array<std::uint8_t, 3>> fixed) {
  refuse_uncountable(9 * static_cast<std::int64_t>(own.column.size()), "numbers of the stiffness matrix on one rank");
  const auto first_row = partition.first_row[rank_];
  const double held_diagonal = mean_diagonal(group_, own, first_row);
  std::vector<PetscInt> first(static_cast<std::size_t>(own_dofs_) + 1, 0), column;
  std::vector<PetscScalar> value;
  column.reserve(own.column.size() * 9);
  value.reserve(own.column.size() * 9);
  for (std::int32_t row = 0; row < own.rows; ++row)
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (auto at = own.first[row]; at < own.first[row + 1]; ++at)
        for (int j = 0; j < 3; ++j) {
          const bool held = fixed[partition.node_of_row[first_row + row]][i] != 0 ||
                            fixed[partition.node_of_row[own.column[at]]][j] != 0;
          const bool diagonal = own.column[at] == first_row + row && i == j;
          column.push_back(3 * own.column[at] + j);
          value.push_back(!held ? own.block[at][3 * i + j] : diagonal ? held_diagonal : 0.0);
          sum += std::abs(value.back());
        }
      norm_ = std::max(norm_, sum);
      first[static_cast<std::size_t>(3 * row + i + 1)] = static_cast<PetscInt>(column.size());
    }
  MPI_Allreduce(MPI_IN_PLACE, &norm_, 1, MPI_DOUBLE, MPI_MAX, group_);
  check(MatCreate(group_, &k_));
  check(MatSetSizes(k_, static_cast<PetscInt>(own_dofs_), static_cast<PetscInt>(own_dofs_), PETSC_DETERMINE,
                    PETSC_DETERMINE));
  check(MatSetBlockSize(k_, 3));
  check(MatSetType(k_, MATAIJ));
  check(MatSeqAIJSetPreallocationCSR(k_, first.data(), column.data(), value.data()));
  check(MatMPIAIJSetPreallocationCSR(k_, first.data(), column.data(), value.data()));
  check(MatSetOption(k_, MAT_SPD, PETSC_TRUE));
}

void DividedOperator::set_loads(Vec b, std::span<const Load> loads) const {
  PetscScalar* values = nullptr;
  check(VecGetArrayWrite(b, &values));
  std::fill_n(values, own_dofs_ * width_, 0.0);
  for (const Load& load : loads)
    if (load.dof >= first_dof_ && load.dof < first_dof_ + own_dofs_)
      values[(load.dof - first_dof_) * width_ + load.column] += load.value;
  check(VecRestoreArrayWrite(b, &values));
}

std::vector<double> DividedOperator::column_norms(Vec v) const {
  std::vector<double> sum(static_cast<std::size_t>(width_), 0.0);
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(v, &values));
  for (std::int64_t i = 0; i < own_dofs_; ++i)
    for (int c = 0; c < width_; ++c) sum[c] += values[i * width_ + c] * values[i * width_ + c];
  check(VecRestoreArrayRead(v, &values));
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), width_, MPI_DOUBLE, MPI_SUM, group_);
  for (double& s : sum) s = std::sqrt(s);
  return sum;
}

void DividedOperator::end(Vec x, double* solution) const {
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(x, &values));
  MPI_Gatherv(values, gather_counts_[rank_], MPI_DOUBLE, solution, gather_counts_.data(), gather_begin_.data(),
              MPI_DOUBLE, 0, group_);
  check(VecRestoreArrayRead(x, &values));
}

}  // namespace

std::unique_ptr<ColumnSolver> divided_column_solver(MPI_Comm group, BlockMatrix own, const RowPartition& partition,
                                                    std::span<const std::array<double, 3>> nodes,
                                                    std::span<const std::array<std::uint8_t, 3>> fixed,
                                                    const ColumnSolverOptions& options) {
  auto op = std::make_unique<DividedOperator>(group, own, partition, nodes, fixed, options.width);
  own = {};  // PETSc has a copy
  return std::make_unique<ColumnSolver>(std::move(op), options);
}

}  // namespace palpate
