#include "meshing/cut/cut_by_blade.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "formats/errors.h"
#include "meshing/cut/nearest_of_triangles.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "runtime/cut/cut_mesh.h"

namespace palpate {
namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<std::int32_t, 3>;

constexpr const char* kLips = "cut";
constexpr int kRounds = 3;  // of the nodes that move onto the path
// Of a node's way to the path: the first one with which the elements keep their angles.
constexpr std::array<double, 4> kShares = {1, 0.5, 0.25, 0.125};

Triangle sorted(Triangle t) {
  std::ranges::sort(t);
  return t;
}

class Cutter {
 public:
  Cutter(TetrahedralMesh& mesh, const BladePath& path)
      : mesh_(mesh), path_(path), triangles_(boundary_triangles(mesh)), rest_(mesh.nodes) {}
  ~Cutter() { memory_.release_all(); }
  Cutter(const Cutter&) = delete;
  Cutter& operator=(const Cutter&) = delete;

  CutReport cut(bool largest_piece, double min_dihedral) {
    for (const TetrahedralMesh::Patch& patch : mesh_.patches)
      if (patch.name == kLips)
        throw InputError(
            fmt::format("the patch \"{}\": expected another name, because the lips get this one; a mesh is cut once: "
                        "cut it along one path with all cuts",
                        kLips));
    CutBody body;
    body.nodes = mesh_.nodes.front().data(), body.node_count = static_cast<std::int32_t>(mesh_.nodes.size());
    body.tetrahedra = mesh_.tetrahedra.front().data();
    body.tetrahedron_count = static_cast<std::int32_t>(mesh_.tetrahedra.size());
    body.triangles = triangles_.front().data(), body.triangle_count = static_cast<std::int32_t>(triangles_.size());
    if (const char* wrong = cut_.create(memory_, body, body.tetrahedron_count)) throw OperationError(wrong);
    sweep();
    take_over();
    report_.pieces = piece_sizes();
    move_onto_path(min_dihedral);
    measure();
    if (largest_piece) drop_small_pieces();
    return report_;
  }

 private:
  void sweep() {
    std::vector<Point> positions = mesh_.nodes;
    const auto step = [&](const std::vector<Point>& from, const std::vector<Point>& to) {
      const CutMeshChange& change = cut_.blade(
          {from.front().data(), to.front().data(), static_cast<std::int32_t>(from.size())}, positions.front().data());
      if (change.full) throw OperationError("the mesh has no room for more nodes");
      report_.faces += static_cast<std::size_t>(change.cut_faces);
      for (std::int32_t n = change.first_node; n < change.end_node; ++n)
        positions.push_back(positions[static_cast<std::size_t>(cut_.from(n))]);
    };
    for (std::size_t i = 0; i + 1 < path_.places.size(); ++i) step(path_.places[i], path_.places[i + 1]);
    // The blade stands still until no face is left that finishing can cut: its work in a step is limited.
    for (std::int32_t before = cut_.pending() + 1; cut_.pending() < before;) {
      before = cut_.pending();
      step(path_.places.back(), path_.places.back());
    }
    if (report_.faces == 0)
      throw InputError(
          "expected a path that passes through the organ from its surface on, found none of its elements cut; are both "
          "files in one unit "
          "and in one frame?");
    report_.new_nodes = positions.size() - mesh_.nodes.size();
    mesh_.nodes = std::move(positions);
  }

  // The tetrahedra, the patches and the lips have the nodes that they have now.
  void take_over() {
    std::map<Triangle, std::array<std::size_t, 4>> corners_of;  // of patches' triangles: a tetrahedron and its corners
    for (const TetrahedralMesh::Patch& patch : mesh_.patches)
      for (const Triangle& t : patch.triangles) corners_of[sorted(t)] = {};
    for (std::size_t e = 0; !corners_of.empty() && e < mesh_.tetrahedra.size(); ++e)
      for (std::size_t c = 0; c < 4; ++c) {
        const auto& nodes = mesh_.tetrahedra[e];
        const std::array<std::size_t, 3> others = {(c + 1) % 4, (c + 2) % 4, (c + 3) % 4};
        const auto found = corners_of.find(sorted({nodes[others[0]], nodes[others[1]], nodes[others[2]]}));
        if (found != corners_of.end()) found->second = {e, others[0], others[1], others[2]};
      }
    std::vector<std::array<std::int32_t, 4>> before = std::move(mesh_.tetrahedra);
    mesh_.tetrahedra.resize(before.size());
    for (std::size_t e = 0; e < before.size(); ++e)
      std::copy_n(cut_.nodes_of(static_cast<std::int32_t>(e)), 4, mesh_.tetrahedra[e].begin());
    for (TetrahedralMesh::Patch& patch : mesh_.patches)
      for (Triangle& t : patch.triangles) {
        const auto& [e, a, b, c] = corners_of.at(sorted(t));
        for (std::int32_t& n : t)
          for (const std::size_t corner : {a, b, c})
            if (before[e][corner] == n) {
              n = mesh_.tetrahedra[e][corner];
              break;
            }
      }
    TetrahedralMesh::Patch lips = {kLips, {}};
    for (auto i = static_cast<std::int32_t>(triangles_.size()); i < cut_.surface().count(); ++i) {
      if (cut_.surface().face(i) < 0) continue;
      cut_.surface().nodes(i, lips.triangles.emplace_back().data());
    }
    mesh_.patches.push_back(std::move(lips));
  }

  const std::vector<Triangle>& lips() const { return mesh_.patches.back().triangles; }

  // Nodes of the lips, all that began at one place together, so that the lips stay on one another. Those of the organ's surface move along it.
  // Those where regions meet stay.
  void move_onto_path(double min_dihedral) {
    std::map<std::int32_t, Group> groups;  // by the node at rest
    for (const Triangle& t : lips())
      for (const std::int32_t n : t) groups[cut_.at_rest(n)].nodes.insert(n);
    for (const Triangle& t : triangles_)
      for (const std::int32_t n : t)
        if (const auto group = groups.find(n); group != groups.end()) group->second.on_surface = true;
    for (std::size_t e = 0; e < mesh_.tetrahedra.size(); ++e)
      for (const std::int32_t n : mesh_.tetrahedra[e])
        if (const auto group = groups.find(cut_.at_rest(n)); group != groups.end()) group->second.elements.push_back(e);
    std::set<std::int32_t> moved;
    for (int round = 0; round < kRounds; ++round)
      for (const auto& [rest, group] : groups)
        if (move(group, min_dihedral)) moved.insert(rest);
    report_.moved_nodes = moved.size();
  }

  struct Group {
    std::set<std::int32_t> nodes;
    std::vector<std::size_t> elements;  // around all of them
    bool on_surface = false;
  };

  bool move(const Group& group, double min_dihedral) {
    const std::vector<std::size_t>& elements = group.elements;
    if (std::ranges::any_of(elements, [&](std::size_t e) { return mesh_.region[e] != mesh_.region[elements.front()]; }))
      return false;
    const Point from = at(*group.nodes.begin()), aim = nearest_on_path(path_, from);
    const double least = std::min(smallest_angle(elements), min_dihedral);
    const auto move_all = [&](const Point& to) {
      for (const std::int32_t n : group.nodes) at(n) = to;
    };
    for (const double share : kShares) {
      Point to;
      for (std::size_t d = 0; d < 3; ++d) to[d] = from[d] + share * (aim[d] - from[d]);
      if (group.on_surface) to = nearest_on_surface(to);
      move_all(to);
      if (to != from && smallest_angle(elements) >= least) return true;
    }
    move_all(from);
    return false;
  }

  Point nearest_on_surface(const Point& point) const {
    NearestOfTriangles nearest(point);
    for (const Triangle& t : triangles_) {
      const auto corner = [&](std::size_t i) { return load3(rest_[static_cast<std::size_t>(t[i])].data()); };
      nearest.take(corner(0), corner(1), corner(2));
    }
    return nearest.point();
  }

  double smallest_angle(const std::vector<std::size_t>& elements) const {
    double least = 180;
    for (const std::size_t e : elements) least = std::min(least, shape_of(mesh_, e).smallest_dihedral);
    return least;
  }

  void measure() {
    std::map<std::int32_t, double> distances;  // by the node at rest
    for (const Triangle& t : lips()) {
      const auto side = [&](int i) {
        Point s;
        for (std::size_t d = 0; d < 3; ++d) s[d] = at(t[static_cast<std::size_t>(i)])[d] - at(t[0])[d];
        return s;
      };
      const Point a = side(1), b = side(2);
      report_.area += std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]) / 4;
      for (const std::int32_t n : t) {
        const Point near = nearest_on_path(path_, at(n));
        distances[cut_.at_rest(n)] = std::hypot(near[0] - at(n)[0], near[1] - at(n)[1], near[2] - at(n)[2]);
      }
    }
    for (const auto& [node, distance] : distances) {
      report_.mean_distance += distance / static_cast<double>(distances.size());
      report_.worst_distance = std::max(report_.worst_distance, distance);
    }
  }

  std::vector<std::size_t> piece_sizes() const {
    std::vector<std::size_t> sizes;
    for (std::int32_t i = 0; i < cut_.pieces().count(); ++i)
      if (cut_.pieces().piece(i).tetrahedra > 0)
        sizes.push_back(static_cast<std::size_t>(cut_.pieces().piece(i).tetrahedra));
    std::ranges::sort(sizes, std::greater<>());
    return sizes;
  }

  void drop_small_pieces() {
    std::int32_t largest = 0;
    for (std::int32_t i = 0; i < cut_.pieces().count(); ++i)
      if (cut_.pieces().piece(i).tetrahedra > cut_.pieces().piece(largest).tetrahedra) largest = i;
    std::vector<std::int32_t> number(mesh_.nodes.size(), -1);
    TetrahedralMesh kept;
    kept.region_names = mesh_.region_names;
    for (std::size_t e = 0; e < mesh_.tetrahedra.size(); ++e) {
      if (cut_.pieces().piece_of(static_cast<std::int32_t>(e)) != largest) continue;
      kept.tetrahedra.push_back(mesh_.tetrahedra[e]), kept.region.push_back(mesh_.region[e]);
      for (const std::int32_t n : mesh_.tetrahedra[e]) number[static_cast<std::size_t>(n)] = 0;
    }
    for (std::size_t n = 0; n < number.size(); ++n)
      if (number[n] == 0)
        number[n] = static_cast<std::int32_t>(kept.nodes.size()), kept.nodes.push_back(mesh_.nodes[n]);
    const auto renumber = [&](auto& nodes) {
      for (std::int32_t& n : nodes) n = number[static_cast<std::size_t>(n)];
    };
    for (auto& nodes : kept.tetrahedra) renumber(nodes);
    for (TetrahedralMesh::Patch& patch : mesh_.patches) {
      std::erase_if(patch.triangles, [&](const Triangle& t) {
        return std::ranges::any_of(t, [&](std::int32_t n) { return number[static_cast<std::size_t>(n)] < 0; });
      });
      for (Triangle& t : patch.triangles) renumber(t);
      if (!patch.triangles.empty()) kept.patches.push_back(std::move(patch));
    }
    mesh_ = std::move(kept);
  }

  Point& at(std::int32_t node) { return mesh_.nodes[static_cast<std::size_t>(node)]; }

  TetrahedralMesh& mesh_;
  const BladePath& path_;
  const std::vector<Triangle> triangles_;
  const std::vector<Point> rest_;
  SceneMemory memory_{palpate_allocator{}};
  CutMesh cut_;
  CutReport report_;
};

}  // namespace

CutReport cut_by_blade(TetrahedralMesh& mesh, const BladePath& path, bool largest_piece, double min_dihedral) {
  return Cutter(mesh, path).cut(largest_piece, min_dihedral);
}

}  // namespace palpate
