// Factors of a dense K: they solve, give the same bits twice, and take a batch as its nonzeros.
#pragma once

#include <limits>
#include <random>
#include <vector>

#include "precompute/solver/batch_product.h"
#include "tests/precompute/support.h"

namespace palpate::tests {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline RowMajor random_block(Eigen::Index rows, int width, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> some(-1, 1);
  RowMajor b(rows, width);
  for (Eigen::Index i = 0; i < b.size(); ++i) b.data()[i] = some(generator);
  return b;
}

// || K x - b || divided by the residual of a backward stable solve: a small multiple of the rounding error, which grows with the
// number of rows.
inline double backward_error(const Eigen::MatrixXd& k, const RowMajor& x, const RowMajor& b) {
  return (k * x - b).norm() / (k.norm() * x.norm() + b.norm());
}
constexpr double kRounding = 1e-14;  // 45 epsilon; sums of a few hundred terms stay below 10

// Some unit forces and their columns.
struct UnitForces {
  std::vector<Load> loads;
  RowMajor batch, columns;
};

template <class Factor>
UnitForces expect_factor_solves(Factor& factor, const Eigen::MatrixXd& k, int width) {
  const RowMajor b = random_block(k.rows(), width, 7);
  RowMajor x(b.rows(), width), again(b.rows(), width);
  factor.apply(b.data(), x.data());
  EXPECT_LE(backward_error(k, x, b), kRounding) << k.rows() << " rows, width " << width;
  factor.apply(b.data(), again.data());
  EXPECT_EQ(x, again);

  // Given by their nonzeros they must lead to the same bits as given as a dense batch.
  UnitForces unit = {{}, RowMajor::Zero(b.rows(), width), RowMajor(b.rows(), width)};
  for (int c = 0; c < width; ++c) unit.batch((17 * c) % b.rows(), c) = 1;
  for (Eigen::Index i = 0; i < b.rows(); ++i)
    for (int c = 0; c < width; ++c)
      if (unit.batch(i, c) != 0) unit.loads.push_back({i, c, 1.0});
  factor.apply(unit.batch.data(), unit.columns.data());
  EXPECT_LE(backward_error(k, unit.columns, unit.batch), kRounding);
  again.setConstant(std::numeric_limits<double>::quiet_NaN());  // what it held before must not matter
  EXPECT_TRUE(factor.apply_to_loads(unit.loads, again.data()));
  EXPECT_EQ(unit.columns, again);
  return unit;
}

}  // namespace palpate::tests
