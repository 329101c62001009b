#include "precompute/elements/element_warnings.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "precompute/elements/stiffness.h"

namespace palpate {
namespace {

using Eigen::Vector3d;

constexpr int kEnoughAcross = 4;
constexpr double kOpposite = -0.5;  // cosine of 120 degrees

std::vector<Vector3d> surface_normals(const ElasticBody& body) {
  std::vector<Vector3d> normals(static_cast<std::size_t>(body.surface_count), Vector3d::Zero());
  for (const auto& t : body.triangles) {
    const Vector3d a(body.nodes[t[0]].data()), b(body.nodes[t[1]].data()), c(body.nodes[t[2]].data());
    for (const auto n : t) normals[static_cast<std::size_t>(n)] += (b - a).cross(c - a);
  }
  for (auto& n : normals) n.normalize();
  return normals;
}

// For each vertex: the nearest surface vertex whose three dofs are held, and how many edges away it is.
struct Nearest {
  std::vector<int> edges;  // -1: kEnoughAcross or more
  std::vector<std::int32_t> held;
};
Nearest nearest_held(const ElasticBody& body) {
  Lists cells;
  for (const auto& t : body.tetrahedra) cells.append(t);
  const Lists around = lists_around(cells, static_cast<std::int32_t>(body.nodes.size()));
  Nearest nearest{std::vector<int>(body.nodes.size(), -1), std::vector<std::int32_t>(body.nodes.size(), -1)};
  std::vector<std::int32_t> front, next;
  for (std::int32_t n = 0; n < body.surface_count; ++n)
    if (body.fixed[n][0] && body.fixed[n][1] && body.fixed[n][2])
      nearest.edges[n] = 0, nearest.held[n] = n, front.push_back(n);
  for (int away = 1; away < kEnoughAcross; ++away, front.swap(next)) {
    next.clear();
    for (const auto n : front)
      for (const auto cell : around[n])
        for (const auto m : cells[cell])
          if (nearest.edges[m] < 0) nearest.edges[m] = away, nearest.held[m] = nearest.held[n], next.push_back(m);
  }
  return nearest;
}

void warn_of_thin_layers(const ElasticBody& body, std::vector<std::string>& sentences) {
  const auto normals = surface_normals(body);
  const Nearest nearest = nearest_held(body);
  std::size_t thin = 0;
  int fewest = kEnoughAcross;
  for (const auto n : body.touchable) {
    if (nearest.edges[n] < 0 || normals[n].dot(normals[nearest.held[n]]) > kOpposite) continue;
    ++thin;
    fewest = std::min(fewest, nearest.edges[n]);
  }
  if (100 * thin > body.touchable.size())
    sentences.push_back(fmt::format(
        "between {} of {} touchable nodes and a held face on the opposite side there are fewer than four elements "
        "(at the thinnest place {}): \"p1-anp\" is too stiff in such a layer, and more so the nearer Poisson's "
        "ratio is to 0.5; mesh the layer finer, or set element = \"p2-p0\"",
        thin, body.touchable.size(), fewest));
}

}  // namespace

std::vector<std::string> element_warnings(const ElasticBody& body, Element element) {
  std::vector<std::string> sentences;
  double poisson = -1;
  for (const auto& material : body.materials) poisson = std::max(poisson, material.poisson);
  if (poisson <= 0.4) return sentences;
  if (element == Element::p1)
    sentences.push_back(fmt::format(
        "\"p1\" locks as Poisson's ratio nears 0.5 (here {}): forces come out too large; set element = \"p1-anp\" or "
        "\"p2-p0\", unless you want to compare with the paper",
        poisson));
  if (element == Element::p1_anp) warn_of_thin_layers(body, sentences);
  return sentences;
}

}  // namespace palpate
