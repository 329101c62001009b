// The factor whose rows come and go, compared with a new factor; and the contact solver's cost as contacts come and go.
#include "runtime/dense/updated_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numeric>
#include <random>
#include <vector>

#include "runtime/dense/dense_panels.h"

namespace palpate::tests {
namespace {

class Factor : public testing::Test {
 protected:
  static constexpr int kCapacity = 120;
  Factor() : memory_(palpate_allocator{}) { factor_.create(memory_, kCapacity); }
  ~Factor() override { memory_.release_all(); }

  // A positive definite matrix whose entries fall with distance, as compliances do.
  static Eigen::MatrixXd matrix(int size) {
    Eigen::MatrixXd a(size, size);
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j) a(i, j) = 1 / (1 + 0.3 * std::abs(std::sin(1.0 * i) - std::sin(1.0 * j)) * 9);
    a.diagonal().array() += 0.05;
    return a;
  }
  void append(const Eigen::MatrixXd& a, const std::vector<int>& rows) {
    held_.insert(held_.end(), rows.begin(), rows.end());
    write_coming(factor_, a, held_);
    std::vector<double> raised(rows.size());
    ASSERT_TRUE(factor_.append(static_cast<std::int32_t>(rows.size()), 1e-9, raised.data()));
    for (const double r : raised) EXPECT_EQ(r, 0);
  }
  static void write_coming(UpdatedCholesky& factor, const Eigen::MatrixXd& a, const std::vector<int>& held) {
    for (std::int32_t at = 0; at < static_cast<std::int32_t>(held.size()); ++at)
      for (std::int32_t q = std::max(at, factor.size()); q < static_cast<std::int32_t>(held.size()); ++q)
        factor.coming(at)[q - factor.size()] = a(held[at], held[q]);
  }
  void remove(const std::vector<std::int32_t>& positions) {
    factor_.remove(static_cast<int>(positions.size()), positions.data());
    for (auto at = positions.rbegin(); at != positions.rend(); ++at) held_.erase(held_.begin() + *at);
  }
  void expect_solves(const Eigen::MatrixXd& a) {
    ASSERT_EQ(factor_.size(), static_cast<std::int32_t>(held_.size()));
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(held_.size()), -1, 2);
    const Eigen::VectorXd right = x, expected = Eigen::MatrixXd(a(held_, held_)).llt().solve(right);
    factor_.solve(x.data());
    EXPECT_LE((x - expected).norm(), 1e-11 * expected.norm());  // rounding times a condition of about 1e3
  }

  SceneMemory memory_;
  UpdatedCholesky factor_;
  std::vector<int> held_;
};

TEST_F(Factor, OfRowsThatComeAndGoIsThatOfTheRowsThatAreThere) {
  const Eigen::MatrixXd a = matrix(kCapacity);
  append(a, {3, 50, 7, 90, 21});
  expect_solves(a);
  remove({0});
  expect_solves(a);
  append(a, {1, 2});
  remove({1, 2, 5});
  expect_solves(a);
  remove({0, 1, 2});
  expect_solves(a);  // none is left
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    std::vector<int> free;
    for (int row = 0; row < kCapacity; ++row)
      if (std::find(held_.begin(), held_.end(), row) == held_.end()) free.push_back(row);
    std::shuffle(free.begin(), free.end(), random);
    free.resize(std::min<std::size_t>(free.size(), random() % (UpdatedCholesky::kBatch + 1)));
    if (!free.empty()) append(a, free);
    std::vector<std::int32_t> leaving;
    for (std::int32_t at = 0; at < factor_.size(); ++at)
      if (random() % 6 == 0) leaving.push_back(at);
    remove(leaving);
    expect_solves(a);
  }
}

// Each entry is the same sum in the same order, however many rows are added together.
TEST_F(Factor, IsTheSameToTheBitWhetherRowsComeOneByOneOrTogether) {
  const Eigen::MatrixXd a = matrix(kCapacity);
  std::vector<int> all(101);
  std::iota(all.begin(), all.end(), 0);
  append(a, all);
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(101, -1, 2);
  Eigen::VectorXd together = right;
  factor_.solve(together.data());
  for (const int step : {1, 3, 8, 17, 50}) {
    factor_.clear();
    held_.clear();
    for (int first = 0; first < 101; first += step)
      append(a, {all.begin() + first, all.begin() + std::min(101, first + step)});
    Eigen::VectorXd x = right;
    factor_.solve(x.data());
    EXPECT_EQ(x, together) << step;
  }
}

TEST(EliminateRows, GivesTheSameBitsWithAllInstructionsAndAnyBlocks) {
  constexpr int kRows = 61, kStride = 96;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<double> start(kRows * kStride);
  for (double& x : start) x = any(random);
  for (int r = 0; r < kRows; ++r) start[r * kStride + r] = 2 + any(random);
  // The definition, entry by entry: rows 0 .. 60 of the columns 61 .. 79 become final.
  std::vector<double> expected = start;
  for (int i = 0; i < kRows; ++i)
    for (int j = kRows; j < 80; ++j) {
      double& x = expected[i * kStride + j];
      for (int k = 0; k < i; ++k) {
        const volatile double product = expected[k * kStride + i] * expected[k * kStride + j];
        x -= product;
      }
      x *= 1 / expected[i * kStride + i];
    }
  for (int set = 0; set <= static_cast<int>(best_instructions()); ++set)
    for (const int rows : {1, 3, kPanelRows})
      for (const int width : {1, 5, 19}) {
        std::vector<double> u = start;
        for (int begin = kRows; begin < 80; begin += width)
          for (int first = 0; first < kRows; first += rows) {
            // The columns after the last one must be unchanged for the next call.
            std::vector<double> kept = u;
            const int end = std::min(80, begin + width), count = std::min(rows, kRows - first);
            eliminate_rows(static_cast<Instructions>(set), u.data(), kStride, first, count, begin, end, true);
            for (int i = 0; i < kRows; ++i)
              for (int j = end; j < kStride; ++j) {
                if (j >= end + 16) {
                  EXPECT_EQ(u[i * kStride + j], kept[i * kStride + j]);
                }
                u[i * kStride + j] = kept[i * kStride + j];
              }
          }
        for (int i = 0; i < kRows; ++i)
          for (int j = kRows; j < 80; ++j)
            ASSERT_EQ(u[i * kStride + j], expected[i * kStride + j]) << set << " " << rows << " " << width;
      }
}

TEST_F(Factor, RaisesAPivotThatWouldVanishAndSaysByHowMuch) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Ones(3, 3);
  double raised[2] = {};
  write_coming(factor_, a, {0});
  ASSERT_TRUE(factor_.append(1, 1e-6, raised));
  write_coming(factor_, a, {0, 1});
  ASSERT_TRUE(factor_.append(1, 1e-6, raised));
  EXPECT_NEAR(raised[0], 1e-6, 1e-15);
  double x[] = {1, 1};  // [1 1; 1 1 + 1e-6] x = [1, 1]
  factor_.solve(x);
  EXPECT_NEAR(x[0], 1, 1e-9);
  EXPECT_NEAR(x[1], 0, 1e-9);
  a(0, 2) = a(2, 0) = NAN;
  write_coming(factor_, a, {0, 1, 2});
  EXPECT_FALSE(factor_.append(1, 1e-6, raised));
  EXPECT_EQ(factor_.size(), 2);
}

}  // namespace
}  // namespace palpate::tests
