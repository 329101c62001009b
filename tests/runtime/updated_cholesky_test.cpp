// The factor whose rows come and go, against one made anew; and the contact solver's cost as contacts come and go.
#include "runtime/updated_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <vector>

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
    std::vector<std::vector<double>> lines;
    std::vector<double*> entries;
    for (const int row : rows) {
      held_.push_back(row);
      lines.emplace_back(kCapacity);
      for (std::size_t at = 0; at < held_.size(); ++at) lines.back()[at] = a(row, held_[at]);
    }
    for (auto& line : lines) entries.push_back(line.data());
    std::vector<double> raised(rows.size());
    ASSERT_TRUE(factor_.append(static_cast<int>(rows.size()), entries.data(), 1e-9, raised.data()));
    for (const double r : raised) EXPECT_EQ(r, 0);
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

TEST_F(Factor, RaisesAPivotThatWouldVanishAndSaysByHowMuch) {
  double first[] = {1}, twin[] = {1, 1};
  double *one = first, *two = twin, raised = 0;
  ASSERT_TRUE(factor_.append(1, &one, 1e-6, &raised));
  ASSERT_TRUE(factor_.append(1, &two, 1e-6, &raised));
  EXPECT_NEAR(raised, 1e-6, 1e-15);
  double x[] = {1, 1};  // [1 1; 1 1 + 1e-6] x = [1, 1]
  factor_.solve(x);
  EXPECT_NEAR(x[0], 1, 1e-9);
  EXPECT_NEAR(x[1], 0, 1e-9);
  double wrong[] = {NAN, 0, 1}, *bad = wrong;
  EXPECT_FALSE(factor_.append(1, &bad, 1e-6, &raised));
  EXPECT_EQ(factor_.size(), 2);
}

}  // namespace
}  // namespace palpate::tests
