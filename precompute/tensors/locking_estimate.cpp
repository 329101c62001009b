#include "precompute/tensors/locking_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "formats/errors.h"
#include "precompute/elements/discretisation.h"
#include "precompute/solver/solver_plan.h"
#include "precompute/solver/supernodal_factor.h"

namespace palpate {
namespace {

constexpr int kWidth = 8;              // columns of a solve; x, y, z are used
constexpr double kBytesPerBlock = 76;  // of K
constexpr double kReferenceBlocksPerCell =
    33;  // of K under p2-p0, about; there are two while its rows are put in order

// Operations of p2-p0's factor over those of the element's own, rather less than on any mesh tried (livers of 200 to 5,000
// vertices, plate, cylinder: p1 44 to 77, p1-anp 8.7 to 11.4), so that a mesh far too large is not assembled to learn it.
double least_factor_ratio(Element element) {
  return element == Element::p1 ? 35 : 7;
}

using Patch = std::vector<std::int32_t>;

// The middles of equal shares of the touchable nodes, as they lie along the longest side; each with its neighbours.
std::vector<Patch> probe_patches(const ElasticBody& body, int probes) {
  std::vector<std::int32_t> sorted = body.touchable;
  std::array<double, 3> extent{};
  for (int d = 0; d < 3; ++d) {
    const auto [low, high] = std::minmax_element(sorted.begin(), sorted.end(),
                                                 [&](auto a, auto b) { return body.nodes[a][d] < body.nodes[b][d]; });
    extent[d] = body.nodes[*high][d] - body.nodes[*low][d];
  }
  const auto longest = std::max_element(extent.begin(), extent.end()) - extent.begin();
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](auto a, auto b) { return body.nodes[a][longest] < body.nodes[b][longest]; });
  std::vector<Patch> patches;
  const std::size_t count = std::min(sorted.size(), static_cast<std::size_t>(probes));
  for (std::size_t i = 0; i < count; ++i) patches.push_back({sorted[(2 * i + 1) * sorted.size() / (2 * count)]});
  for (auto& patch : patches) {
    const auto centre = patch[0];
    for (const auto& t : body.triangles)
      if (std::find(t.begin(), t.end(), centre) != t.end())
        for (const auto n : t)
          if (std::binary_search(body.touchable.begin(), body.touchable.end(), n)) patch.push_back(n);
    std::sort(patch.begin(), patch.end());
    patch.erase(std::unique(patch.begin(), patch.end()), patch.end());
  }
  return patches;
}

struct Assembled {
  Discretisation discretisation;
  HeldStiffness held;
};
Assembled assemble(const ElasticBody& body, Element element) {
  Assembled assembled{discretise(body, element), {}};
  assembled.held = eliminate_held(assembled.discretisation.stiffness, assembled.discretisation.fixed);
  assembled.discretisation.stiffness = {};
  return assembled;
}

SolverPlan plan_of(const Assembled& assembled) {
  return make_plan({assembled.held.matrix, {}, 0, kWidth, 0, 0, 1});
}

// A uniform load on the patch, one in sum, along each axis: its free dofs and the weights on them, by which the mean
// displacement is read as well.
std::vector<Load> patch_loads(const ElasticBody& body, const Assembled& assembled, const Patch& patch) {
  const Discretisation& d = assembled.discretisation;
  std::map<std::pair<std::int64_t, std::int32_t>, double> weights;
  const auto add = [&](std::int32_t vertex, std::int32_t node, double weight) {
    const auto row = assembled.held.row_of_node[node];
    for (std::int32_t j = 0; j < 3; ++j)
      if (!body.fixed[vertex][j] && !d.fixed[node][j])
        weights[{3 * static_cast<std::int64_t>(row) + j, j}] += weight / static_cast<double>(patch.size());
  };
  for (const auto v : patch) {
    if (d.touch.weight.empty()) {
      add(v, v, 1);
      continue;
    }
    for (auto at = d.touch.nodes.first[v]; at < d.touch.nodes.first[v + 1]; ++at)
      add(v, d.touch.nodes.item[at], d.touch.weight[at]);
  }
  std::vector<Load> loads;
  for (const auto& [place, weight] : weights) loads.push_back({place.first, place.second, weight});
  return loads;
}

// The trace of each patch's compliance, m/N. Puts the rows of assembled in order.
std::vector<double> compliances(const ElasticBody& body, Assembled& assembled, const Elimination& elimination,
                                const std::vector<Patch>& patches) {
  const auto in_order = put_in_order(assembled.held, elimination);
  SupernodalFactor factor(assembled.held.matrix, in_order, kWidth);
  const Block x = make_block(3 * static_cast<std::int64_t>(assembled.held.matrix.rows), kWidth);
  std::vector<double> result;
  for (const auto& patch : patches) {
    const auto loads = patch_loads(body, assembled, patch);
    factor.solve(loads, x.get());
    double trace = 0;
    for (const auto& load : loads) trace += load.value * x[load.dof * kWidth + load.column];
    result.push_back(trace);
  }
  return result;
}

struct TooMuch {
  double bytes = 0, operations = 0;
};

// Sets the bytes of estimate.
std::vector<double> reference_compliances(const ElasticBody& body, Element element, const LockingRequest& request,
                                          const std::vector<Patch>& patches, LockingEstimate& estimate) {
  const double least_bytes = 2 * kBytesPerBlock * kReferenceBlocksPerCell * static_cast<double>(body.tetrahedra.size());
  if (least_bytes > request.most_bytes) throw TooMuch{least_bytes, 0};
  const double least_operations = least_factor_ratio(element) * request.own_factor_operations;
  if (!request.at_any_cost && least_operations > request.most_operations) throw TooMuch{0, least_operations};
  Assembled assembled = assemble(body, Element::p2_p0);
  const SolverPlan plan = plan_of(assembled);
  estimate.bytes = plan.factor.bytes + kBytesPerBlock * static_cast<double>(plan.blocks);
  const double operations = plan.elimination->factor_flops();
  if (estimate.bytes > request.most_bytes || (!request.at_any_cost && operations > request.most_operations))
    throw TooMuch{estimate.bytes, operations};
  return compliances(body, assembled, *plan.elimination, patches);
}

LockingEstimate measure(const ElasticBody& body, Element element, const LockingRequest& request) {
  const auto patches = probe_patches(body, request.probes);
  LockingEstimate estimate;
  const auto reference = reference_compliances(body, element, request, patches, estimate);
  Assembled assembled = assemble(body, element);
  const auto own = compliances(body, assembled, *plan_of(assembled).elimination, patches);
  for (std::size_t i = 0; i < patches.size(); ++i)
    estimate.ratio += reference[i] / own[i] / static_cast<double>(patches.size());
  estimate.probes = static_cast<int>(patches.size());
  return estimate;
}

LockingEstimate not_measured(std::string why) {
  LockingEstimate estimate;
  estimate.note = std::move(why);
  return estimate;
}

std::string why_not(const TooMuch& needed, const LockingRequest& request) {
  if (needed.bytes > request.most_bytes)
    return fmt::format("the reference p2-p0 takes {:.2g} GB or more, {:.2g} GB are allowed it", 1e-9 * needed.bytes,
                       1e-9 * request.most_bytes);
  return fmt::format("the reference p2-p0 takes {:.2g} Gflop or more, {:.2g} are allowed it", 1e-9 * needed.operations,
                     1e-9 * request.most_operations);
}

}  // namespace

LockingEstimate estimate_locking(const ElasticBody& body, Element element, const LockingRequest& request) {
  if (request.probes <= 0) return not_measured("switched off by --locking-probes 0");
  if (element == Element::p2_p0) return not_measured("p2-p0 is the reference itself");
  try {
    return measure(body, element, request);
  } catch (const TooMuch& needed) {
    const std::string why = why_not(needed, request);
    if (request.at_any_cost)
      throw OperationError(
          fmt::format("--locking-probes {}: {}; leave the option out, or set --locking-probes 0", request.probes, why));
    return not_measured(fmt::format("{}; --locking-probes {} measures it all the same", why, request.probes));
  } catch (const OperationError& error) {
    // A mesh that the run's own element can do may be none for p2-p0 (ELEMENTS.md).
    return not_measured(fmt::format("the reference p2-p0 cannot be solved: {}", error.what()));
  }
}

double locking_bytes(double memory_gigabytes) {
  return memory_gigabytes > 0 ? 0.25e9 * memory_gigabytes : 2e9;
}

double locking_operations(double run_operations) {
  return std::max(5e10, 0.5 * run_operations);
}

}  // namespace palpate
