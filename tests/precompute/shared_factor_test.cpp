// One factor that the ranks of a machine compute and hold together, against the factor of one process. Runs under mpiexec: each
// rank runs every test.
#include <gtest/gtest.h>
#include <mpi.h>

#include <algorithm>
#include <iterator>

#include "formats/errors.h"
#include "precompute/solver/elimination.h"
#include "precompute/solver/machine_memory.h"
#include "precompute/solver/supernodal_factor.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

// 13^3 nodes: the topmost supernode has 500 columns or more, which all ranks factor together.
struct Body {
  ElasticBody body;
  HeldStiffness held;
  PressureForm form;

  Body() : body(body_of(box_mesh({12, 12, 12}, {1, 1, 1}, 0.2), {{1000, 0.45, 0}})) {
    hold(body, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
    held = remove_held_dofs(assemble_stiffness(body, Element::p1_anp), body.fixed);
    form = pressure_form(body, held);
  }
};

template <class Number, int kBlock>
void expect_the_same_bits(const BlockMatrixOf<kBlock>& matrix) {
  constexpr int kWidth = 8;
  const auto elimination = std::make_shared<const Elimination>(analyse_elimination(matrix));
  const auto dofs = static_cast<std::size_t>(3 * matrix.rows);
  std::vector<double> b(dofs * kWidth), alone(dofs * kWidth), together(dofs * kWidth);
  for (std::size_t i = 0; i < b.size(); ++i) b[i] = static_cast<double>(i * 7919 % 1009) / 1009 - 0.5;
  SupernodalFactorOf<Number, kBlock> own(matrix, elimination, kWidth);
  own.apply(b.data(), alone.data());
  SupernodalFactorOf<Number, kBlock> shared(matrix, elimination, kWidth, {},
                                            std::make_shared<MachineMemory>(MPI_COMM_WORLD));
  shared.apply(b.data(), together.data());
  EXPECT_EQ(alone, together);
  EXPECT_EQ(own.reciprocal_condition(), shared.reciprocal_condition());
}

TEST(SharedFactor, HasTheBitsOfAFactorThatOneProcessComputes) {
  const Body box;
  expect_the_same_bits<double, 4>(box.form);
  expect_the_same_bits<float, 4>(box.form);
  expect_the_same_bits<double, 3>(box.held.matrix);
}

// A wrong pivot in a subtree, which one rank finds, and one in the supernode that all ranks factor: every rank throws the same.
TEST(SharedFactor, NamesTheSameNodeOnEveryRankWhereTheFactorisationFails) {
  const Body box;
  const auto elimination = std::make_shared<const Elimination>(analyse_elimination(box.held.matrix));
  for (const std::int32_t place : {std::int32_t{3}, box.held.matrix.rows - 2}) {
    const std::int32_t bad = elimination->order[place];
    BlockMatrix matrix = box.held.matrix;
    for (auto at = matrix.first[bad]; at < matrix.first[bad + 1]; ++at)
      if (matrix.column[at] == bad) matrix.block[at][0] = -1e9;
    const auto refusal = [&](std::shared_ptr<MachineMemory> machine) -> std::string {
      try {
        SupernodalFactor(matrix, elimination, 8, {}, std::move(machine));
      } catch (const OperationError& error) {
        return error.what();
      }
      return "no error";
    };
    const std::string alone = refusal(nullptr);
    EXPECT_NE(alone.find("fails at block row"), std::string::npos) << alone;
    EXPECT_EQ(refusal(std::make_shared<MachineMemory>(MPI_COMM_WORLD)), alone);
  }
}

TEST(SharedFactor, RanksSeeWhatAnotherRankWroteAndLoseWhatIsGivenBack) {
  MachineMemory machine(MPI_COMM_WORLD);
  constexpr std::int64_t kNumbers = 1 << 20;
  machine.allocate(kNumbers * static_cast<std::int64_t>(sizeof(double)));
  auto* numbers = static_cast<double*>(machine.data());
  if (machine.rank() == machine.count() - 1)
    for (std::int64_t i = 0; i < kNumbers; ++i) numbers[i] = static_cast<double>(i);
  machine.meet();
  EXPECT_EQ(numbers[kNumbers - 1], kNumbers - 1.0);
  EXPECT_EQ(machine.least(machine.rank() + 5), 5);
  EXPECT_EQ(machine.first(machine.rank() + 0.5), 0.5);
  machine.shrink(1 << 16);
  EXPECT_EQ(numbers[100], 100.0);
  EXPECT_EQ(numbers[kNumbers / 2], 0.0);  // the page went back to the system
}

TEST(SharedFactor, RanksStopWaitingWhereOneOfThemHasFailed) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MachineMemory machine(MPI_COMM_WORLD, [] { return true; });
  if (rank > 0) {
    EXPECT_THROW(machine.meet(), OperationError);
    EXPECT_THROW(machine.meet(), OperationError);  // it cannot come back to what the others still wait for
  }
  MPI_Barrier(MPI_COMM_WORLD);
}

// Covers the stack below the caller while MPI works, and tells whether MPI wrote there.
[[gnu::noinline]] bool stack_stays_as_it_is() {
  volatile unsigned char below[1 << 13];
  for (auto& byte : below) byte = 0x5a;
  MPI_Barrier(MPI_COMM_WORLD);
  return std::all_of(std::begin(below), std::end(below), [](unsigned char byte) { return byte == 0x5a; });
}

TEST(SharedFactor, WritesNoResultIntoTheFrameOfARankThatStoppedWaiting) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MachineMemory machine(MPI_COMM_WORLD, [&] { return rank > 0; });
  if (rank > 0) {
    EXPECT_THROW(machine.least(rank), OperationError);
    MPI_Barrier(MPI_COMM_WORLD);
    EXPECT_TRUE(stack_stays_as_it_is());
  } else {
    MPI_Barrier(MPI_COMM_WORLD);
    EXPECT_EQ(machine.least(0), 0);  // the other ranks' parts came before they stopped waiting
    MPI_Barrier(MPI_COMM_WORLD);
  }
}

}  // namespace
}  // namespace palpate::tests

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  ::testing::InitGoogleTest(&argc, argv);
  const int failed = RUN_ALL_TESTS();
  MPI_Finalize();
  return failed;
}
