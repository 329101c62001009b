#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "formats/errors.h"
#include "formats/organ_config.h"

namespace palpate {
namespace {

using Point = std::array<double, 3>;

double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "\"" : ", \"") + name + '"';
  return text.empty() ? "none" : text;
}

// A node on the border of a selector counts as inside, although its last digits may differ.
double slack(const TetrahedralMesh& mesh) {
  Point low{}, high{};
  for (int d = 0; d < 3; ++d) {
    low[d] = std::numeric_limits<double>::infinity(), high[d] = -low[d];
    for (const auto& p : mesh.nodes) low[d] = std::min(low[d], p[d]), high[d] = std::max(high[d], p[d]);
  }
  return 1e-9 * std::sqrt(dot(minus(high, low), minus(high, low)));
}

class Selection {
 public:
  Selection(const TetrahedralMesh& mesh, const std::filesystem::path& file)
      : mesh_(mesh), file_(file), slack_(slack(mesh)), chosen_(mesh.nodes.size(), 0) {}

  void add(const Selector& s, const std::vector<std::int32_t>& candidates) {
    const std::size_t before = count_;
    taken_ = 0;
    switch (s.kind) {
      case Selector::Kind::box:
        where(candidates, [&](const Point& p) {
          bool inside = true;
          for (int d = 0; d < 3; ++d) inside = inside && p[d] >= s.a[d] - slack_ && p[d] <= s.b[d] + slack_;
          return inside;
        });
        break;
      case Selector::Kind::sphere:
        where(candidates,
              [&](const Point& p) { return std::sqrt(dot(minus(p, s.a), minus(p, s.a))) <= s.number + slack_; });
        break;
      case Selector::Kind::half_space:
        where(candidates, [&](const Point& p) { return dot(minus(p, s.a), s.b) <= slack_ * std::sqrt(dot(s.b, s.b)); });
        break;
      case Selector::Kind::nearest:
        nearest(s, candidates);
        break;
      case Selector::Kind::below_quantile:
        below_quantile(s, candidates);
        break;
      case Selector::Kind::patch:
        patch(s, candidates);
        break;
      case Selector::Kind::contact:
        contact(s, candidates);
        break;
      case Selector::Kind::everything:
        where(candidates, [](const Point&) { return true; });
        break;
    }
    if (taken_ == 0 && count_ == before)
      throw InputError(
          fmt::format("{}:{}: this selector picks none of the {} {}nodes; check its numbers against the "
                      "mesh, in the mesh's unit",
                      file_.string(), s.line, candidates.size(), s.whole_mesh ? "" : "surface "));
  }

  std::vector<std::int32_t> result() const {
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < chosen_.size(); ++n)
      if (chosen_[n]) nodes.push_back(static_cast<std::int32_t>(n));
    return nodes;
  }

 private:
  void take(std::int32_t node) {
    ++taken_;
    if (!chosen_[node]) chosen_[node] = 1, ++count_;
  }

  template <class Test>
  void where(const std::vector<std::int32_t>& candidates, Test test) {
    for (const auto n : candidates)
      if (test(mesh_.nodes[n])) take(n);
  }

  void nearest(const Selector& s, const std::vector<std::int32_t>& candidates) {
    for (const auto& point : s.points) {
      std::int32_t best = -1;
      double least = std::numeric_limits<double>::infinity();
      for (const auto n : candidates) {
        const double d = dot(minus(mesh_.nodes[n], point), minus(mesh_.nodes[n], point));
        if (d < least) least = d, best = n;
      }
      if (best >= 0) take(best);
    }
  }

  // The ceil(quantile * count) lowest nodes along the direction, and those level with the last of them.
  void below_quantile(const Selector& s, const std::vector<std::int32_t>& candidates) {
    if (candidates.empty()) return;
    std::vector<double> height;
    for (const auto n : candidates) height.push_back(dot(mesh_.nodes[n], s.a));
    std::vector<double> sorted = height;
    const auto count = static_cast<std::size_t>(std::ceil(s.number * static_cast<double>(sorted.size()) - 1e-9));
    const auto last =
        sorted.begin() + static_cast<std::ptrdiff_t>(std::clamp<std::size_t>(count, 1, sorted.size()) - 1);
    std::nth_element(sorted.begin(), last, sorted.end());
    const double limit = *last + slack_ * std::sqrt(dot(s.a, s.a));
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (height[i] <= limit) take(candidates[i]);
  }

  void only(const std::vector<char>& wanted, const std::vector<std::int32_t>& candidates) {
    for (const auto n : candidates)
      if (wanted[n]) take(n);
  }

  void patch(const Selector& s, const std::vector<std::int32_t>& candidates) {
    std::vector<std::string> names;
    std::vector<char> wanted(mesh_.nodes.size(), 0);
    for (const auto& p : mesh_.patches) {
      names.push_back(p.name);
      if (p.name != s.names[0]) continue;
      for (const auto& triangle : p.triangles)
        for (const auto n : triangle) wanted[n] = 1;
    }
    if (std::find(names.begin(), names.end(), s.names[0]) == names.end())
      throw InputError(fmt::format("{}:{}: the mesh has no surface patch \"{}\"; its patches are: {}", file_.string(),
                                   s.line, s.names[0], listed(names)));
    only(wanted, candidates);
  }

  void contact(const Selector& s, const std::vector<std::int32_t>& candidates) {
    std::vector<char> touched[2] = {std::vector<char>(mesh_.nodes.size(), 0), std::vector<char>(mesh_.nodes.size(), 0)};
    for (int side = 0; side < 2; ++side) {
      const auto at = std::find(mesh_.region_names.begin(), mesh_.region_names.end(), s.names[side]);
      if (at == mesh_.region_names.end())
        throw InputError(fmt::format("{}:{}: the mesh has no region \"{}\"; its regions are: {}", file_.string(),
                                     s.line, s.names[side], listed(mesh_.region_names)));
      const auto region = static_cast<std::int32_t>(at - mesh_.region_names.begin());
      for (std::size_t t = 0; t < mesh_.tetrahedra.size(); ++t)
        if (mesh_.region[t] == region)
          for (const auto n : mesh_.tetrahedra[t]) touched[side][n] = 1;
    }
    for (std::size_t n = 0; n < mesh_.nodes.size(); ++n) touched[0][n] = touched[0][n] && touched[1][n];
    only(touched[0], candidates);
  }

  const TetrahedralMesh& mesh_;
  const std::filesystem::path& file_;
  double slack_;
  std::vector<char> chosen_;
  std::size_t count_ = 0, taken_ = 0;
};

}  // namespace

std::vector<std::int32_t> select_nodes(const std::vector<Selector>& selectors, const TetrahedralMesh& mesh,
                                       const std::vector<std::int32_t>& surface_nodes,
                                       const std::filesystem::path& file) {
  std::vector<std::int32_t> all(mesh.nodes.size());
  std::iota(all.begin(), all.end(), 0);
  Selection selection(mesh, file);
  for (const auto& selector : selectors) selection.add(selector, selector.whole_mesh ? all : surface_nodes);
  return selection.result();
}

}  // namespace palpate
