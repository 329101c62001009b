#include "precompute/solver/cluster_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

// factor * n^exponent, fitted to `palpate-precompute --plan --json -` of the liver (docs/scaling.md). n: rows of K.
struct Law {
  double factor, exponent;
  double at(double n) const { return factor * std::pow(n, exponent); }
};
struct Laws {
  Law blocks, numbers, flops;
};
Laws laws_of(Element element) {
  switch (element) {
    case Element::p1:
      return {{9.81, 1.036}, {29.2, 1.420}, {106, 2.020}};
    case Element::p1_anp:  // numbers and operations of the pressure form's factor
      return {{32.0, 1.068}, {52.5, 1.420}, {238, 2.028}};
    case Element::p2_p0:
      break;
  }
  return {{18.9, 1.034}, {27.3, 1.438}, {57.2, 2.100}};
}
constexpr Law kFormBlocks = {9.81, 1.036};  // of first neighbours, as K of p1

constexpr double kForward = 0.2;  // of the factor's numbers, read by the forward substitution of a batch
constexpr double kRectangles = 1.2, kWork = 0.01;  // of the factor's numbers: SolveSize
constexpr int kFactorWidth = 96, kMultigridWidth = 32;
// Bytes that a rank holds beside its solver: the process, K and its pressure form, the mesh.
constexpr double kProcess = 6e7, kPerBlock = 80, kPerFormBlock = 136, kPerRow = 400;
constexpr double kMeshBytesPerRow = 300;  // of the MSH file
// Bytes of a bundle of --low-rank 1e-3: 40 MB with 3,961 surface nodes, 278 MB with 13,993.
constexpr Law kPacked = {120, 1.535};

ClusterEstimate on_machines(const char* name, const SolverEstimate& one, bool shares, const SolveSize& size,
                            const ClusterRequest& request) {
  const int here = std::min(request.ranks, request.ranks_per_machine);
  const double held = kProcess + kPerBlock * size.blocks + kPerFormBlock * size.form_blocks + kPerRow * size.rows;
  ClusterEstimate estimate;
  estimate.solver = name;
  estimate.machine_bytes = shares ? here * (one.own_bytes + held) + one.shared_bytes : here * (one.bytes + held);
  estimate.fits = estimate.machine_bytes <= request.machine_bytes;
  estimate.setup_seconds = seconds_of(one, 0, 1, here, shares) * slowdown_of(here);
  estimate.column_seconds = one.column_seconds * slowdown_of(here);
  estimate.seconds = seconds_of(one, size.columns, request.ranks, here, shares) * slowdown_of(here);
  return estimate;
}

}  // namespace

double surface_nodes_of(double vertices) {
  return 2.45 * std::pow(vertices, 0.75);
}

SolveSize size_of_vertices(double vertices, Element element, double touchable, double flops_per_second) {
  const Laws laws = laws_of(element);
  SolveSize size;
  // An edge for seven vertices inside, for fewer at the surface.
  size.rows = element == Element::p2_p0 ? 8 * vertices - 15 * std::pow(vertices, 2.0 / 3) : vertices;
  size.blocks = laws.blocks.at(size.rows), size.numbers = laws.numbers.at(size.rows),
  size.flops = laws.flops.at(size.rows);
  if (element == Element::p1_anp) size.form_blocks = kFormBlocks.at(size.rows), size.block = 4;
  size.forward = kForward * size.numbers, size.rectangles = kRectangles * size.numbers;
  size.work = kWork * size.numbers;
  size.stored_rows = surface_nodes_of(vertices);
  size.columns = 3 * (touchable > 0 ? touchable : size.stored_rows);
  size.flops_per_second = flops_per_second;
  return size;
}

ClusterPlan plan_cluster(const SolveSize& size, const ClusterRequest& request, double bundle_bytes) {
  ClusterPlan plan;
  plan.request = request, plan.size = size;
  plan.machines = (request.ranks + request.ranks_per_machine - 1) / request.ranks_per_machine;
  plan.bundle_bytes = bundle_bytes > 0 ? bundle_bytes : 12 * size.columns * size.stored_rows;
  plan.packed_bytes = kPacked.at(size.columns / 3);
  plan.network_bytes = kMeshBytesPerRow * size.rows * plan.machines + plan.bundle_bytes;
  const SolverEstimate factor = estimate_factor(size, kFactorWidth, 8),
                       single = estimate_factor(size, kMultigridWidth, 4);
  const bool shares = std::min(request.ranks, request.ranks_per_machine) > 1;
  plan.solvers = {on_machines("factor", factor, shares, size, request),
                  on_machines("factor in single precision", single, shares, size, request),
                  on_machines("multigrid", estimate_multigrid(size, kMultigridWidth), false, size, request)};
  for (std::size_t s = 0; s < plan.solvers.size(); ++s)
    if (plan.solvers[s].fits && (plan.chosen < 0 || plan.solvers[s].seconds < plan.solvers[plan.chosen].seconds))
      plan.chosen = static_cast<int>(s);
  return plan;
}

std::string cluster_text(const ClusterPlan& plan) {
  const auto plural = [](int count, const char* what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
  };
  std::string text = fmt::format(
      "on paper  {} on {} of {}: {:.0f} rows of K, a factor of {:.3g} million numbers and {:.3g} Gflop, {:.0f} "
      "columns\n",
      plural(plan.request.ranks, "rank"), plural(plan.machines, "machine"), bytes_text(plan.request.machine_bytes),
      plan.size.rows, 1e-6 * plan.size.numbers, 1e-9 * plan.size.flops, plan.size.columns);
  for (std::size_t s = 0; s < plan.solvers.size(); ++s) {
    const ClusterEstimate& e = plan.solvers[s];
    text += fmt::format("{} {:27} {:>8} a machine{:15} {:>7}: set up {}, a column {}\n",
                        static_cast<int>(s) == plan.chosen ? "->      " : "        ", e.solver,
                        bytes_text(e.machine_bytes), e.fits ? "," : ", does not fit,", seconds_text(e.seconds),
                        seconds_text(e.setup_seconds), seconds_text(e.column_seconds));
  }
  return text + fmt::format("bundle    {}; with --low-rank 1e-3 about {}; over the network {}",
                            bytes_text(plan.bundle_bytes), bytes_text(plan.packed_bytes),
                            bytes_text(plan.network_bytes));
}

nlohmann::json cluster_json(const ClusterPlan& plan) {
  nlohmann::json solvers = nlohmann::json::array();
  for (const ClusterEstimate& e : plan.solvers)
    solvers.push_back({{"solver", e.solver},
                       {"machine_bytes", e.machine_bytes},
                       {"fits", e.fits},
                       {"setup_seconds", e.setup_seconds},
                       {"column_seconds", e.column_seconds},
                       {"seconds", e.seconds}});
  return {{"ranks", plan.request.ranks},
          {"ranks_per_machine", plan.request.ranks_per_machine},
          {"machines", plan.machines},
          {"memory_per_machine", plan.request.machine_bytes},
          {"rows", plan.size.rows},
          {"columns", plan.size.columns},
          {"factor_numbers", plan.size.numbers},
          {"factor_flops", plan.size.flops},
          {"flops_per_second", plan.size.flops_per_second},
          {"bundle_bytes", plan.bundle_bytes},
          {"packed_bytes", plan.packed_bytes},
          {"network_bytes", plan.network_bytes},
          {"chosen", plan.chosen < 0 ? "none fits" : plan.solvers[static_cast<std::size_t>(plan.chosen)].solver},
          {"solvers", solvers}};
}

}  // namespace palpate
