// What a blade costs and how its cuts look. Plays strokes of a blade through meshes at rest:
//
//   cut_bench MESH.msh [MESH.msh ...] [--strokes=60]
//
// Prints for each mesh the time of a step, as a ratio to one pass that adds up the positions of all nodes, and what a user sees of cuts that
// part the mesh: how far their lips lie from the blade's plane, the new nodes, the faces that wait; beside them what dividing the tetrahedra
// along that plane would give. And what it costs that the surface's tree, index and measure follow a step that cuts, as a ratio to building them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/cut_triangles.h"
#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_measure.h"
#include "runtime/surface/surface_tree.h"
#include "studies/timing/timing.h"

namespace {

using palpate::Vec3;

struct Mesh {
  std::vector<double> nodes;
  std::vector<std::int32_t> tetrahedra, triangles;
  Vec3 middle;
  double edge = 0, radius = 0;  // mm: mean length of an edge; of a ball around all

  explicit Mesh(const char* file) {
    const palpate::TetrahedralMesh mesh = palpate::read_mesh(file);
    for (const auto& node : mesh.nodes) nodes.insert(nodes.end(), node.begin(), node.end());
    for (const auto& t : mesh.tetrahedra) tetrahedra.insert(tetrahedra.end(), t.begin(), t.end());
    for (const auto& t : palpate::boundary_triangles(mesh)) triangles.insert(triangles.end(), t.begin(), t.end());
    Vec3 low = at(0), high = at(0);
    for (std::size_t n = 0; n < nodes.size() / 3; ++n)
      for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], at(n)[d]), high[d] = std::max(high[d], at(n)[d]);
    middle = 0.5 * (low + high), radius = 0.5 * length(high - low);
    std::size_t count = 0;
    for (std::size_t t = 0; t < tetrahedra.size(); t += 4)
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = 0; b < a; ++b, ++count) edge += length(corner(t + a) - corner(t + b));
    edge /= static_cast<double>(count);
  }
  Vec3 at(std::size_t node) const { return palpate::load3(nodes.data() + 3 * node); }
  Vec3 corner(std::size_t corner) const { return at(static_cast<std::size_t>(tetrahedra[corner])); }
  palpate::CutBody body() const {
    return {nodes.data(),
            static_cast<std::int32_t>(nodes.size() / 3),
            tetrahedra.data(),
            static_cast<std::int32_t>(tetrahedra.size() / 4),
            triangles.data(),
            static_cast<std::int32_t>(triangles.size() / 3),
            nullptr};
  }
};

// A plane by a point, its normal, and the two directions in it: the blade's line lies along `line` and moves along `way`.
struct Plane {
  Vec3 point, normal, line, way;
  double from(Vec3 p) const { return dot(p - point, normal); }
};

Plane random_plane(const Mesh& mesh, std::mt19937_64& random) {
  std::normal_distribution<double> any;
  std::uniform_real_distribution<double> share(-0.25, 0.25);
  const auto direction = [&] { return palpate::unit_or_zero({any(random), any(random), any(random)}); };
  Plane plane{mesh.middle, direction(), {}, {}};
  plane.point += mesh.radius * share(random) * plane.normal;
  plane.line = palpate::unit_or_zero(cross(plane.normal, direction()));
  plane.way = cross(plane.normal, plane.line);
  return plane;
}

double smallest_dihedral(const Vec3 p[4]) {
  double smallest = 180;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < a; ++b) {
      int c = 0, d = 3;
      while (c == a || c == b) ++c;
      while (d == a || d == b) --d;
      const Vec3 along = p[b] - p[a], one = cross(along, p[c] - p[a]), two = cross(along, p[d] - p[a]);
      if (!(length(one) > 0 && length(two) > 0)) return 0;
      const double cosine = dot(one, two) / (length(one) * length(two));
      smallest = std::min(smallest, std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi);
    }
  return smallest;
}

// The tetrahedra of a mesh that are divided along a plane.
struct Divided {
  double area = 0;                              // mm^2 of the plane in the mesh
  std::set<std::array<std::int32_t, 2>> edges;  // that the plane crosses
  std::vector<double> angles;                   // degrees: the smallest dihedral angle of each tetrahedron of the parts

  void add(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 p[4] = {a, b, c, d};
    angles.push_back(smallest_dihedral(p));
  }
  // A prism of the triangles a and b.
  void add_prism(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b) {
    add(a[0], a[1], a[2], b[2]), add(a[0], a[1], b[1], b[2]), add(a[0], b[0], b[1], b[2]);
  }
  static double area_of(Vec3 a, Vec3 b, Vec3 c) { return 0.5 * length(cross(b - a, c - a)); }
};

void divide(const Mesh& mesh, std::size_t first, const Plane& plane, Divided* out) {
  std::array<std::size_t, 4> at{first, first + 1, first + 2, first + 3};
  const auto height = [&](std::size_t c) { return plane.from(mesh.corner(c)); };
  std::sort(at.begin(), at.end(), [&](std::size_t a, std::size_t b) { return height(a) < height(b); });
  const auto below = std::count_if(at.begin(), at.end(), [&](std::size_t c) { return height(c) < 0; });
  if (below == 0 || below == 4) return;
  const auto between = [&](std::size_t i, std::size_t j) {
    const auto a = mesh.tetrahedra[at[i]], b = mesh.tetrahedra[at[j]];
    out->edges.insert({std::min(a, b), std::max(a, b)});
    const double ha = height(at[i]), hb = height(at[j]);
    return mesh.corner(at[i]) + (ha / (ha - hb)) * (mesh.corner(at[j]) - mesh.corner(at[i]));
  };
  const auto node = [&](std::size_t i) { return mesh.corner(at[i]); };
  if (below == 2) {
    const Vec3 a = between(0, 2), b = between(0, 3), c = between(1, 3), d = between(1, 2);
    out->area += Divided::area_of(a, b, c) + Divided::area_of(a, c, d);
    out->add_prism({node(0), a, b}, {node(1), d, c});
    out->add_prism({node(2), a, d}, {node(3), b, c});
    return;
  }
  const std::size_t tip = below == 1 ? 0 : 3, base = below == 1 ? 1 : 0;
  const std::array<Vec3, 3> middle{between(tip, base), between(tip, base + 1), between(tip, base + 2)};
  out->area += Divided::area_of(middle[0], middle[1], middle[2]);
  out->add(node(tip), middle[0], middle[1], middle[2]);
  out->add_prism(middle, {node(base), node(base + 1), node(base + 2)});
}

using palpate::studies::percentile;
using palpate::studies::thread_seconds;

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

// What searches the surface of a scene.
struct Searches {
  double build(palpate::SceneMemory& memory, const std::vector<double>& rest, const std::int32_t* triangles,
               std::int32_t count, const std::uint8_t* active) {
    const double begin = thread_seconds();
    const auto nodes = static_cast<std::int32_t>(rest.size() / 3);
    tree.build(memory, rest.data(), nodes, triangles, count, active);
    index.build(memory, rest.data(), triangles, count, active);
    measure.build(memory, rest.data(), nodes, triangles, count, active);
    return 1e6 * (thread_seconds() - begin);
  }
  double change(const palpate::CutTriangles& slots) {
    const double begin = thread_seconds();
    tree.change(slots.changed(), slots.changed_count());
    index.change(slots.changed(), slots.changed_count());
    measure.change(tree.fans());
    return 1e6 * (thread_seconds() - begin);
  }
  palpate::SurfaceTree tree;
  palpate::SurfaceIndex index;
  palpate::SurfaceMeasure measure;
};

constexpr std::int32_t kReserve = 1 << 14;

struct Seen {
  std::vector<double> build, follow, changed;  // us of the surface's searches; triangles of a step
  std::vector<double> step, cutting, way, nodes_per_cm2, divided_per_cm2, angles;
  std::vector<double> splinter;         // tetrahedra of each
  std::vector<double> lips, worst_lip;  // from the plane, in edges
  long strokes = 0, waiting = 0, waits = 0, parted = 0, splinters = 0, cut = 0;
};

// One stroke through the whole mesh. half: of the blade's length, mm; speed: mm a step.
void play_stroke(const Mesh& mesh, const Plane& plane, double half, double speed, Seen* seen) {
  palpate::SceneMemory memory{palpate_allocator{}};
  static palpate::CutMesh cut;
  cut = {};
  if (const char* const wrong = cut.create(memory, mesh.body(), kReserve)) {
    std::fprintf(stderr, "cut_bench: %s\n", wrong);
    std::exit(2);
  }
  std::vector<double> positions = mesh.nodes, rest = mesh.nodes;
  rest.resize(rest.size() + 3 * std::size_t{kReserve});
  palpate::CutTriangles slots;
  Searches searches;
  slots.create(memory, cut, mesh.body());
  {
    palpate::SceneMemory alone{palpate_allocator{}};
    seen->build.push_back(
        Searches().build(alone, mesh.nodes, mesh.triangles.data(), mesh.body().triangle_count, nullptr));
    alone.release_all();
  }
  searches.build(memory, rest, slots.triangles(), slots.count(), slots.active());
  const auto follow = [&] {
    slots.follow(cut);
    for (std::int32_t n = cut.change().first_node; n < cut.change().end_node; ++n)
      palpate::store3(mesh.at(static_cast<std::size_t>(cut.at_rest(n))), rest.data() + 3 * static_cast<std::size_t>(n));
    const double us = searches.change(slots);
    if (slots.changed_count() > 0) seen->follow.push_back(us), seen->changed.push_back(slots.changed_count());
    for (auto n = static_cast<std::int32_t>(positions.size() / 3); n < cut.nodes(); ++n)
      for (std::size_t d = 0; d < 3; ++d) positions.push_back(positions[3 * static_cast<std::size_t>(cut.from(n)) + d]);
  };
  std::array<double, 6> from, to;
  const auto place = [&](double way, std::array<double, 6>* blade) {
    for (const double side : {-1.0, 1.0}) {
      const Vec3 p = plane.point + side * half * plane.line + way * plane.way;
      palpate::store3(p, blade->data() + (side > 0 ? 3 : 0));
    }
  };
  place(-1.2 * mesh.radius, &from);
  for (double way = -1.2 * mesh.radius; way < 1.3 * mesh.radius; way += speed, from = to) {
    place(way + speed, &to);
    const double begin = thread_seconds();
    const palpate::CutMeshChange& change = cut.blade({from.data(), to.data(), 2}, positions.data());
    const double us = 1e6 * (thread_seconds() - begin);
    seen->step.push_back(us);
    if (change.cut_faces > 0) seen->cutting.push_back(us);
    seen->cut += change.cut_faces;
    follow();
  }
  // Finishes what the last step has left.
  for (int i = 0; i < 100; ++i) cut.blade({to.data(), to.data(), 2}, positions.data()), follow();
  Divided divided;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); t += 4) divide(mesh, t, plane, &divided);
  const double cm2 = divided.area / 100;
  ++seen->strokes, seen->waiting += cut.pending(), seen->waits += cut.pending() > 0;
  std::vector<double> pieces;
  for (std::int32_t i = 0; i < cut.pieces().count(); ++i) pieces.push_back(cut.pieces().piece(i).tetrahedra);
  std::sort(pieces.rbegin(), pieces.rend());
  seen->parted += pieces.size() > 1;
  for (std::size_t i = 2; i < pieces.size(); ++i) ++seen->splinters, seen->splinter.push_back(pieces[i]);
  seen->nodes_per_cm2.push_back((cut.nodes() - mesh.body().node_count) / cm2);
  seen->divided_per_cm2.push_back(2 * static_cast<double>(divided.edges.size()) / cm2);
  seen->angles.insert(seen->angles.end(), divided.angles.begin(), divided.angles.end());
  double worst = 0;
  for (std::int32_t i = mesh.body().triangle_count; i < cut.surface().count(); ++i) {
    std::int32_t nodes[3];
    cut.surface().nodes(i, nodes);
    for (const std::int32_t node : nodes) {
      const double away = std::fabs(plane.from(palpate::load3(positions.data() + 3 * node))) / mesh.edge;
      seen->lips.push_back(away);
      worst = std::max(worst, away);
    }
  }
  seen->worst_lip.push_back(worst);
  memory.release_all();
}

void report_strokes(const Mesh& mesh, int strokes, double blade, double speed, double pass) {
  std::mt19937_64 random(7);
  Seen seen;
  const int played = speed < 1 ? strokes / 6 : strokes;
  for (int i = 0; i < played; ++i) play_stroke(mesh, random_plane(mesh, random), 0.5 * blade, speed, &seen);
  std::printf("  blade of %.0f mm, %g mm a step, %d strokes\n", blade, speed, played);
  const auto times = [&](const char* what, const std::vector<double>& us) {
    const double median = percentile(us, 0.5), high = percentile(us, 0.99), worst = percentile(us, 1);
    std::printf("    %s: %.1f us (median), %.0f (99 %%), %.0f (worst); %.1f, %.0f and %.0f passes\n", what, median,
                high, worst, median / pass, high / pass, worst / pass);
  };
  times("a step", seen.step);
  times("a step that cuts", seen.cutting);
  const double whole = percentile(seen.build, 0.5), median = percentile(seen.follow, 0.5),
               high = percentile(seen.follow, 0.99), most = percentile(seen.follow, 1);
  std::printf(
      "    the surface follows %.0f triangles (median), %.0f (99 %%): %.1f us (median), %.0f (99 %%), %.0f (worst);\n"
      "      building it takes %.0f us, %.0f, %.1f and %.1f times as long\n",
      percentile(seen.changed, 0.5), percentile(seen.changed, 0.99), median, high, most, whole, whole / median,
      whole / high, whole / most);
  std::printf(
      "    faces that wait: %ld of %ld, in %ld strokes; parted: %ld of %ld, with %ld splinters of %.1f tetrahedra\n",
      seen.waiting, seen.waiting + seen.cut, seen.waits, seen.parted, seen.strokes, seen.splinters,
      mean(seen.splinter));
  if (blade < mesh.radius) return;
  std::printf("    lips off the plane, in edges: mean %.2f, 95 %% %.2f, worst %.2f; new nodes: %.1f a cm^2\n",
              mean(seen.lips), percentile(seen.lips, 0.95), percentile(seen.worst_lip, 1), mean(seen.nodes_per_cm2));
  std::printf("    divided tetrahedra: new nodes: %.1f a cm^2; smallest dihedral angle %.4f degrees (1 %%: %.2f)\n",
              mean(seen.divided_per_cm2), percentile(seen.angles, 1e-9), percentile(seen.angles, 0.01));
}

void report(const char* file, int strokes) {
  const Mesh mesh(file);
  std::vector<double> reference;
  double sum = 0;
  for (int i = 0; i < 2000; ++i) {
    const double begin = thread_seconds();
    Vec3 all;
    for (std::size_t n = 0; n < mesh.nodes.size() / 3; ++n) all += mesh.at(n);
    reference.push_back(1e6 * (thread_seconds() - begin));
    sum += all.x;
  }
  const double pass = percentile(reference, 0.5);
  std::printf("%s: %zu nodes, %zu tetrahedra, edges of %.1f mm (%.0f)\n  a pass over the positions: %.1f us\n", file,
              mesh.nodes.size() / 3, mesh.tetrahedra.size() / 4, mesh.edge, std::fmod(sum, 2), pass);
  std::vector<double> own;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); t += 4) {
    const Vec3 p[4] = {mesh.corner(t), mesh.corner(t + 1), mesh.corner(t + 2), mesh.corner(t + 3)};
    own.push_back(smallest_dihedral(p));
  }
  std::printf("  smallest dihedral angle of a tetrahedron %.1f degrees (1 %%: %.1f)\n", percentile(own, 1e-9),
              percentile(own, 0.01));
  for (const double blade : {30.0, 3 * mesh.radius})
    for (const double speed : {0.1, 2.0, 1e4}) report_strokes(mesh, strokes, blade, speed, pass);
}

}  // namespace

int main(int argc, char** argv) {
  int strokes = 60, meshes = 0;
  for (int a = 1; a < argc; ++a)
    if (std::strncmp(argv[a], "--strokes=", 10) == 0) strokes = std::atoi(argv[a] + 10);
  for (int a = 1; a < argc; ++a)
    if (argv[a][0] != '-') report(argv[a], strokes), ++meshes;
  return meshes > 0 ? 0 : (std::fprintf(stderr, "cut_bench: expected MESH.msh [MESH.msh ...] [--strokes=N]\n"), 2);
}
