#include "precompute/solver/petsc_matrix.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "formats/errors.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {

Mat create_petsc_matrix(const BlockMatrix& matrix, bool blocked) {
  // PETSc counts with 32 bits.
  constexpr auto most = std::numeric_limits<PetscInt>::max();
  if (static_cast<std::int64_t>(matrix.column.size()) > most / 9)
    throw OperationError(
        fmt::format("the stiffness matrix has {} numbers, more than the {} that this PETSc can count; a "
                    "coarser mesh is needed",
                    9 * matrix.column.size(), most));
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
  Vec places = nullptr;
  check(VecCreate(PetscObjectComm(reinterpret_cast<PetscObject>(matrix)), &places));
  check(VecSetSizes(places, static_cast<PetscInt>(3 * coordinates.size()), PETSC_DETERMINE));
  check(VecSetBlockSize(places, 3));
  check(VecSetType(places, VECSTANDARD));
  PetscScalar* values = nullptr;
  check(VecGetArray(places, &values));
  for (std::size_t r = 0; r < coordinates.size(); ++r)
    for (int d = 0; d < 3; ++d) values[3 * r + d] = coordinates[r][d];
  check(VecRestoreArray(places, &values));
  MatNullSpace rigid = nullptr;
  check(MatNullSpaceCreateRigidBody(places, &rigid));
  check(MatSetNearNullSpace(matrix, rigid));
  check(MatNullSpaceDestroy(&rigid));
  check(VecDestroy(&places));
}

void transpose(const double* from, double* to, std::int64_t rows, std::int64_t columns) {
  constexpr std::int64_t kTile = 16;  // reads and writes stay in cache
  for (std::int64_t r = 0; r < rows; r += kTile)
    for (std::int64_t c = 0; c < columns; c += kTile)
      for (std::int64_t j = c; j < std::min(c + kTile, columns); ++j)
        for (std::int64_t i = r; i < std::min(r + kTile, rows); ++i) to[j * rows + i] = from[i * columns + j];
}

}  // namespace palpate
