// The dense loops of the factorisation against Eigen, and with each instruction set that the processor has.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstring>
#include <vector>

#include "runtime/large/factor_panels.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;

std::vector<Instructions> all_instructions() {
  std::vector<Instructions> all = {Instructions::baseline};
  if (best_instructions() != Instructions::baseline) all.push_back(Instructions::avx2);
  if (best_instructions() == Instructions::avx512) all.push_back(Instructions::avx512);
  return all;
}

// A panel of `rows` rows in columns of `stride` numbers, and what a product may read behind it.
struct Panel {
  Panel(const MatrixXd& from, int wanted_stride) : rows(from.rows()), columns(from.cols()), stride(wanted_stride) {
    numbers.assign(static_cast<std::size_t>(stride * columns + kPanelMargin), 1e300);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index r = 0; r < rows; ++r) at(r, c) = from(r, c);
  }
  double& at(Eigen::Index row, Eigen::Index column) { return numbers[static_cast<std::size_t>(column * stride + row)]; }
  MatrixXd matrix() {
    MatrixXd out(rows, columns);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index r = 0; r < rows; ++r) out(r, c) = at(r, c);
    return out;
  }
  double* data() { return numbers.data(); }
  Eigen::Index rows, columns;
  int stride;
  std::vector<double> numbers;
};

MatrixXd random_matrix(int rows, int columns, unsigned seed) {
  std::srand(seed);
  return MatrixXd::Random(rows, columns);
}

// The upper rows of a positive definite matrix's factor and rows below it.
MatrixXd panel_to_factorise(int rows, int columns) {
  const MatrixXd all = random_matrix(rows, columns, 3);
  MatrixXd panel = all;
  panel.topRows(columns) = all.topRows(columns) * all.topRows(columns).transpose() +
                           MatrixXd::Identity(columns, columns) * static_cast<double>(columns);
  return panel;
}

// Sizes below, at and between those of tiles and blocks.
const std::vector<std::pair<int, int>> kSizes = {{3, 3},   {6, 6},    {17, 9},  {48, 48},  {51, 48},
                                                 {54, 51}, {96, 93},  {100, 7}, {131, 97}, {150, 150},
                                                 {33, 1},  {200, 99}, {64, 12}};

TEST(FactorPanels, SubtractTheProductOfTwoPanels) {
  for (const auto& [m, n] : kSizes)
    for (const int k : {0, 1, 3, 50}) {
      const MatrixXd a = random_matrix(m, std::max(k, 1), 1), b = random_matrix(n, std::max(k, 1), 2),
                     c = random_matrix(m, n, 4);
      const MatrixXd expected = k > 0 ? MatrixXd(c - a * b.transpose()) : c;
      for (const auto instructions : all_instructions()) {
        Panel left(a, m + 5), right(b, n), out(c, m + 3);
        subtract_product(instructions, m, n, k, left.data(), left.stride, right.data(), right.stride, out.data(),
                         out.stride);
        // 50 terms of at most 1, each with a rounding of 1.1e-16, in two orders.
        EXPECT_LE((out.matrix() - expected).cwiseAbs().maxCoeff(), 2e-14) << m << " " << n << " " << k;
        Panel fresh(c, m + 3), cleared(MatrixXd::Zero(m, n), m + 3);
        negative_product(instructions, m, n, k, left.data(), left.stride, right.data(), right.stride, fresh.data(),
                         fresh.stride);
        subtract_product(instructions, m, n, k, left.data(), left.stride, right.data(), right.stride, cleared.data(),
                         cleared.stride);
        EXPECT_EQ(0, std::memcmp(fresh.data(), cleared.data(), sizeof(double) * fresh.numbers.size()));
        for (int column = 0; column < n; ++column)
          for (int row = m; row < m + 3; ++row) EXPECT_EQ(out.at(row, column), 1e300) << "written behind the panel";
      }
    }
}

TEST(FactorPanels, FactoriseAndInvertPanelsOfAnySize) {
  for (const auto& [rows, columns] : kSizes)
    for (const auto instructions : all_instructions()) {
      const MatrixXd panel = panel_to_factorise(rows, columns);
      Panel out(panel, rows + 2);
      ASSERT_TRUE(factorise_panel(instructions, rows, columns, out.data(), out.stride));
      const MatrixXd square = out.matrix().topRows(columns).triangularView<Eigen::Lower>(),
                     below = out.matrix().bottomRows(rows - columns);
      // Pivots between columns and a few times that: 150 roundings of 1.1e-16 of entries below 300.
      EXPECT_LE((square * square.transpose() - panel.topRows(columns)).cwiseAbs().maxCoeff(), 1e-11);
      if (rows > columns) {
        EXPECT_LE((below * square.transpose() - panel.bottomRows(rows - columns)).cwiseAbs().maxCoeff(), 1e-11);
      }
      std::vector<double> scratch(inverse_scratch(columns));
      invert_triangle(instructions, columns, out.data(), out.stride, scratch.data());
      EXPECT_LE((out.matrix().topRows(columns) * square - MatrixXd::Identity(columns, columns)).cwiseAbs().maxCoeff(),
                1e-12)
          << rows << " " << columns;
      EXPECT_EQ((out.matrix().bottomRows(rows - columns) - below).cwiseAbs().sum(), 0);
    }
}

TEST(FactorPanels, GiveTheSameBitsWithAnyInstructions) {
  for (const auto& [rows, columns] : kSizes) {
    std::vector<double> first;
    for (const auto instructions : all_instructions()) {
      Panel out(panel_to_factorise(rows, columns), rows + 2);
      ASSERT_TRUE(factorise_panel(instructions, rows, columns, out.data(), out.stride));
      std::vector<double> scratch(inverse_scratch(columns));
      invert_triangle(instructions, columns, out.data(), out.stride, scratch.data());
      if (first.empty()) first = out.numbers;
      EXPECT_EQ(0, std::memcmp(first.data(), out.numbers.data(), sizeof(double) * first.size()))
          << rows << " " << columns;
    }
  }
}

TEST(FactorPanels, RefuseAPivotThatIsNotPositive) {
  for (const int bad : {0, 5, 49, 96}) {
    MatrixXd panel = panel_to_factorise(120, 97);
    panel(bad, bad) = -1;
    Panel out(panel, 120);
    EXPECT_FALSE(factorise_panel(best_instructions(), 120, 97, out.data(), out.stride)) << bad;
  }
}

}  // namespace
}  // namespace palpate::tests
