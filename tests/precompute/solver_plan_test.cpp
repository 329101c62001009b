// The predictions of the plan against memory and choices of real solves.
#include "precompute/solver/solver_plan.h"

#include <nlohmann/json.hpp>

#include "precompute/solver/column_solver.h"
#include "precompute/solver/supernodal_factor.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

struct Case {
  BlockMatrix matrix;
  std::vector<std::int32_t> rows;  // of the columns

  explicit Case(int cells) {
    ElasticBody body = body_of(box_mesh({cells, cells, cells}, {1, 1, 1}, 0.2), {{5400, 0.45, 0}});
    hold(body, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
    HeldStiffness held = remove_held_dofs(assemble_stiffness(body), body.fixed);
    for (const auto n : body.touchable) rows.push_back(held.row_of_node[n]);
    matrix = std::move(held.matrix);
  }

  PlanRequest request(double available_bytes, int cores = 1) const {
    return {.matrix = matrix,
            .column_rows = rows,
            .stored_rows = matrix.rows,
            .available_bytes = available_bytes,
            .bundle_bytes = 1e6,
            .cores = cores};
  }
  SolverPlan plan(double available_bytes, int columns_at_a_time = 0, int ranks = 1) const {
    PlanRequest asked = request(available_bytes);
    asked.columns_at_a_time = columns_at_a_time, asked.ranks = ranks;
    return make_plan(asked);
  }
};

TEST(SolverPlan, TakesTheFactorInSinglePrecisionWhereOnlyThatFits) {
  const Case box(16);
  const SolverPlan roomy = box.plan(1e10);
  EXPECT_FALSE(roomy.single);
  EXPECT_LT(roomy.single_factor.setup_seconds, roomy.factor.setup_seconds);
  const SolverPlan less = box.plan(roomy.factor.bytes - 1);
  EXPECT_TRUE(less.cholesky);
  EXPECT_TRUE(less.single);
  EXPECT_EQ(less.chosen().bytes, less.single_factor.bytes);
  EXPECT_EQ(plan_json(less)["solver"], "supernodal_single");
  EXPECT_NE(plan_text(less).find("single-precision Cholesky factor"), std::string::npos) << plan_text(less);
  const SolverPlan least = box.plan(0.5 * less.single_factor.bytes);
  EXPECT_FALSE(least.cholesky);
  EXPECT_FALSE(least.single);
}

TEST(SolverPlan, TakesTheFactorWhereItFitsAndMultigridWhereItDoesNot) {
  const Case box(8);
  const SolverPlan roomy = box.plan(1e10), tight = box.plan(1e6);
  EXPECT_TRUE(roomy.cholesky);
  EXPECT_EQ(roomy.width(), 96);
  EXPECT_FALSE(tight.cholesky);
  EXPECT_EQ(tight.width(), 32);
  EXPECT_NE(tight.why.find("needs"), std::string::npos) << tight.why;
  EXPECT_EQ(roomy.factor.bytes, tight.factor.bytes);
  // The plan leaves the factor exactly where the memory falls below the factor's prediction.
  EXPECT_FALSE(box.plan(roomy.factor.bytes).single);
  const SolverPlan less = box.plan(roomy.factor.bytes - 1);
  EXPECT_TRUE(!less.cholesky || less.single);
}

TEST(SolverPlan, PredictsTheMemoryOfFactorAndBlockWithinATenthAndABit) {
  // A factor of 12 million numbers, 0.1 GB: large against what the allocator keeps in reserve. First in single precision, because the
  // peak does not fall.
  const Case box(20);
  const SolverPlan roomy = box.plan(1e11);
  for (const bool single : {true, false}) {
    const SolverPlan plan = single ? box.plan(roomy.factor.bytes - 1) : roomy;
    ASSERT_EQ(plan.single, single);
    const double before = resident_bytes();
    ColumnSolver solver(box.matrix, {}, {.width = plan.width(), .single = single, .elimination = plan.elimination});
    std::vector<double> x(static_cast<std::size_t>(solver.dofs()) * static_cast<std::size_t>(solver.width()));
    std::vector<ColumnReport> reports(static_cast<std::size_t>(solver.width()));
    solver.solve(std::vector<Load>{{3 * static_cast<std::int64_t>(box.rows[0]), 0, 1.0}}, x.data(), reports);
    const double grown = peak_resident_bytes() - before;
    // The prediction also holds the rows to be written. Other tests of this program may have left memory for reuse.
    EXPECT_LE(grown, 1.1 * plan.chosen().bytes + 20e6);
    if (!single) {
      EXPECT_GE(grown, 0.5 * plan.factor.bytes - 20e6);
    }
  }
}

TEST(SolverPlan, CountsThePressureFormWhereThatIsFactored) {
  ElasticBody body = body_of(box_mesh({16, 16, 16}, {1, 1, 1}, 0.2), {{5400, 0.49, 0}});
  hold(body, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
  HeldStiffness held = remove_held_dofs(assemble_stiffness(body, Element::p1_anp), body.fixed);
  PressureForm form = pressure_form(body, held);
  std::vector<std::int32_t> rows;
  for (const auto n : body.touchable) rows.push_back(held.row_of_node[n]);
  const SolverPlan plan = make_plan({.matrix = held.matrix,
                                     .column_rows = rows,
                                     .stored_rows = held.matrix.rows,
                                     .available_bytes = 1e11,
                                     .form = &form});
  EXPECT_EQ(plan.elimination->block, 4);
  EXPECT_EQ(plan.elimination->numbers(), analyse_elimination(form).numbers());
  EXPECT_EQ(plan_json(plan)["factored"], "pressure form");
  const auto elimination = put_in_order(held, *plan.elimination, &form);
  const double before = resident_bytes();
  PressureFactor factor(form, elimination, plan.width());
  const ColumnBuffer x = make_column_buffer(3 * static_cast<std::int64_t>(held.matrix.rows), plan.width());
  factor.apply_to_loads(std::vector<Load>{{7, 0, 1.0}}, x.get());
  // The rows to be written are in the prediction too; other tests may have left memory for reuse.
  EXPECT_LE(peak_resident_bytes() - before, 1.1 * plan.factor.bytes + 20e6);
  EXPECT_GE(plan.factor.bytes, 8.0 * static_cast<double>(plan.elimination->numbers()));
}

TEST(SolverPlan, DividesTheColumnsAmongTheRanksAndNotTheFactor) {
  const Case box(6);
  const SolverPlan one = box.plan(1e10), four = box.plan(1e10, 0, 4);
  EXPECT_EQ(one.factor.bytes, four.factor.bytes);
  const auto columns_of_one = [](const SolverPlan& plan) {
    return (plan.seconds() - plan.factor.setup_seconds) / plan.factor.column_seconds;
  };
  EXPECT_NEAR(columns_of_one(one), static_cast<double>(one.columns), 1e-6 * static_cast<double>(one.columns));
  EXPECT_NEAR(columns_of_one(four), std::ceil(static_cast<double>(four.columns) / 4), 1e-3);
}

TEST(SolverPlan, HoldsOneFactorAMachineWhereItsRanksCanShareIt) {
  const Case box(12);
  const auto plan = [&](double each_bytes, double sharable) {
    PlanRequest request = box.request(each_bytes, 2);
    request.all_available_bytes = 2 * each_bytes, request.ranks = request.ranks_here = 2;
    request.sharable_bytes = sharable;
    return make_plan(request);
  };
  const SolverPlan apart = plan(1e10, 0), shared = plan(1e10, 1e10);
  EXPECT_FALSE(apart.shares_factor);
  EXPECT_TRUE(shared.shares_factor);
  const double factor = shared.factor.shared_bytes;
  EXPECT_GE(factor, 8.0 * static_cast<double>(shared.elimination->numbers()));
  EXPECT_EQ(apart.bytes_of_rank(apart.factor, 2), apart.factor.bytes);
  EXPECT_EQ(shared.bytes_of_rank(shared.factor, 2), shared.factor.bytes - factor / 2);
  EXPECT_LT(shared.seconds(), apart.seconds());
  EXPECT_NE(plan_text(shared).find("share"), std::string::npos);
  EXPECT_EQ(plan_json(shared)["shared_factor_bytes"], factor);
  // Between what a rank takes with half of a factor and with a whole one, only sharing fits.
  const double between = shared.factor.bytes - factor / 4;
  EXPECT_TRUE(plan(between, 1e10).cholesky && !plan(between, 1e10).single);
  EXPECT_TRUE(!plan(between, 0).cholesky || plan(between, 0).single);
  EXPECT_FALSE(plan(1e10, 0.5 * factor).shares_factor);
}

// Ranks of one machine that cannot share a factor: each computes it for itself and needs its own memory.
TEST(SolverPlan, UsesMoreRanksOnlyWhereTheColumnsTakeLongerThanWhatEachRankRepeats) {
  const Case small(5), large(18);
  const auto planned = [](const Case& box, int cores, double all_bytes) {
    PlanRequest request = box.request(1e10, cores);
    request.all_available_bytes = all_bytes;
    return make_plan(request);
  };
  const auto useful = [&](const Case& box, int cores, double bytes) { return planned(box, cores, bytes).useful_ranks; };
  EXPECT_EQ(useful(small, 16, 1e11), 1);  // some hundredths of a second: starting ranks takes longer
  EXPECT_EQ(useful(large, 1, 1e11), 1);
  const int roomy = useful(large, 16, 1e11);
  EXPECT_GE(roomy, 2);
  EXPECT_LE(roomy, 16);
  EXPECT_EQ(useful(large, 2, 1e11), 2);
  // Physical memory for one of them alone, and for two.
  const SolverPlan one = planned(large, 16, 1e11);
  const double each = one.chosen().bytes + resident_bytes();
  EXPECT_EQ(useful(large, 16, 1.5 * one.chosen().bytes), 1);
  EXPECT_LE(useful(large, 16, 2.5 * each - resident_bytes()), 2);
}

TEST(SolverPlan, SaysTheSameInTextAndJson) {
  const SolverPlan plan = Case(5).plan(1e10, 24);
  const nlohmann::json json = plan_json(plan);
  EXPECT_EQ(json["solver"], "supernodal");
  EXPECT_EQ(json["columns_at_a_time"], 24);
  EXPECT_EQ(json["factor_numbers"], plan.elimination->numbers());
  EXPECT_EQ(json["bytes"], plan.factor.bytes);
  EXPECT_GT(json["seconds"], 0.0);
  const std::string text = plan_text(plan);
  for (const char* word : {"Cholesky", "24 columns", "memory", "time", "bundle", "multigrid"})
    EXPECT_NE(text.find(word), std::string::npos) << word << " in\n" << text;
  const nlohmann::json outcome = outcome_json(plan, {2.5, 3e8, 1e6});
  EXPECT_EQ(outcome["seconds"]["took"], 2.5);
  EXPECT_EQ(outcome["bytes"]["predicted"], plan.factor.bytes);
}

}  // namespace
}  // namespace palpate::tests
