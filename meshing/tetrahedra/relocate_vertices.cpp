#include "meshing/tetrahedra/relocate_vertices.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "formats/processor_limit.h"
#include "meshing/tetrahedra/mesh_quality.h"

namespace palpate {
namespace {

using Eigen::Vector3d;
using Index = std::int32_t;

// The elements around each vertex, all in one array.
class Stars {
 public:
  explicit Stars(const TetrahedralMesh& mesh)
      : begin_(mesh.nodes.size() + 1, 0), elements_(4 * mesh.tetrahedra.size()) {
    for (const auto& corners : mesh.tetrahedra)
      for (const Index v : corners) ++begin_[v + 1];
    for (std::size_t v = 0; v + 1 < begin_.size(); ++v) begin_[v + 1] += begin_[v];
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
      for (const Index v : mesh.tetrahedra[e]) elements_[next[v]++] = static_cast<Index>(e);
  }
  auto begin(Index v) { return elements_.begin() + static_cast<std::ptrdiff_t>(begin_[v]); }
  auto end(Index v) { return elements_.begin() + static_cast<std::ptrdiff_t>(begin_[v + 1]); }

 private:
  std::vector<std::size_t> begin_;
  std::vector<Index> elements_;
};

class Relocation {
 public:
  Relocation(TetrahedralMesh& mesh, double goal)
      : mesh_(mesh), goal_(goal), stars_(mesh), movable_(mesh.nodes.size(), kUnknown), settled_(mesh.nodes.size(), 0) {
    for (const auto& patch : mesh.patches)
      for (const auto& triangle : patch.triangles)
        for (const Index v : triangle) movable_[v] = kFixed;
  }

  bool is_below_goal(Index e) const { return shape_of(mesh_, e).smallest_dihedral < goal_; }

  bool has_movable_corner(Index e) {
    return std::any_of(mesh_.tetrahedra[e].begin(), mesh_.tetrahedra[e].end(), [&](Index v) { return is_movable(v); });
  }

  // Returns the corners of the elements and of all elements that share a vertex with them, repeated rings times, in
  // ascending order.
  std::vector<Index> vertices_near(const std::vector<Index>& elements, int rings) {
    std::vector<Index> vertices;
    for (const Index e : elements)
      vertices.insert(vertices.end(), mesh_.tetrahedra[e].begin(), mesh_.tetrahedra[e].end());
    sort_unique(vertices);
    for (; rings > 0; --rings) {
      const std::vector<Index> inner = vertices;
      for (const Index v : inner)
        for (auto e = stars_.begin(v); e != stars_.end(v); ++e)
          vertices.insert(vertices.end(), mesh_.tetrahedra[*e].begin(), mesh_.tetrahedra[*e].end());
      sort_unique(vertices);
    }
    return vertices;
  }

  std::vector<Index> elements_below_goal_at(const std::vector<Index>& vertices) {
    std::vector<Index> below;
    for (const Index v : vertices)
      for (auto e = stars_.begin(v); e != stars_.end(v); ++e)
        if (is_below_goal(*e)) below.push_back(*e);
    sort_unique(below);
    return below;
  }

  // Direct search: goes to the best of 26 directions and halves the step where none is better. Returns whether the
  // vertex moved.
  bool relocate(Index v) {
    if (settled_[v] || !is_movable(v)) return false;
    settled_[v] = 1;  // until a vertex around it moves
    const Vector3d before = position(v);
    const Star start = star_at(v, before, -1);
    if (start.dihedral >= kRoom * goal_) return false;  // already good enough; does not hold back its neighbours
    const double ratio_floor = std::min(start.radius_ratio, kGoodRadiusRatio);
    const double edge = shortest_edge(v);
    Vector3d best = before;
    double best_dihedral = start.dihedral;
    double step = edge / 4;
    for (int turn = 0; turn < kTurns && step > edge / 2000; ++turn) {
      const Vector3d center = best;
      for (const Vector3d& direction : directions()) {
        const Vector3d tried = center + step * direction;
        const Star star = star_at(v, tried, best_dihedral);
        if (star.dihedral <= best_dihedral || star.radius_ratio < ratio_floor) continue;
        best = tried;
        best_dihedral = star.dihedral;
      }
      if (best == center) step /= 2;
    }
    const std::size_t below = count_below(v);
    move_to(v, best);
    if (best_dihedral > start.dihedral + kLeastGain && count_below(v) <= below) {
      unsettle_around(v);
      return true;
    }
    move_to(v, before);
    return false;
  }

 private:
  static constexpr double kRoom = 1.5;  // vertices whose elements all exceed this times the goal stay
  static constexpr double kGoodRadiusRatio =
      0.2;  // no move makes a radius ratio smaller than both this and the worst one before
  static constexpr double kLeastGain = 0.01;  // degrees; a smaller gain does not count, so that the rounds end
  static constexpr int kTurns = 40;
  enum State : std::uint8_t { kUnknown, kFixed, kFree };
  struct Star {
    double dihedral, radius_ratio;  // the smallest of the elements around the vertex
  };

  static void sort_unique(std::vector<Index>& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }

  static const std::vector<Vector3d>& directions() {
    static const std::vector<Vector3d> all = [] {
      std::vector<Vector3d> list;
      for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
          for (int z = -1; z <= 1; ++z)
            if (x != 0 || y != 0 || z != 0) list.push_back(Vector3d(x, y, z).normalized());
      return list;
    }();
    return all;
  }

  // Returns whether the vertex is interior to one region: each face at v belongs to two elements of the same region.
  bool is_movable(Index v) {
    if (movable_[v] != kUnknown) return movable_[v] == kFree;
    std::vector<std::array<Index, 2>> links;  // the other two corners of each face at v
    bool one_region = true;
    for (auto e = stars_.begin(v); e != stars_.end(v); ++e) {
      one_region = one_region && mesh_.region[*e] == mesh_.region[*stars_.begin(v)];
      for (const Index a : mesh_.tetrahedra[*e])
        for (const Index b : mesh_.tetrahedra[*e])
          if (a < b && a != v && b != v) links.push_back({a, b});
    }
    std::sort(links.begin(), links.end());
    bool closed = !links.empty() && links.size() % 2 == 0;
    for (std::size_t i = 0; closed && i < links.size(); i += 2)
      closed = links[i] == links[i + 1] && (i + 2 == links.size() || links[i + 1] != links[i + 2]);
    movable_[v] = one_region && closed ? kFree : kFixed;
    return movable_[v] == kFree;
  }

  void unsettle_around(Index v) {
    for (auto e = stars_.begin(v); e != stars_.end(v); ++e)
      for (const Index other : mesh_.tetrahedra[*e]) settled_[other] = 0;
  }

  Vector3d position(Index v) const { return Vector3d::Map(mesh_.nodes[v].data()); }
  void move_to(Index v, const Vector3d& p) { mesh_.nodes[v] = {p.x(), p.y(), p.z()}; }

  // Stops at the first element that is not better than floor. Moves this element to the front, because it often fails
  // again.
  Star star_at(Index v, const Vector3d& p, double floor) {
    const Vector3d before = position(v);
    move_to(v, p);
    Star star = {180, 1};
    for (auto e = stars_.begin(v); e != stars_.end(v) && star.dihedral > floor; ++e) {
      const ElementShape shape = shape_of(mesh_, *e);
      star.dihedral = std::min(star.dihedral, shape.smallest_dihedral);
      star.radius_ratio = std::min(star.radius_ratio, shape.radius_ratio);
      if (star.dihedral <= floor) {
        std::iter_swap(e, stars_.begin(v));
        break;
      }
    }
    move_to(v, before);
    return star;
  }

  std::size_t count_below(Index v) {
    return static_cast<std::size_t>(
        std::count_if(stars_.begin(v), stars_.end(v), [&](Index e) { return is_below_goal(e); }));
  }

  double shortest_edge(Index v) {
    double shortest = std::numeric_limits<double>::infinity();
    for (auto e = stars_.begin(v); e != stars_.end(v); ++e)
      for (const Index other : mesh_.tetrahedra[*e])
        if (other != v) shortest = std::min(shortest, (position(other) - position(v)).norm());
    return shortest;
  }

  TetrahedralMesh& mesh_;
  double goal_;
  Stars stars_;
  std::vector<std::uint8_t> movable_;
  std::vector<std::uint8_t> settled_;  // a try failed and no vertex around it has moved since
};

}  // namespace

Improvement improve_worst_elements(TetrahedralMesh& mesh, double goal, double processor_limit) {
  std::vector<Index> below;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
    if (shape_of(mesh, e).smallest_dihedral < goal) below.push_back(static_cast<Index>(e));
  Improvement improvement{below.size(), below.size(), 0, 0};
  if (below.empty()) return improvement;

  constexpr int kRounds = 12, kMostRings = 2;
  constexpr std::size_t kMostTries = 100000;
  const double end = processor_seconds() + processor_limit;
  Relocation relocation(mesh, goal);
  const auto is_out_of_reach = [&](Index e) { return !relocation.has_movable_corner(e); };
  improvement.out_of_reach = std::erase_if(below, is_out_of_reach);
  std::vector<std::uint8_t> moved(mesh.nodes.size(), 0);
  std::size_t tries = 0;
  int rings = 0;
  for (int round = 0; round < kRounds && !below.empty() && tries < kMostTries; ++round) {
    const std::vector<Index> vertices = relocation.vertices_near(below, rings);
    tries += vertices.size();
    bool any = false;
    for (const Index v : vertices) {
      if (processor_seconds() > end) {
        improvement.out_of_time = true;
        break;
      }
      if (!relocation.relocate(v)) continue;
      moved[v] = 1;
      any = true;
    }
    const std::size_t count = below.size();
    below = relocation.elements_below_goal_at(vertices);
    std::erase_if(below, is_out_of_reach);
    if (improvement.out_of_time || (!any && rings == kMostRings)) break;
    if (below.size() == count) rings = std::min(rings + 1, kMostRings);  // no progress: move vertices farther away too
  }
  improvement.below_after = below.size() + improvement.out_of_reach;
  improvement.vertices_moved = static_cast<std::size_t>(std::count(moved.begin(), moved.end(), 1));
  return improvement;
}

}  // namespace palpate
