#include "precompute/solver/petsc_matrix.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "formats/errors.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {

void refuse_uncountable(std::int64_t count, const char* what) {
  constexpr std::int64_t most = std::numeric_limits<PetscInt>::max();
  if (count > most)
    throw OperationError(
        fmt::format("{} {} are more than the {} that this PETSc counts with its 32-bit indices; use a coarser mesh, or "
                    "more ranks per "
                    "operator (--ranks-per-operator)",
                    count, what, most));
}

Mat create_petsc_matrix(const BlockMatrix& matrix, bool blocked) {
  refuse_uncountable(9 * static_cast<std::int64_t>(matrix.column.size()), "numbers of the stiffness matrix");
  const PetscInt n = 3 * matrix.rows;
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
  Mat result = nullptr;
  check(MatCreate(PETSC_COMM_SELF, &result));
  check(MatSetSizes(result, n, n, n, n));
  check(MatSetType(result, MATSEQAIJ));
  if (blocked) check(MatSetBlockSize(result, 3));
  check(MatSeqAIJSetPreallocationCSR(result, first.data(), column.data(), value.data()));
  check(MatSetOption(result, MAT_SPD, PETSC_TRUE));
  return result;
}

void set_rigid_near_nullspace(Mat matrix, std::span<const std::array<double, 3>> coordinates) {
  Vec positions = nullptr;
  check(VecCreate(PetscObjectComm(reinterpret_cast<PetscObject>(matrix)), &positions));
  check(VecSetSizes(positions, static_cast<PetscInt>(3 * coordinates.size()), PETSC_DETERMINE));
  check(VecSetBlockSize(positions, 3));
  check(VecSetType(positions, VECSTANDARD));
  PetscScalar* values = nullptr;
  check(VecGetArray(positions, &values));
  for (std::size_t r = 0; r < coordinates.size(); ++r)
    for (int d = 0; d < 3; ++d) values[3 * r + d] = coordinates[r][d];
  check(VecRestoreArray(positions, &values));
  MatNullSpace rigid = nullptr;
  check(MatNullSpaceCreateRigidBody(positions, &rigid));
  check(MatSetNearNullSpace(matrix, rigid));
  check(MatNullSpaceDestroy(&rigid));
  check(VecDestroy(&positions));
}

void transpose(const double* from, double* to, std::int64_t rows, std::int64_t columns) {
  constexpr std::int64_t kTile = 16;  // reads and writes stay in cache
  for (std::int64_t r = 0; r < rows; r += kTile)
    for (std::int64_t c = 0; c < columns; c += kTile)
      for (std::int64_t j = c; j < std::min(c + kTile, columns); ++j)
        for (std::int64_t i = r; i < std::min(r + kTile, rows); ++i) to[j * rows + i] = from[i * columns + j];
}

}  // namespace palpate
