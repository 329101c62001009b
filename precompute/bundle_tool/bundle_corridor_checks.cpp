// The laws of the corridor columns, and their reciprocity with the touchable ones.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "precompute/bundle_tool/bundle_checks.h"
#include "precompute/bundle_tool/stored_columns.h"

namespace palpate {

using namespace formats;

namespace {

// Touchable nodes whose interior rows are compared with the corridor.
constexpr std::size_t kMostComparedNodes = 32;

// The sections of the corridor: the small ones whole, the rows of one node at a time.
struct CorridorSections {
  explicit CorridorSections(const BundleFile& bundle)
      : file(bundle),
        nodes(bundle.numbers<std::int32_t>(SectionId::corridor_nodes)),
        compliance(bundle.numbers<float>(SectionId::corridor_compliance)),
        residual(bundle.numbers<double>(SectionId::corridor_residual)) {}

  std::size_t dofs() const { return 3 * nodes.size(); }
  float entry(std::size_t column, std::size_t dof) const { return compliance[column * dofs() + dof]; }

  // [3][count][3] of the k-th node; empty where the bundle does not have the section.
  std::vector<float> rows(SectionId id, std::size_t k) const {
    const SectionEntry* found = file.find(id);
    if (!found) return {};
    std::vector<float> numbers(9 * found->shape[2]);
    file.read(*found, k * numbers.size() * sizeof(float), numbers.data(), numbers.size() * sizeof(float));
    return numbers;
  }

  const BundleFile& file;
  std::vector<std::int32_t> nodes;
  std::vector<float> compliance;  // [K][3][K][3]
  std::vector<double> residual;   // [K][3]
};

std::string fault_of_compliance(const CorridorSections& c, const SmallSections& s) {
  for (std::size_t a = 0; a < c.dofs(); ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      const auto at = [&](std::size_t dof) { return 3 * static_cast<std::size_t>(c.nodes[dof / 3]) + dof % 3; };
      const float entry = c.entry(a, b);
      if (!std::isfinite(entry)) return fmt::format("compliance of nodes {} and {}: {}", at(a) / 3, at(b) / 3, entry);
      if (entry != c.entry(b, a))
        return fmt::format("compliance of nodes {} and {} is not symmetric: {} and {} m/N", at(a) / 3, at(b) / 3, entry,
                           c.entry(b, a));
      if ((s.fixed[at(a)] || s.fixed[at(b)]) && entry != 0)
        return fmt::format("compliance of nodes {} and {}: a fixed dof has {} m/N", at(a) / 3, at(b) / 3, entry);
    }
  for (std::size_t k = 0; k < c.nodes.size(); ++k) {
    Matrix3 own, inverse;
    for (std::size_t i = 0; i < 9; ++i) own[i] = static_cast<double>(c.entry(3 * k + i / 3, 3 * k + i % 3));
    if (!invert_on_free(own, &s.fixed[3 * static_cast<std::size_t>(c.nodes[k])], &inverse))
      return fmt::format("compliance of node {}: not positive definite", c.nodes[k]);
  }
  return "";
}

// What does not hold of the rows of the k-th node. first: the node of the first entry.
std::string fault_of_rows(const CorridorSections& c, const SmallSections& s, std::size_t k,
                          const std::vector<float>& rows, std::size_t first) {
  const std::size_t run = rows.size() / 3, own = 3 * static_cast<std::size_t>(c.nodes[k]);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::size_t dof = 3 * first + i % run;
    if (!std::isfinite(rows[i])) return fmt::format("node {}: node {} moves by {}", c.nodes[k], dof / 3, rows[i]);
    if ((s.fixed[dof] || s.fixed[own + i / run]) && rows[i] != 0)
      return fmt::format("node {}: a fixed dof has {} m/N at node {}", c.nodes[k], rows[i], dof / 3);
  }
  const std::size_t ns = c.file.index().counts.surface_nodes;
  for (std::size_t l = 0; l < c.nodes.size() && first == ns; ++l)
    for (std::size_t i = 0; i < 9; ++i)
      if (rows[i / 3 * run + 3 * (static_cast<std::size_t>(c.nodes[l]) - ns) + i % 3] !=
          c.entry(3 * k + i / 3, 3 * l + i % 3))
        return fmt::format("node {}: its compliance and its row of the interior differ at node {}", c.nodes[k],
                           c.nodes[l]);
  return "";
}

std::string fault_of_residuals(const CorridorSections& c, double tolerance) {
  for (std::size_t i = 0; i < c.residual.size(); ++i)
    if (!(c.residual[i] >= 0 && c.residual[i] <= tolerance))
      return fmt::format("node {}: residual {:.3g}, tolerance {:.3g}", c.nodes[i / 3], c.residual[i], tolerance);
  return "";
}

// ---- reciprocity ----------------------------------------------------------------------------------------------------

// A touchable node n: C_kn = T^u_kn C_nn at each corridor node k, how far storing may have moved it, and |C e| of its columns.
struct ComparedNode {
  std::int32_t node;
  std::vector<Matrix3> compliance, rounding;
  std::array<double, 3> norm;
};

// |C e| of three columns, of which rows: [3][count][3] are two parts.
template <class Number>
std::array<double, 3> norms(const std::vector<Number>& surface, const std::vector<Number>& interior) {
  std::array<double, 3> sum{};
  for (const auto* part : {&surface, &interior})
    for (std::size_t i = 0; i < part->size(); ++i)
      sum[i / (part->size() / 3)] += static_cast<double>((*part)[i]) * static_cast<double>((*part)[i]);
  return {std::sqrt(sum[0]), std::sqrt(sum[1]), std::sqrt(sum[2])};
}

// How far rounding may have moved a number of row [slot, j] of the interior.
double rounding_of(const StoredColumns& columns, double number, std::size_t slot, std::size_t j) {
  const auto type = static_cast<ElementType>(columns.file().find(SectionId::displacement_interior)->type);
  if (type == ElementType::f64) return 0;
  if (type == ElementType::f32) return 0x1p-24 * std::abs(number);
  return 0x1p-11 * std::abs(number) + 0x1p-25 * columns.row_scale(slot, j);
}

ComparedNode read_compared(StoredColumns& columns, const CorridorSections& c, const SmallSections& s, std::size_t slot,
                           const Matrix3& own) {
  ColumnRows rows;
  columns.read(slot, rows);
  const std::size_t run = rows.interior.size() / 3, ns = columns.surface_nodes();
  ComparedNode found{s.touchable[slot], {}, {}, {}};
  for (const std::int32_t node : c.nodes) {
    Matrix3 t, moved;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        t[3 * i + j] = rows.interior[j * run + 3 * (static_cast<std::size_t>(node) - ns) + i];
        moved[3 * i + j] = rounding_of(columns, t[3 * i + j], slot, j);
      }
    found.compliance.push_back(multiply(t, own));
    found.rounding.push_back(multiply(moved, absolute(own)));
  }
  // |C e_j| <= sum over i of |T^u e_i| |C_ij|
  const auto of_rows = norms(rows.surface, rows.interior);
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) found.norm[j] += of_rows[i] * std::abs(own[3 * i + j]);
  return found;
}

struct CorridorReciprocity {
  double worst = 0, relative = 0;  // largest |C_nk - C_kn^T| over its bound, and over the largest entry of its block
  std::int32_t node = -1, touched = -1;
};

// As for pairs of touchable nodes: both sides were rounded, and the residuals of both columns leave an error.
void compare(const ComparedNode& n, const CorridorSections& c, std::size_t k, const std::vector<float>& surface,
             const std::array<double, 3>& norm, double tolerance, CorridorReciprocity& found) {
  const std::size_t run = surface.size() / 3;
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const double stored = surface[i * run + 3 * static_cast<std::size_t>(n.node) + j];
      const double miss = std::abs(stored - n.compliance[k][3 * i + j]);
      const double bound = 2 * (0x1p-24 * std::abs(stored) + n.rounding[k][3 * i + j] +
                                2 * (tolerance + 0x1p-50) * (norm[i] + n.norm[j]));
      difference = std::max(difference, miss), size = std::max(size, std::abs(stored));
      if (const double ratio = miss == 0 ? 0 : miss / bound; !(ratio <= found.worst))
        found.worst = ratio, found.node = c.nodes[k], found.touched = n.node;
    }
  if (size > 0) found.relative = std::max(found.relative, difference / size);
}

}  // namespace

void check_corridor(const BundleFile& file, const SmallSections& s, const std::vector<Matrix3>& compliance,
                    std::uint64_t seed, Checks& checks) {
  const CorridorSections c(file);
  if (c.nodes.empty()) return;
  const auto worst_of = [](const std::vector<double>& x) { return *std::max_element(x.begin(), x.end()); };
  std::string wrong = fault_of_compliance(c, s);
  if (wrong.empty()) wrong = fault_of_residuals(c, stated_tolerance(file));
  std::vector<ComparedNode> compared;
  if (wrong.empty() && checks.all_held() && file.find(SectionId::displacement_interior)) {
    StoredColumns columns(file);
    for (const auto slot : draw(s.touchable.size(), std::min(s.touchable.size(), kMostComparedNodes), seed))
      compared.push_back(read_compared(columns, c, s, static_cast<std::size_t>(slot), compliance[slot]));
  }
  const double tolerance = std::max(worst_of(s.residual), worst_of(c.residual));
  CorridorReciprocity found;
  for (std::size_t k = 0; k < c.nodes.size() && wrong.empty(); ++k) {
    const auto surface = c.rows(SectionId::corridor_surface, k), interior = c.rows(SectionId::corridor_interior, k);
    wrong = fault_of_rows(c, s, k, surface, 0);
    if (wrong.empty() && !interior.empty()) wrong = fault_of_rows(c, s, k, interior, file.index().counts.surface_nodes);
    const auto norm = norms(surface, interior);
    for (const ComparedNode& n : compared) compare(n, c, k, surface, norm, tolerance, found);
  }
  checks.add_faults("corridors", wrong,
                    fmt::format("{} nodes, worst residual {:.3g}", c.nodes.size(), worst_of(c.residual)));
  if (!wrong.empty() || compared.empty()) return;
  checks.add_bounded("corridor reciprocity", found.worst <= 1,
                     fmt::format("|C_nk - C_kn^T| over its bound of {} touchable nodes (relative to C_nk {:.2g}; worst "
                                 "pair {}, {})",
                                 compared.size(), found.relative, found.touched, found.node),
                     found.worst, 1);
}

}  // namespace palpate
