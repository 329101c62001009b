#include "precompute/solver/solver_plan.h"

#include <fmt/format.h>
#include <sched.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "precompute/elements/column_buffer.h"
#include "precompute/solver/supernodal_factorisation.h"
#include "precompute/solver/supernodal_kernels.h"

namespace palpate {
namespace {

constexpr double kStartSeconds = 0.4;   // mpiexec and MPI_Init of a few ranks on one machine
constexpr double kShareReserve = 1.05;  // of what the ranks share: files of others, which lie beside it

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// How many numbers of the factor the forward substitution of a batch reads, mean over all batches: those of the supernodes
// from the loaded rows to the root of the elimination tree.
double forward_numbers(const Elimination& e, std::span<const std::int32_t> column_rows, int width) {
  const std::size_t supernodes = e.first.size() - 1;
  std::vector<std::int32_t> supernode_of(e.order.size()), places;
  std::vector<double> numbers(supernodes);
  for (std::size_t s = 0; s < supernodes; ++s) {
    std::fill(supernode_of.begin() + e.first[s], supernode_of.begin() + e.first[s + 1], static_cast<std::int32_t>(s));
    numbers[s] = static_cast<double>(
        supernode_numbers(e.first[s + 1] - e.first[s], e.row_begin[s + 1] - e.row_begin[s], e.block));
  }
  for (const auto row : column_rows) places.push_back(e.place[row]);
  std::sort(places.begin(), places.end());
  const std::size_t per_batch = std::max(1, width / 3);
  double sum = 0;
  std::size_t batches = 0;
  std::vector<char> touched(supernodes);
  for (std::size_t at = 0; at < places.size(); at += per_batch, ++batches) {
    std::fill(touched.begin(), touched.end(), 0);
    for (std::size_t i = at; i < std::min(at + per_batch, places.size()); ++i) touched[supernode_of[places[i]]] = 1;
    for (std::size_t s = 0; s < supernodes; ++s) {
      if (!touched[s]) continue;
      sum += numbers[s];
      if (e.row_begin[s] < e.row_begin[s + 1]) touched[supernode_of[e.rows[e.row_begin[s]]]] = 1;
    }
  }
  return batches > 0 ? sum / static_cast<double>(batches) : 0;
}

// What is counted on the mesh, for batches of `width` columns.
SolveSize size_of(const SolverPlan& plan, const PlanRequest& request, int width) {
  const Elimination& e = *plan.elimination;
  const FactoringNumbers at_once = factoring_numbers(e);
  SolveSize size;
  size.rows = static_cast<double>(plan.rows), size.blocks = static_cast<double>(plan.blocks);
  size.form_blocks = static_cast<double>(plan.form_blocks), size.columns = static_cast<double>(plan.columns);
  size.stored_rows = static_cast<double>(request.stored_rows), size.block = e.block;
  size.numbers = static_cast<double>(e.numbers()), size.flops = e.factor_flops();
  size.rectangles = static_cast<double>(at_once.rectangles), size.work = static_cast<double>(at_once.work);
  size.forward = forward_numbers(e, request.column_rows, width);
  size.flops_per_second = plan.flops_per_second;
  return size;
}

double seconds_of(const SolverEstimate& estimate, const SolverPlan& plan, int ranks, int here) {
  return seconds_of(estimate, static_cast<double>(plan.columns), ranks, here, plan.can_share(estimate, here));
}
double seconds_of(const SolverEstimate& estimate, const SolverPlan& plan) {
  return seconds_of(estimate, plan, plan.ranks, plan.ranks_here);
}

// Every rank reads the mesh, orders the rows and assembles K for itself; the columns are divided, and the factor where the ranks
// share it. So more ranks help as long as the columns take more time than the work that every rank repeats, and as long as all
// ranks fit into the memory.
int find_useful_ranks(const SolverPlan& plan, const PlanRequest& request) {
  const double memory = request.all_available_bytes + resident_bytes();
  const auto fit = [&](int ranks) {
    return ranks * (plan.bytes_of_rank(plan.chosen(), ranks) + resident_bytes()) <= memory;
  };
  int most = 1;
  while (most < request.cores && fit(most + 1)) ++most;
  double fastest = plan.seconds_with(1);
  for (int ranks = 2; ranks <= most; ++ranks) fastest = std::min(fastest, plan.seconds_with(ranks));
  int useful = 1;
  while (useful < most && plan.seconds_with(useful) > 1.1 * fastest) ++useful;
  return useful;
}

void choose(SolverPlan& plan, const PlanRequest& request) {
  const auto widest = static_cast<int>(std::clamp<std::int64_t>((plan.columns + 7) / 8 * 8, 8, 96));
  const int asked = request.columns_at_a_time;
  plan.size = size_of(plan, request, asked > 0 ? asked : widest);
  plan.factor = estimate_factor(plan.size, asked > 0 ? asked : widest, 8);
  plan.single_factor = estimate_factor(plan.size, asked > 0 ? asked : widest, 4);
  const auto each = [&](const SolverEstimate& estimate) { return plan.bytes_of_rank(estimate, plan.ranks_here); };
  if (asked == 0 && each(plan.single_factor) > plan.available_bytes)
    plan.single_factor = estimate_factor(size_of(plan, request, std::min(widest, 32)), std::min(widest, 32), 4);
  plan.multigrid = estimate_multigrid(plan.size, asked > 0 ? asked : std::min(widest, 32));
  plan.cholesky = each(plan.factor) <= plan.available_bytes;
  plan.shares_factor = plan.can_share(plan.factor, plan.ranks_here);
  if (plan.cholesky) {
    plan.why = fmt::format("the factor fits the {} available and is the fastest", bytes_text(plan.available_bytes));
    return;
  }
  plan.why = fmt::format("the factor needs {} of the {} available", bytes_text(each(plan.factor)),
                         bytes_text(plan.available_bytes));
  plan.single = each(plan.single_factor) <= plan.available_bytes;
  plan.cholesky = plan.single;
  plan.shares_factor = plan.single && plan.can_share(plan.single_factor, plan.ranks_here);
  plan.why += fmt::format("; {} in single precision", bytes_text(each(plan.single_factor)));
  if (plan.single) return;
  if (plan.multigrid.bytes > plan.available_bytes)
    plan.why += fmt::format("; multigrid needs {}, which is more as well: expect the machine to swap, or fail",
                            bytes_text(plan.multigrid.bytes));
}

}  // namespace

bool SolverPlan::can_share(const SolverEstimate& estimate, int here) const {
  return here > 1 && estimate.shared_bytes > 0 && kShareReserve * estimate.shared_bytes <= sharable_bytes;
}

double SolverPlan::bytes_of_rank(const SolverEstimate& estimate, int here) const {
  return estimate.bytes - (can_share(estimate, here) ? estimate.shared_bytes * (here - 1) / here : 0);
}

double SolverPlan::seconds() const {
  return seconds_of(chosen(), *this);
}

double SolverPlan::seconds_with(int with) const {
  const double sharing = slowdown_of(with), start = with > 1 ? kStartSeconds : 0;
  return start + sharing * (order_seconds + seconds_of(chosen(), *this, with, with));
}

// Measures the operations per second of the backward kernel on one supernode of 24 block columns with 72 block rows below and 96
// right-hand sides, the size in which a factor spends most of its time. Takes the fastest of several runs, because other work
// on the machine can only slow a run.
double kernel_rate(int block) {
  constexpr std::int32_t kColumns = 24, kBelow = 72;
  constexpr int kWidth = 96, kRuns = 8, kCalls = 40;
  const std::int64_t numbers = supernode_numbers(kColumns, kBelow, block);
  std::vector<double> values(static_cast<std::size_t>(numbers), 1e-3);
  std::vector<std::int32_t> rows(kBelow);
  for (std::int32_t i = 0; i < kBelow; ++i) rows[i] = kColumns + 2 * i;
  const std::int64_t dofs = block * (kColumns + 2 * kBelow);
  const ColumnBuffer y = make_column_buffer(dofs, kWidth);
  std::fill_n(y.get(), dofs * kWidth, 1.0);
  const Supernode<double> supernode{0, kColumns, kBelow, rows.data(), values.data()};
  const SupernodalKernels<double> kernels = supernodal_kernels<double>(block);
  double best = std::numeric_limits<double>::infinity();
  for (int run = 0; run < kRuns; ++run) {
    const double begun = processor_seconds();
    for (int call = 0; call < kCalls; ++call) kernels.backward(supernode, false, y.get(), kWidth);
    best = std::min(best, processor_seconds() - begun);
  }
  return 2.0 * static_cast<double>(numbers) * kWidth * kCalls / best;
}

int usable_cores() {
  cpu_set_t cores;
  return sched_getaffinity(0, sizeof cores, &cores) == 0 ? std::max(1, CPU_COUNT(&cores)) : 1;
}

SolverPlan make_plan(const PlanRequest& request) {
  SolverPlan plan;
  plan.available_bytes = request.available_bytes;
  plan.bundle_bytes = request.bundle_bytes;
  plan.rows = request.matrix.rows;
  plan.blocks = static_cast<std::int64_t>(request.matrix.column.size());
  plan.columns = 3 * static_cast<std::int64_t>(request.column_rows.size());
  plan.ranks = std::max(1, request.ranks);
  plan.ranks_here = std::max(1, request.ranks_here);
  plan.sharable_bytes = request.sharable_bytes;
  const double begun = processor_seconds();
  plan.form_blocks = request.form ? static_cast<std::int64_t>(request.form->column.size()) : 0;
  plan.elimination = std::make_shared<const Elimination>(request.form ? analyse_elimination(*request.form)
                                                                      : analyse_elimination(request.matrix));
  plan.order_seconds = processor_seconds() - begun;
  plan.flops_per_second = kernel_rate(plan.elimination->block);
  choose(plan, request);
  plan.useful_ranks = find_useful_ranks(plan, request);
  return plan;
}

std::string plan_text(const SolverPlan& plan) {
  if (plan.ranks_per_operator > 1)
    return fmt::format(
        "solver  {}, {} columns at a time\nwhy     {}\nmemory  {} more than now, each rank\nbundle  {}",
        plan.cholesky ? "PETSc CG with a Cholesky factor by MUMPS" : "PETSc CG with PETSc's multigrid (gamg)",
        plan.width(), plan.why, bytes_text(plan.chosen().bytes), bytes_text(plan.bundle_bytes));
  const SolverEstimate& other = plan.cholesky ? plan.multigrid : plan.factor;
  const char* other_name = plan.cholesky ? "multigrid" : "the factor";
  const char* precision = plan.single ? "single-precision " : "";
  const std::string each = plan.ranks > 1 ? fmt::format(", each of {} ranks", plan.ranks) : "";
  const std::string sharing =
      plan.shares_factor ? fmt::format(" (those of a machine share {} of them)", bytes_text(plan.chosen().shared_bytes))
                         : "";
  const std::string solver = plan.cholesky
                                 ? fmt::format("PETSc CG with a {}{} factor of {:.3g} million numbers, {:.3g} Gflop",
                                               precision, plan.form_blocks > 0 ? "quasi-definite" : "Cholesky",
                                               1e-6 * static_cast<double>(plan.elimination->numbers()),
                                               1e-9 * plan.elimination->factor_flops())
                                 : "PETSc CG with algebraic multigrid";
  return fmt::format(
      "solver  {}, {} columns at a time\n"
      "why     {}\n"
      "memory  {} more than now{}{}; with {} {}\n"
      "time    {}{}: set up {}, {} columns of {:.2g} ms; with {} {}\n"
      "ranks   {}; {} useful on this machine\n"
      "bundle  {}",
      solver, plan.width(), plan.why, bytes_text(plan.chosen().bytes), each, sharing, other_name,
      bytes_text(other.bytes), seconds_text(plan.seconds()), each, seconds_text(plan.chosen().setup_seconds),
      plan.columns, 1e3 * plan.chosen().column_seconds, other_name, seconds_text(seconds_of(other, plan)), plan.ranks,
      plan.useful_ranks, bytes_text(plan.bundle_bytes));
}

nlohmann::json plan_json(const SolverPlan& plan) {
  const auto estimate = [&](const SolverEstimate& e) {
    return nlohmann::json{{"bytes", e.bytes},
                          {"setup_seconds", e.setup_seconds},
                          {"column_seconds", e.column_seconds},
                          {"seconds", seconds_of(e, plan)}};
  };
  return {{"solver", !plan.cholesky ? "multigrid"
                     : plan.single  ? "supernodal_single"
                                    : "supernodal"},
          {"why", plan.why},
          {"columns_at_a_time", plan.width()},
          {"rows", plan.rows},
          {"blocks", plan.blocks},
          {"columns", plan.columns},
          {"ranks", plan.ranks},
          {"useful_ranks", plan.useful_ranks},
          {"shared_factor_bytes", plan.shares_factor ? plan.chosen().shared_bytes : 0},
          {"ranks_per_operator", plan.ranks_per_operator},
          {"factored", plan.form_blocks > 0 ? "pressure form" : "stiffness matrix"},
          {"factor_numbers", plan.elimination ? plan.elimination->numbers() : 0},
          {"factor_flops", plan.elimination ? plan.elimination->factor_flops() : 0},
          {"flops_per_second", plan.flops_per_second},
          {"available_bytes", plan.available_bytes},
          {"bytes", plan.chosen().bytes},
          {"seconds", plan.seconds()},
          {"bundle_bytes", plan.bundle_bytes},
          {"supernodal", estimate(plan.factor)},
          {"supernodal_single", estimate(plan.single_factor)},
          {"multigrid", estimate(plan.multigrid)}};
}

std::string outcome_text(const SolverPlan& plan, const PlanOutcome& outcome) {
  if (plan.ranks_per_operator > 1)
    return fmt::format("predicted / took: memory {} / {}, bundle {} / {}; took {}", bytes_text(plan.chosen().bytes),
                       bytes_text(outcome.bytes), bytes_text(plan.bundle_bytes), bytes_text(outcome.bundle_bytes),
                       seconds_text(outcome.seconds));
  return fmt::format("predicted / took: memory {} / {}, time {} / {}, bundle {} / {}", bytes_text(plan.chosen().bytes),
                     bytes_text(outcome.bytes), seconds_text(plan.seconds()), seconds_text(outcome.seconds),
                     bytes_text(plan.bundle_bytes), bytes_text(outcome.bundle_bytes));
}

nlohmann::json outcome_json(const SolverPlan& plan, const PlanOutcome& outcome) {
  const auto pair = [](double predicted, double took) {
    return nlohmann::json{{"predicted", predicted}, {"took", took}};
  };
  return {{"bytes", pair(plan.chosen().bytes, outcome.bytes)},
          {"seconds", pair(plan.seconds(), outcome.seconds)},
          {"bundle_bytes", pair(plan.bundle_bytes, outcome.bundle_bytes)}};
}

}  // namespace palpate
