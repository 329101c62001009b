#include "studies/large/split_mesh.h"

#include <algorithm>
#include <map>
#include <utility>

namespace palpate::large {
namespace {

using Node = std::int32_t;

class Middles {
 public:
  explicit Middles(std::vector<std::array<double, 3>>* nodes) : nodes_(*nodes) {}

  Node operator()(Node a, Node b) {
    const auto [at, added] = known_.try_emplace(std::minmax(a, b), static_cast<Node>(nodes_.size()));
    if (added) {
      const auto& p = nodes_[static_cast<std::size_t>(a)];
      const auto& q = nodes_[static_cast<std::size_t>(b)];
      nodes_.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return at->second;
  }
  double squared_distance(Node a, Node b) const {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double d = nodes_[static_cast<std::size_t>(a)][i] - nodes_[static_cast<std::size_t>(b)][i];
      sum += d * d;
    }
    return sum;
  }

 private:
  std::vector<std::array<double, 3>>& nodes_;
  std::map<std::pair<Node, Node>, Node> known_;
};

// The eight parts, all of positive volume where the whole has it.
std::array<std::array<Node, 4>, 8> parts_of(const std::array<Node, 4>& whole, Middles& middle) {
  const auto [a, b, c, d] = whole;
  const Node ab = middle(a, b), ac = middle(a, c), ad = middle(a, d), bc = middle(b, c), bd = middle(b, d),
             cd = middle(c, d);
  // A diagonal joins the middles of two edges that do not meet. The other four middles go round it, seen from its first end so that
  // (first, last, one, next) is positive.
  struct Diagonal {
    Node first, last;
    std::array<Node, 4> around;
  };
  const Diagonal diagonals[] = {{ab, cd, {ad, bd, bc, ac}}, {ac, bd, {bc, cd, ad, ab}}, {ad, bc, {ac, cd, bd, ab}}};
  const Diagonal& cut =
      *std::min_element(std::begin(diagonals), std::end(diagonals), [&](const auto& x, const auto& y) {
        return middle.squared_distance(x.first, x.last) < middle.squared_distance(y.first, y.last);
      });
  std::array<std::array<Node, 4>, 8> parts = {{{a, ab, ac, ad}, {ab, b, bc, bd}, {ac, bc, c, cd}, {ad, bd, cd, d}}};
  for (std::size_t i = 0; i < 4; ++i) parts[4 + i] = {cut.first, cut.last, cut.around[i], cut.around[(i + 1) % 4]};
  return parts;
}

}  // namespace

TetrahedralMesh split_mesh(const TetrahedralMesh& mesh) {
  TetrahedralMesh fine;
  fine.nodes = mesh.nodes, fine.region_names = mesh.region_names;
  Middles middle(&fine.nodes);
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
    for (const auto& part : parts_of(mesh.tetrahedra[e], middle))
      fine.tetrahedra.push_back(part), fine.region.push_back(mesh.region[e]);
  for (const auto& patch : mesh.patches) {
    fine.patches.push_back({patch.name, {}});
    for (const auto& [a, b, c] : patch.triangles) {
      const Node ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& part :
           {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}, std::array{ab, bc, ca}})
        fine.patches.back().triangles.push_back(part);
    }
  }
  return fine;
}

}  // namespace palpate::large
