#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "formats/errors.h"
#include "formats/organ_config.h"
#include "formats/program.h"

namespace palpate {
namespace {

using Point = std::array<double, 3>;

double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

std::string text_of(const Point& p) {
  return fmt::format("[{:.4g}, {:.4g}, {:.4g}]", p[0], p[1], p[2]);
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
  Selection(const TetrahedralMesh& mesh, const std::vector<std::int32_t>& surface_nodes,
            const std::filesystem::path& file, const LabelledNodes& labelled)
      : mesh_(mesh), surface_(surface_nodes), file_(file), labelled_(labelled), slack_(slack(mesh)) {
    all_.resize(mesh.nodes.size());
    std::iota(all_.begin(), all_.end(), 0);
  }

  // For each node 1 where one of the selectors picks it.
  std::vector<char> any_of(const std::vector<Selector>& selectors) const {
    std::vector<char> picked(mesh_.nodes.size(), 0);
    for (const auto& s : selectors) {
      const auto more = picked_by(s);
      for (std::size_t n = 0; n < picked.size(); ++n) picked[n] |= more[n];
    }
    return picked;
  }

 private:
  std::vector<char> picked_by(const Selector& s) const {
    const auto& candidates = s.whole_mesh ? all_ : surface_;
    std::vector<char> picked(mesh_.nodes.size(), 0);
    for (const auto n : chosen(s, candidates)) picked[n] = 1;
    if (std::find(picked.begin(), picked.end(), 1) == picked.end())
      throw InputError(
          fmt::format("{}:{}: this selector picks none of the {} {}nodes; check its numbers against the "
                      "mesh, in the mesh's unit",
                      file_.string(), s.line, candidates.size(), s.whole_mesh ? "" : "surface "));
    return picked;
  }

  using Nodes = std::vector<std::int32_t>;

  Nodes chosen(const Selector& s, const Nodes& candidates) const {
    switch (s.kind) {
      case Selector::Kind::box:
        return where(candidates, [&](const Point& p) {
          bool inside = true;
          for (int d = 0; d < 3; ++d) inside = inside && p[d] >= s.a[d] - slack_ && p[d] <= s.b[d] + slack_;
          return inside;
        });
      case Selector::Kind::sphere:
        return where(candidates,
                     [&](const Point& p) { return std::sqrt(dot(minus(p, s.a), minus(p, s.a))) <= s.number + slack_; });
      case Selector::Kind::half_space:
        return where(candidates,
                     [&](const Point& p) { return dot(minus(p, s.a), s.b) <= slack_ * std::sqrt(dot(s.b, s.b)); });
      case Selector::Kind::nearest:
        return nearest(s, candidates);
      case Selector::Kind::below_quantile:
        return below_quantile(s, candidates);
      case Selector::Kind::patch:
        return patch(s, candidates);
      case Selector::Kind::contact:
        return contact(s, candidates);
      case Selector::Kind::everything:
        return candidates;
      case Selector::Kind::facing:
        return facing(s, candidates);
      case Selector::Kind::label:
        return label(s, candidates);
      case Selector::Kind::all_of: {
        std::vector<char> picked(mesh_.nodes.size(), 1);
        for (const auto& one : s.inner) {
          const auto more = picked_by(one);
          for (std::size_t n = 0; n < picked.size(); ++n) picked[n] &= more[n];
        }
        return only(picked, 1, candidates);
      }
      case Selector::Kind::any_of:
        return only(any_of(s.inner), 1, candidates);
      case Selector::Kind::none_of:
        return only(any_of(s.inner), 0, candidates);
    }
    return {};
  }

  template <class Test>
  Nodes where(const Nodes& candidates, Test test) const {
    Nodes nodes;
    for (const auto n : candidates)
      if (test(mesh_.nodes[n])) nodes.push_back(n);
    return nodes;
  }

  static Nodes only(const std::vector<char>& marks, char mark, const Nodes& candidates) {
    Nodes nodes;
    for (const auto n : candidates)
      if (marks[n] == mark) nodes.push_back(n);
    return nodes;
  }

  Nodes nearest(const Selector& s, const Nodes& candidates) const {
    Nodes nodes;
    for (const auto& point : s.points) {
      std::int32_t best = -1;
      double least = std::numeric_limits<double>::infinity();
      for (const auto n : candidates) {
        const double d = dot(minus(mesh_.nodes[n], point), minus(mesh_.nodes[n], point));
        if (d < least) least = d, best = n;
      }
      if (best < 0) continue;
      nodes.push_back(best);
      warn_of_a_far_place(s, point, best, std::sqrt(least));
    }
    return nodes;
  }

  void warn_of_a_far_place(const Selector& s, const Point& point, std::int32_t node, double away) const {
    if (const double edge = longest_edge(node); away > edge)
      warn(
          fmt::format("{}:{}: nearest: {} is {:.4g} from the node that it picks, {}, farther than that node's longest "
                      "edge of {:.3g} (all "
                      "in mesh_unit); is the place right?",
                      file_.string(), s.line, text_of(point), away, text_of(mesh_.nodes[node]), edge));
  }

  double longest_edge(std::int32_t node) const {
    double longest = 0;
    for (const auto& t : mesh_.tetrahedra)
      if (std::find(t.begin(), t.end(), node) != t.end())
        for (const auto n : t) {
          const Point edge = minus(mesh_.nodes[n], mesh_.nodes[node]);
          longest = std::max(longest, std::sqrt(dot(edge, edge)));
        }
    return longest;
  }

  // The ceil(quantile * count) lowest nodes along the direction, and those level with the last of them.
  Nodes below_quantile(const Selector& s, const Nodes& candidates) const {
    if (candidates.empty()) return {};
    std::vector<double> height;
    for (const auto n : candidates) height.push_back(dot(mesh_.nodes[n], s.a));
    std::vector<double> sorted = height;
    const auto count = static_cast<std::size_t>(std::ceil(s.number * static_cast<double>(sorted.size()) - 1e-9));
    const auto last =
        sorted.begin() + static_cast<std::ptrdiff_t>(std::clamp<std::size_t>(count, 1, sorted.size()) - 1);
    std::nth_element(sorted.begin(), last, sorted.end());
    const double limit = *last + slack_ * std::sqrt(dot(s.a, s.a));
    Nodes nodes;
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (height[i] <= limit) nodes.push_back(candidates[i]);
    return nodes;
  }

  Nodes patch(const Selector& s, const Nodes& candidates) const {
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
    return only(wanted, 1, candidates);
  }

  Nodes contact(const Selector& s, const Nodes& candidates) const {
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
    return only(touched[0], 1, candidates);
  }

  // The normal of a node: the mean of the triangles around it, weighted by their angles there, so that it does not depend on how
  // the surface is divided into triangles.
  Nodes facing(const Selector& s, const Nodes& candidates) const {
    std::vector<Point> normal(mesh_.nodes.size(), {0, 0, 0});
    for (const auto& t : boundary_triangles(mesh_))
      for (int i = 0; i < 3; ++i) {
        const Point& own = mesh_.nodes[t[i]];
        const Point u = minus(mesh_.nodes[t[(i + 1) % 3]], own), v = minus(mesh_.nodes[t[(i + 2) % 3]], own),
                    n = cross(u, v);
        const double twice_area = std::sqrt(dot(n, n));
        if (twice_area == 0) continue;
        const double angle = std::atan2(twice_area, dot(u, v));
        for (int d = 0; d < 3; ++d) normal[t[i]][d] += angle / twice_area * n[d];
      }
    Nodes nodes;
    for (const auto n : candidates) {
      const double size = std::sqrt(dot(normal[n], normal[n]) * dot(s.a, s.a));
      if (size > 0 && std::acos(std::clamp(dot(normal[n], s.a) / size, -1.0, 1.0)) <= s.number * kDegree + 1e-9)
        nodes.push_back(n);
    }
    return nodes;
  }

  Nodes label(const Selector& s, const Nodes& candidates) const {
    if (!labelled_)
      throw InputError(fmt::format("{}:{}: label: this program reads no label image; select in another way",
                                   file_.string(), s.line));
    return only(labelled_(s), 1, candidates);
  }

  static constexpr double kDegree = std::numbers::pi / 180;

  const TetrahedralMesh& mesh_;
  const Nodes& surface_;
  const std::filesystem::path& file_;
  const LabelledNodes& labelled_;
  double slack_;
  Nodes all_;
};

}  // namespace

std::vector<std::int32_t> select_nodes(const std::vector<Selector>& selectors, const TetrahedralMesh& mesh,
                                       const std::vector<std::int32_t>& surface_nodes,
                                       const std::filesystem::path& file, const LabelledNodes& labelled) {
  const auto picked = Selection(mesh, surface_nodes, file, labelled).any_of(selectors);
  std::vector<std::int32_t> nodes;
  for (std::size_t n = 0; n < picked.size(); ++n)
    if (picked[n]) nodes.push_back(static_cast<std::int32_t>(n));
  return nodes;
}

}  // namespace palpate
