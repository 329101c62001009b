// The laws of the compliance between the nodes of a cut's region, and what it has in common with the other columns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "precompute/bundle_tool/bundle_checks.h"

namespace palpate {

using namespace formats;

namespace {

struct CutRegionCheck {
  CutRegionCheck(const BundleFile& bundle, const SmallSections& s)
      : file(bundle),
        small(s),
        nodes(bundle.numbers<std::int32_t>(SectionId::cut_nodes)),
        residual(bundle.numbers<double>(SectionId::cut_residual)),
        corridor(bundle.numbers<std::int32_t>(SectionId::corridor_nodes)),
        corridor_compliance(bundle.numbers<float>(SectionId::corridor_compliance)) {
    for (const std::int32_t node : nodes) place_in_corridor.push_back(place(corridor, node));
  }

  static std::ptrdiff_t place(const std::vector<std::int32_t>& list, std::int32_t node) {
    const auto at = std::ranges::lower_bound(list, node);
    return at != list.end() && *at == node ? at - list.begin() : -1;
  }
  // [a + 1][3][3]: the blocks of the a-th node and those up to it.
  std::vector<double> row(std::size_t a) const {
    std::vector<double> blocks(9 * (a + 1));
    file.read(*file.find(SectionId::cut_compliance), 9 * (a * (a + 1) / 2) * sizeof(double), blocks.data(),
              blocks.size() * sizeof(double));
    return blocks;
  }
  bool is_held(std::size_t a, std::size_t dof) const {
    return small.fixed[3 * static_cast<std::size_t>(nodes[a]) + dof] != 0;
  }

  const BundleFile& file;
  const SmallSections& small;
  std::vector<std::int32_t> nodes;
  std::vector<double> residual;
  std::vector<std::int32_t> corridor;
  std::vector<float> corridor_compliance;
  std::vector<std::ptrdiff_t> place_in_corridor;  // of each node; -1: none
};

std::string fault_of_nodes(const CutRegionCheck& c) {
  for (std::size_t a = 0; a < c.nodes.size(); ++a) {
    const std::int32_t node = c.nodes[a];
    const bool inside = static_cast<std::uint64_t>(node) >= c.file.index().counts.surface_nodes;
    if (inside && c.place_in_corridor[a] < 0)
      return fmt::format("node {}: inside the organ, and corridor/nodes does not have it", node);
    const bool moves = !c.is_held(a, 0) || !c.is_held(a, 1) || !c.is_held(a, 2);
    if (!inside && moves && CutRegionCheck::place(c.small.touchable, node) < 0)
      return fmt::format("node {}: on the surface, and tensors/nodes does not have it", node);
  }
  return "";
}

// The corridor has the same numbers, rounded.
std::string fault_of_block(const CutRegionCheck& c, std::size_t a, std::size_t b, const double* block) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const double entry = block[3 * i + j];
      const auto pair = [&] { return fmt::format("compliance of nodes {} and {}", c.nodes[a], c.nodes[b]); };
      if (!std::isfinite(entry)) return fmt::format("{}: {}", pair(), entry);
      if ((c.is_held(a, i) || c.is_held(b, j)) && entry != 0)
        return fmt::format("{}: a fixed dof has {} m/N", pair(), entry);
      if (a == b && entry != block[3 * j + i])
        return fmt::format("{} is not symmetric: {} and {} m/N", pair(), entry, block[3 * j + i]);
      const std::ptrdiff_t k = c.place_in_corridor[a], l = c.place_in_corridor[b];
      if (k < 0 || l < 0) continue;
      const std::size_t dofs = 3 * c.corridor.size();
      const float stored =
          c.corridor_compliance[(3 * static_cast<std::size_t>(k) + i) * dofs + 3 * static_cast<std::size_t>(l) + j];
      if (!(std::abs(stored - entry) <= 0x1p-23 * std::abs(entry)))
        return fmt::format("{}: {} m/N, and the corridor has {}", pair(), entry, stored);
    }
  return "";
}

}  // namespace

void check_cut(const BundleFile& file, const SmallSections& s, const std::vector<Matrix3>& compliance, Checks& checks) {
  if (file.index().counts.cut == 0) return;
  const CutRegionCheck c(file, s);
  std::string wrong = fault_of_nodes(c);
  const double tolerance = stated_tolerance(file);
  for (std::size_t i = 0; i < c.residual.size() && wrong.empty(); ++i)
    if (!(c.residual[i] >= 0 && c.residual[i] <= tolerance))
      wrong = fmt::format("node {}: residual {:.3g}, tolerance {:.3g}", c.nodes[i / 3], c.residual[i], tolerance);
  // Of nodes that can be touched: their own block was solved twice.
  double worst = 0;
  for (std::size_t a = 0; a < c.nodes.size() && wrong.empty(); ++a) {
    const std::vector<double> row = c.row(a);
    for (std::size_t b = 0; b <= a && wrong.empty(); ++b) wrong = fault_of_block(c, a, b, &row[9 * b]);
    if (!wrong.empty()) break;
    Matrix3 own, inverse;
    std::copy_n(&row[9 * a], 9, own.begin());
    if (!invert_on_free(own, &s.fixed[3 * static_cast<std::size_t>(c.nodes[a])], &inverse))
      wrong = fmt::format("compliance of node {}: not positive definite", c.nodes[a]);
    const std::ptrdiff_t k = CutRegionCheck::place(s.touchable, c.nodes[a]);
    if (k < 0) continue;
    double difference = 0, size = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      difference = std::max(difference, std::abs(own[i] - compliance[static_cast<std::size_t>(k)][i]));
      size = std::max(size, std::abs(own[i]));
    }
    if (size > 0 && !(difference / size <= worst)) worst = difference / size;
  }
  const double residual = *std::ranges::max_element(c.residual);
  checks.add_faults("cut", wrong, fmt::format("{} nodes, worst residual {:.3g}", c.nodes.size(), residual));
  if (!wrong.empty()) return;
  // As for T^f that is solved again.
  const double bound =
      1e-12 + 10 * std::sqrt(static_cast<double>(s.nodes.size())) * (residual + *std::ranges::max_element(s.residual));
  checks.add_bounded("cut beside tensors", worst <= bound,
                     "relative difference of a touchable node's own compliance from its column's", worst, bound);
}

}  // namespace palpate
