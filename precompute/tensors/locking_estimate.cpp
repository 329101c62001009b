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

constexpr int kWidth = 8;              // columns of one solve, of which three are used: x, y and z
constexpr double kBytesPerBlock = 76;  // of K
// Blocks of K under p2-p0 over tetrahedra, about. K exists twice while its rows are put in order.
constexpr double kReferenceBlocksPerCell = 33;

struct TooLarge : OperationError {
  using OperationError::OperationError;
};

using Patch = std::vector<std::int32_t>;

// Sorts the touchable nodes along the longest side of the body, cuts the list into equal shares and takes the middle
// node of each share with its touchable neighbours.
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
  assembled.held = remove_held_dofs(assembled.discretisation.stiffness, assembled.discretisation.fixed);
  assembled.discretisation.stiffness = {};
  return assembled;
}

SolverPlan plan_of(const Assembled& assembled) {
  return make_plan({.matrix = assembled.held.matrix, .column_rows = {}, .columns_at_a_time = kWidth});
}

// A uniform load of 1 N on the patch along x, y and z, one column each. The same weights give the mean displacement of
// the patch.
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
  for (const auto& [at, weight] : weights) loads.push_back({at.first, at.second, weight});
  return loads;
}

// The trace of the compliance of each patch, m/N. Renumbers the rows of assembled into elimination order.
std::vector<double> compliances(const ElasticBody& body, Assembled& assembled, const Elimination& elimination,
                                const std::vector<Patch>& patches) {
  const auto in_order = put_in_order(assembled.held, elimination);
  SupernodalFactor factor(assembled.held.matrix, in_order, kWidth);
  const ColumnBuffer x = make_column_buffer(3 * static_cast<std::int64_t>(assembled.held.matrix.rows), kWidth);
  std::vector<double> result;
  for (const auto& patch : patches) {
    const auto loads = patch_loads(body, assembled, patch);
    factor.apply_to_loads(loads, x.get());
    double trace = 0;
    for (const auto& load : loads) trace += load.value * x[load.dof * kWidth + load.column];
    result.push_back(trace);
  }
  return result;
}

// Sets estimate.bytes. Errors: OperationError where the factor would take more than most_bytes.
std::vector<double> reference_compliances(const ElasticBody& body, const std::vector<Patch>& patches, double most_bytes,
                                          LockingEstimate& estimate) {
  const auto check = [&](double bytes) {
    if (bytes > most_bytes)
      throw TooLarge(
          fmt::format("--locking-probes: the reference p2-p0 takes {:.2g} GB or more, {:.2g} GB are free; "
                      "leave the option out, or use a machine with more memory",
                      1e-9 * bytes, 1e-9 * most_bytes));
  };
  // First a lower bound from the number of tetrahedra, so that a mesh that is far too large is not assembled to learn
  // it.
  check(2 * kBytesPerBlock * kReferenceBlocksPerCell * static_cast<double>(body.tetrahedra.size()));
  Assembled assembled = assemble(body, Element::p2_p0);
  const SolverPlan plan = plan_of(assembled);
  estimate.bytes = plan.factor.bytes + kBytesPerBlock * static_cast<double>(plan.blocks);
  check(estimate.bytes);
  return compliances(body, assembled, *plan.elimination, patches);
}

LockingEstimate measure(const ElasticBody& body, Element element, int probes, double most_bytes) {
  const auto patches = probe_patches(body, probes);
  LockingEstimate estimate;
  const auto reference = reference_compliances(body, patches, most_bytes, estimate);
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

}  // namespace

LockingEstimate estimate_locking(const ElasticBody& body, Element element, int probes, double most_bytes) {
  if (element == Element::p2_p0) return not_measured("p2-p0 is the reference itself");
  try {
    return measure(body, element, probes, most_bytes);
  } catch (const TooLarge&) {
    throw;
  } catch (const OperationError& error) {
    // There are meshes that the run's own element can solve and p2-p0 cannot (ELEMENTS.md, limits).
    return not_measured(fmt::format("the reference p2-p0 cannot be solved: {}", error.what()));
  }
}

LockingEstimate locking_not_asked_for() {
  return not_measured("not asked for; --locking-probes 3 measures it");
}

}  // namespace palpate
