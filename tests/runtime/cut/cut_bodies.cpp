#include "tests/runtime/cut/cut_bodies.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace palpate::tests {
namespace {

using Triangle = std::array<std::int32_t, 3>;

Triangle corners_of(const std::int32_t* nodes, int face) {
  // Counter-clockwise from outside, by the sides of a tetrahedron whose volume is above 0.
  static constexpr int kAt[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  return {nodes[kAt[face][0]], nodes[kAt[face][1]], nodes[kAt[face][2]]};
}
Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

struct Joined {
  explicit Joined(std::size_t count) : parent(count) { std::iota(parent.begin(), parent.end(), std::size_t{0}); }
  std::size_t find(std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parent[find(a)] = find(b); }
  std::vector<std::size_t> parent;
};

// Face of each tetrahedron -> the same face of the other one.
std::map<std::int32_t, std::int32_t> sides_of(const BodyToCut& body) {
  std::map<Triangle, std::int32_t> first;
  std::map<std::int32_t, std::int32_t> sides;
  for (std::int32_t f = 0; f < 4 * body.tetrahedron_count(); ++f) {
    const auto [at, is_new] = first.emplace(sorted(corners_of(body.tetrahedra.data() + 4 * (f / 4), f % 4)), f);
    if (!is_new) sides[f] = at->second, sides[at->second] = f;
  }
  return sides;
}

// Closed, oriented, one fan at each node, no two triangles with the same nodes.
std::string fault_of_surface(const std::vector<Triangle>& triangles) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> edges;
  std::set<Triangle> nodes;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!nodes.insert(sorted(triangles[i])).second) return "two triangles have the same nodes";
    for (std::size_t c = 0; c < 3; ++c)
      if (!edges.emplace(std::pair{triangles[i][c], triangles[i][(c + 1) % 3]}, i).second)
        return "an edge runs twice in one sense";
  }
  std::map<std::int32_t, std::pair<std::size_t, std::size_t>> around;  // node: how many triangles, one of them
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const std::int32_t node : triangles[i]) ++around[node].first, around[node].second = i;
  for (const auto& [edge, i] : edges)
    if (!edges.count({edge.second, edge.first})) return "the surface is open at an edge";
  for (const auto& [node, of] : around) {
    std::size_t at = of.second, passed = 0;
    do {
      std::size_t c = 0;
      while (triangles[at][c] != node) ++c;
      at = edges.at({node, triangles[at][(c + 2) % 3]});
      ++passed;
    } while (at != of.second && passed <= of.first);
    if (passed != of.first) return "a node has several fans";
  }
  return {};
}

}  // namespace

CutBody BodyToCut::view() const {
  return {nodes.data(),
          node_count(),
          tetrahedra.data(),
          tetrahedron_count(),
          triangles.data(),
          static_cast<std::int32_t>(triangles.size() / 3),
          held.empty() ? nullptr : held.data(),
          dividable.empty() ? nullptr : dividable.data(),
          support.empty() ? nullptr : support.data()};
}

std::vector<std::int32_t> BodyToCut::inner_faces() const {
  std::vector<std::int32_t> faces;
  for (const auto& [one, two] : sides_of(*this))
    if (one < two) faces.push_back(one);
  return faces;
}

BodyToCut body_of(std::vector<double> nodes, std::vector<std::int32_t> tetrahedra) {
  BodyToCut body{std::move(nodes), std::move(tetrahedra), {}, {}, {}, {}};
  const auto sides = sides_of(body);
  for (std::int32_t f = 0; f < 4 * body.tetrahedron_count(); ++f)
    if (!sides.count(f))
      for (const std::int32_t node : corners_of(body.tetrahedra.data() + 4 * (f / 4), f % 4))
        body.triangles.push_back(node);
  body.held.assign(body.nodes.size() / 3, 0);
  return body;
}

BodyToCut block_to_cut(int nx, int ny, int nz, double jitter, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> move(-jitter, jitter);
  const std::array<int, 3> cells{nx, ny, nz};
  std::vector<double> nodes;
  for (int z = 0; z <= nz; ++z)
    for (int y = 0; y <= ny; ++y)
      for (int x = 0; x <= nx; ++x) {
        const std::array<int, 3> at{x, y, z};
        for (std::size_t d = 0; d < 3; ++d) {
          const double by = move(random);
          nodes.push_back(at[d] + (at[d] > 0 && at[d] < cells[d] ? by : 0));
        }
      }
  std::vector<std::int32_t> tetrahedra;
  const auto node = [&](int x, int y, int z) { return x + (nx + 1) * (y + (ny + 1) * z); };
  std::array<int, 3> axes{0, 1, 2};
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) do {
          std::array<int, 3> at{x, y, z};
          std::array<std::int32_t, 4> corners{node(x, y, z)};
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(axes[step])];
            corners[step + 1] = node(at[0], at[1], at[2]);
          }
          const bool turned = (axes[1] + 3 - axes[0]) % 3 != 1;
          if (turned) std::swap(corners[1], corners[2]);
          tetrahedra.insert(tetrahedra.end(), corners.begin(), corners.end());
        } while (std::next_permutation(axes.begin(), axes.end()));
  return body_of(std::move(nodes), std::move(tetrahedra));
}

BodyToCut lattice_to_cut(int nx, int ny, int nz, double jitter, std::uint64_t seed) {
  std::vector<double> nodes = block_to_cut(nx, ny, nz, jitter, seed).nodes;
  const std::array<int, 3> cells{nx, ny, nz};
  const auto corners = static_cast<std::int32_t>(nodes.size() / 3);
  const auto corner = [&](std::array<int, 3> at) { return at[0] + (nx + 1) * (at[1] + (ny + 1) * at[2]); };
  const auto centre = [&](std::array<int, 3> at) { return corners + at[0] + nx * (at[1] + ny * at[2]); };
  std::vector<std::int32_t> tetrahedra;
  const auto add = [&](std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
    tetrahedra.insert(tetrahedra.end(), {a, b, c, d});
  };
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) nodes.insert(nodes.end(), {x + 0.5, y + 0.5, z + 0.5});
  std::array<int, 3> at{};
  for (at[2] = 0; at[2] < nz; ++at[2])
    for (at[1] = 0; at[1] < ny; ++at[1])
      for (at[0] = 0; at[0] < nx; ++at[0])
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (int side = 0; side < 2; ++side) {
            std::array<std::int32_t, 4> ring{};  // of the cell's face, counter-clockwise from outside
            for (int i = 0; i < 4; ++i) {
              std::array<int, 3> c = at;
              const int turn = side ? i : 3 - i;
              c[axis] += side, c[(axis + 1) % 3] += turn == 1 || turn == 2, c[(axis + 2) % 3] += turn > 1;
              ring[static_cast<std::size_t>(i)] = corner(c);
            }
            std::array<int, 3> beyond = at;
            beyond[axis] += side ? 1 : -1;
            const std::int32_t middle = centre(at);
            if (beyond[axis] < 0 || beyond[axis] == cells[axis])
              add(middle, ring[0], ring[1], ring[2]), add(middle, ring[0], ring[2], ring[3]);
            else if (side)
              for (std::size_t i = 0; i < 4; ++i) add(middle, ring[i], ring[(i + 1) % 4], centre(beyond));
          }
  return body_of(std::move(nodes), std::move(tetrahedra));
}

BodyToCut octahedron() {
  std::vector<std::int32_t> tetrahedra;
  for (const int x : {1, 2})
    for (const int y : {3, 4})
      for (const int z : {5, 6}) {
        const bool turned = (x + y + z) % 2 == 0;
        tetrahedra.insert(tetrahedra.end(), {0, turned ? y : x, turned ? x : y, z});
      }
  return body_of({0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1}, std::move(tetrahedra));
}

CutPlay::CutPlay(const BodyToCut& of, std::int32_t reserve) : body(of), positions(of.nodes) {
  if (const char* const wrong = mesh.create(memory, of.view(), reserve)) throw std::runtime_error(wrong);
}

const CutMeshChange& CutPlay::sweep(const std::array<double, 6>& from, const std::array<double, 6>& to) {
  const CutMeshChange& change = mesh.blade({from.data(), to.data(), 2}, positions.data());
  follow();
  return change;
}

void CutPlay::follow() {
  for (std::int32_t n = static_cast<std::int32_t>(positions.size() / 3); n < mesh.nodes(); ++n)
    for (std::size_t d = 0; d < 3; ++d) positions.push_back(positions[3 * static_cast<std::size_t>(mesh.from(n)) + d]);
}

std::string fault_of(const BodyToCut& body, const std::set<std::int32_t>& cut, const std::set<std::int32_t>& removed) {
  const auto sides = sides_of(body);
  const auto is_open = [&](std::int32_t face) {
    const auto other = sides.find(face);
    return other == sides.end() || cut.count(face) || cut.count(other->second) || removed.count(other->second / 4);
  };
  Joined corners(4 * static_cast<std::size_t>(body.tetrahedron_count()));
  for (const auto& [one, two] : sides) {
    if (is_open(one) || removed.count(one / 4)) continue;
    for (std::int32_t c = 4 * (one / 4); c < 4 * (one / 4) + 4; ++c)
      for (std::int32_t d = 4 * (two / 4); d < 4 * (two / 4) + 4; ++d)
        if (body.tetrahedra[static_cast<std::size_t>(c)] == body.tetrahedra[static_cast<std::size_t>(d)])
          corners.join(static_cast<std::size_t>(c), static_cast<std::size_t>(d));
  }
  std::vector<Triangle> surface;
  for (std::int32_t f = 0; f < 4 * body.tetrahedron_count(); ++f) {
    if (removed.count(f / 4) || !is_open(f)) continue;
    std::int32_t nodes[4];
    for (int c = 0; c < 4; ++c)
      nodes[c] = static_cast<std::int32_t>(corners.find(static_cast<std::size_t>(4 * (f / 4) + c)));
    surface.push_back(corners_of(nodes, f % 4));
  }
  return fault_of_surface(surface);
}

namespace {

std::string fault_of_nodes(const CutPlay& play) {
  const CutMesh& mesh = play.mesh;
  const auto sides = sides_of(play.body);
  const auto corners = 4 * static_cast<std::size_t>(play.body.tetrahedron_count());
  Joined joined(corners), pieces(corners / 4);
  for (const auto& [one, two] : sides) {
    if (mesh.is_removed(one / 4) || mesh.is_removed(two / 4) || mesh.state().face(one) == FaceState::cut) continue;
    pieces.join(static_cast<std::size_t>(one / 4), static_cast<std::size_t>(two / 4));
    for (std::int32_t c = 4 * (one / 4); c < 4 * (one / 4) + 4; ++c)
      for (std::int32_t d = 4 * (two / 4); d < 4 * (two / 4) + 4; ++d)
        if (c != one && d != two &&
            play.body.tetrahedra[static_cast<std::size_t>(c)] == play.body.tetrahedra[static_cast<std::size_t>(d)])
          joined.join(static_cast<std::size_t>(c), static_cast<std::size_t>(d));
  }
  std::map<std::size_t, std::int32_t> node_of, piece_of;
  std::set<std::int32_t> used, used_pieces;
  for (std::size_t c = 0; c < corners; ++c) {
    const auto t = static_cast<std::int32_t>(c / 4);
    if (mesh.is_removed(t)) continue;
    const std::int32_t node = mesh.nodes_of(t)[c % 4], piece = mesh.pieces().piece_of(t);
    if (mesh.at_rest(node) != play.body.tetrahedra[c]) return "a corner has a node of another place";
    if (node_of.emplace(joined.find(c), node).first->second != node) return "a component has two nodes";
    if (piece_of.emplace(pieces.find(c / 4), piece).first->second != piece)
      return "tetrahedra that are connected are in two pieces";
    used.insert(node), used_pieces.insert(piece);
  }
  if (used.size() != node_of.size()) return "two components share a node";
  if (used_pieces.size() != piece_of.size()) return "two pieces share a number";
  return {};
}

}  // namespace

std::string fault_of(const CutPlay& play) {
  const CutMesh& mesh = play.mesh;
  if (std::string fault = fault_of_nodes(play); !fault.empty()) return fault;
  std::vector<Triangle> surface;
  std::int32_t open = 0;
  for (std::int32_t i = 0; i < mesh.surface().count(); ++i) {
    const std::int32_t face = mesh.surface().face(i);
    if (face < 0) continue;
    if (mesh.is_removed(face / 4)) return "a triangle belongs to a tetrahedron that is removed";
    if (mesh.surface().triangle(face) != i) return "a face has another triangle";
    Triangle nodes;
    mesh.surface().nodes(i, nodes.data());
    Triangle expected = corners_of(mesh.nodes_of(face / 4), face % 4);
    std::rotate(expected.begin(), std::find(expected.begin(), expected.end(), nodes[0]), expected.end());
    if (nodes != expected) return "a triangle has other nodes than its face";
    surface.push_back(nodes);
  }
  const auto sides = sides_of(play.body);
  for (std::int32_t f = 0; f < 4 * play.body.tetrahedron_count(); ++f) {
    const auto other = sides.find(f);
    const bool is_open =
        other == sides.end() || mesh.state().face(f) == FaceState::cut || mesh.is_removed(other->second / 4);
    open += !mesh.is_removed(f / 4) && is_open;
  }
  if (open != static_cast<std::int32_t>(surface.size())) return "an open face has no triangle";
  return fault_of_surface(surface);
}

// ---- random cuts --------------------------------------------------------------------------------------------------

RandomCuts::RandomCuts(std::uint64_t seed)
    : body(block_to_cut(3 + static_cast<int>(seed % 3), 3 + static_cast<int>(seed / 3 % 2),
                        2 + static_cast<int>(seed / 6 % 3), seed % 4 == 0 ? 0 : 0.2, seed)),
      play(body, seed % 5 == 0 ? 40 : 1 << 14),
      random(seed) {}

void RandomCuts::begin_stroke() {
  std::uniform_real_distribution<double> unit(-1, 1), share(0, 1);
  const auto cells = body.nodes.end() - 3;  // the last node is the corner that is farthest from (0, 0, 0)
  left = 4 + static_cast<int>(24 * share(random));
  const double speed = share(random) < 0.2 ? 2 : 0.3;
  // Some strokes run along planes of faces exactly.
  const bool exact = share(random) < 0.25;
  std::array<double, 3> along{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double at = cells[static_cast<std::ptrdiff_t>(d)] * share(random);
    blade[d] = exact ? std::floor(at) : at, along[d] = unit(random), velocity[d] = speed * unit(random);
  }
  if (exact) along = {}, velocity = {}, along[random() % 3] = 3, velocity[random() % 3] = speed;
  for (std::size_t d = 0; d < 3; ++d) {
    blade[d] -= velocity[d] * left / 2 + along[d];
    blade[3 + d] = blade[d] + 3 * along[d];
  }
}

// The lips move apart, each node by its own small way: positions are those of a body that is pulled.
void RandomCuts::open() {
  std::uniform_real_distribution<double> way(-0.02, 0.02);
  for (std::size_t i = 0; i < play.positions.size(); ++i)
    play.positions[i] =
        0.9 * play.positions[i] + way(random) +
        0.1 * body.nodes[3 * static_cast<std::size_t>(play.mesh.at_rest(static_cast<std::int32_t>(i / 3))) + i % 3];
}

std::string RandomCuts::step() {
  std::uniform_real_distribution<double> share(0, 1);
  if (left-- <= 0) begin_stroke();
  const CutMeshChange* change = nullptr;
  if (share(random) < 0.02) {
    const std::array<double, 3> centre{blade[0], blade[1], blade[2]};
    change = &play.mesh.remove_ball(centre.data(), 0.3 + 0.5 * share(random), play.positions.data());
  } else {
    std::array<double, 6> to = blade;
    for (std::size_t d = 0; d < 6; ++d) to[d] += velocity[d % 3];
    if (share(random) < 0.1) to = blade;
    change = &play.mesh.blade({blade.data(), to.data(), 2}, play.positions.data());
    blade = to;
  }
  cut_faces += change->cut_faces, removed += change->removed_tetrahedra.count;
  severed += change->end_piece - change->first_piece, full += change->full;
  play.follow();
  if (share(random) < 0.5) open();
  return fault_of(play);
}

}  // namespace palpate::tests
