#include "precompute/elements/place_supports.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "formats/errors.h"

namespace palpate {
namespace {

using Point = std::array<double, 3>;
using Nodes = std::vector<std::int32_t>;

// Nodes nearer than this share of the body's extent are at the same place.
constexpr double kSamePlace = 1e-9;

Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

double length(const Point& a) {
  return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

double extent_of(const ElasticBody& body) {
  Point low = body.nodes[0], high = low;
  for (const auto& p : body.nodes)
    for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], p[d]), high[d] = std::max(high[d], p[d]);
  return length(minus(high, low));
}

Foundation placed(const BoundaryConfig::Foundation& config, const Nodes& nodes, const ElasticBody& body,
                  const std::filesystem::path& file) {
  Foundation result{config.name, config.normal.value, config.tangential.value, triangles_on(body, nodes)};
  if (result.triangles.empty())
    throw InputError(
        fmt::format("{}:{}: [[foundation]] \"{}\": expected nodes that are the three corners of a triangle of the "
                    "surface, found none "
                    "among the {} selected nodes; select a larger piece of the surface",
                    file.string(), config.line, config.name, nodes.size()));
  return result;
}

// Of each of the nodes; their sum is 1.
std::vector<double> shares_of(const ElasticBody& body, const Nodes& nodes) {
  std::vector<double> share(body.nodes.size(), 0.0);
  double total = 0;
  for (const auto triangle : triangles_on(body, nodes)) {
    const double area = area_of(body, {"", 0, 0, {triangle}});
    for (const auto n : body.triangles[triangle]) share[n] += area / 3;
    total += area;
  }
  std::vector<double> result;
  for (const auto n : nodes) result.push_back(total > 0 ? share[n] / total : 1 / static_cast<double>(nodes.size()));
  return result;
}

std::int32_t nearest_of(const ElasticBody& body, const Nodes& nodes, const Point& p) {
  return *std::min_element(nodes.begin(), nodes.end(), [&](auto a, auto b) {
    return length(minus(body.nodes[a], p)) < length(minus(body.nodes[b], p));
  });
}

class SpringPlacer {
 public:
  SpringPlacer(const ElasticBody& body, double metres)
      : body_(body), metres_(metres), same_(kSamePlace * extent_of(body)) {}

  SpringSet place(const BoundaryConfig::Spring& config, const Nodes& from, const Nodes& to,
                  const std::filesystem::path& file) const {
    SpringSet set{config.name, {}};
    if (config.anchor) set.anchor = in_metres(*config.anchor);
    const auto share = shares_of(body_, from);
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (share[i] == 0) continue;
      Spring spring{from[i], Spring::kWorld, share[i] * config.stiffness.value};
      if (set.anchor) {
        spring.axis = axis(from[i], *set.anchor);
      } else if (!config.to.empty()) {
        spring.b = nearest_of(body_, to, body_.nodes[from[i]]);
        spring.axis = axis(from[i], body_.nodes[spring.b]);
        if (spring.a == spring.b)
          throw InputError(
              fmt::format("{}:{}: [[spring]] \"{}\": expected other nodes in to than in from, found a node at "
                          "({:.4g}, {:.4g}, {:.4g}) m in both; select less",
                          file.string(), config.line, config.name, body_.nodes[spring.a][0], body_.nodes[spring.a][1],
                          body_.nodes[spring.a][2]));
      }
      set.springs.push_back(spring);
    }
    return set;
  }

 private:
  Point in_metres(Point p) const {
    for (double& x : p) x *= metres_;
    return p;
  }
  // Zero where both are at the same place.
  Point axis(std::int32_t node, const Point& end) const {
    const Point way = minus(end, body_.nodes[node]);
    const double size = length(way);
    if (size <= same_) return {0, 0, 0};
    return {way[0] / size, way[1] / size, way[2] / size};
  }

  const ElasticBody& body_;
  double metres_, same_;
};

}  // namespace

Nodes triangles_on(const ElasticBody& body, const Nodes& nodes) {
  std::vector<char> chosen(body.nodes.size(), 0);
  for (const auto n : nodes) chosen[n] = 1;
  Nodes triangles;
  for (std::size_t t = 0; t < body.triangles.size(); ++t) {
    const auto& [a, b, c] = body.triangles[t];
    if (chosen[a] && chosen[b] && chosen[c]) triangles.push_back(static_cast<std::int32_t>(t));
  }
  return triangles;
}

void place_supports(const BoundaryConfig& boundary, double metres, const std::filesystem::path& file,
                    const std::function<Nodes(const std::vector<Selector>&)>& select, ElasticBody& body) {
  for (const auto& foundation : boundary.foundations)
    body.foundations.push_back(placed(foundation, select(foundation.select), body, file));
  const SpringPlacer placer(body, metres);
  for (const auto& spring : boundary.springs)
    body.springs.push_back(
        placer.place(spring, select(spring.from), spring.to.empty() ? Nodes{} : select(spring.to), file));
}

}  // namespace palpate
