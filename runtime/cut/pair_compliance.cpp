#include "runtime/cut/pair_compliance.h"

#include "runtime/contact/node_compliance.h"

namespace palpate {

bool TensorPairs::read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
                       std::size_t stride) const {
  const std::int32_t column = column_of_node_[node];
  if (column < 0) return false;
  Mat3 self;  // of the column: its field is that of a unit displacement, or of a unit force
  self.m[0][0] = self.m[1][1] = self.m[2][2] = 1;
  if (tensors_.is_of_surface(column) &&
      !self_compliance(tensors_.stiffness + 9 * static_cast<std::size_t>(column), &self))
    return false;
  for (std::int32_t k = 0; k < count; ++k) {
    if (column_of_node_[others[k]] < 0) return false;
    const Mat3 c = tensors_.displacement(others[k], column) * self;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        rows[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(3 * k + j)] = c.m[j][i];
  }
  return true;
}

}  // namespace palpate
