// Tools that cross a closed surface through vertices, edges and faces, at any speed, or miss it.
#include <numeric>
#include <random>

#include "runtime/surface/surface_index.h"
#include "tests/runtime/two_discs.h"
#include "tests/stability/stability_case.h"
#include "tests/support/closed_surfaces.h"
#include "tests/support/rest_surface.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

struct Indexed {
  explicit Indexed(TriangleSurface of)
      : surface(std::move(of)),
        rest(surface.points[0].data(), static_cast<std::int32_t>(surface.points.size()), surface.triangles[0].data(),
             static_cast<std::int32_t>(surface.triangles.size())) {}
  TriangleSurface surface;
  RestSurface rest;
};

// A sphere with bumps so deep that a segment may cross the surface many times.
TriangleSurface bumpy(TriangleSurface surface) {
  for (Point& p : surface.points) p = (1 + 0.3 * std::sin(7 * p[0]) * std::cos(6 * p[1] + p[2])) * p;
  return surface;
}
// Every coordinate a multiple of 1/64: segments between such points meet vertices and edges exactly.
TriangleSurface on_lattice(TriangleSurface surface) {
  for (Point& p : surface.points)
    for (double& x : p) x = std::round(64 * x) / 64;
  return surface;
}
// A sphere whose points are drawn towards the pole z = 1: the shortest edges are 1e-4 of the longest.
TriangleSurface graded(TriangleSurface surface) {
  for (Point& p : surface.points) {
    const double polar = std::numbers::pi * std::pow(std::acos(std::clamp(p[2], -1.0, 1.0)) / std::numbers::pi, 4);
    const double around = std::atan2(p[1], p[0]);
    p = {std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), std::cos(polar)};
  }
  return surface;
}

bool on_surface(RestSurface& rest, Vec3 p) {
  return rest.distance(p) < 1e-12;
}

// Counts segments whose crossings are wrong: missed or counted twice (parity), out of order, or different in reverse.
struct Contradictions {
  long segments = 0, crossings = 0, parity = 0, order = 0, reversed = 0;
};
template <class Ends>
Contradictions cross(RestSurface& rest, long count, Ends ends) {
  Contradictions found;
  SurfaceCrossing there[DeformedSurface::kMaxCrossings], back[DeformedSurface::kMaxCrossings];
  for (found.segments = 0; found.segments < count; ++found.segments) {
    const auto [a, b] = ends();
    const int n = rest.crossings(a, b, there);
    const bool a_inside = rest.inside(a), b_inside = rest.inside(b);
    found.crossings += n;
    found.parity += (n % 2 == 1) != (a_inside != b_inside);
    // At a vertex or an edge several crossings have the same time, in an order given by rounding: they are judged together.
    bool ordered = true;
    const int kept = std::min(n, DeformedSurface::kMaxCrossings);
    for (int c = 0, depth = a_inside; c < kept; ++c) {
      depth += there[c].entering ? 1 : -1;
      ordered = ordered && (c == 0 || there[c].time >= there[c - 1].time);
      if (c + 1 == kept || there[c + 1].time > there[c].time + 1e-12) ordered = ordered && (depth == 0 || depth == 1);
    }
    found.order += !ordered;
    found.reversed += rest.crossings(b, a, back) != n;
  }
  return found;
}

void hold_all(StabilityCase& attack, const std::string& where, const Contradictions& found) {
  const std::string of = " of " + std::to_string(found.segments) + " segments" + where;
  EXPECT_GT(found.crossings, found.segments / 10);
  attack.hold("missed or counted twice," + of, static_cast<double>(found.parity), 0,
              "parity decides inside and outside");
  attack.hold("in and out not in turns," + of, static_cast<double>(found.order), 0, "a closed surface");
  attack.hold("another count backwards," + of, static_cast<double>(found.reversed), 0,
              "the same points of the same segment");
}

TEST(StabilityCollision, RandomCrossingsOfAClosedSurface) {
  StabilityCase attack(
      "A missed crossing lets a tool into the organ without a force; a crossing that is counted twice lets it out "
      "again.");
  Indexed body(bumpy(sphere_surface(3, 1)));
  std::mt19937 random(101);
  std::uniform_real_distribution<double> at(-1.6, 1.6);
  std::uniform_int_distribution<int> kind(0, 2);
  const auto any = [&] { return Vec3{at(random), at(random), at(random)}; };
  hold_all(attack, "", cross(body.rest, quick_or_long(100000L, 10000000L), [&] {
             const Vec3 a = any(), b = any();
             const int k = kind(random);
             // Lengths: across a room, a haptic step, a rounding.
             return std::pair{a, k == 0 ? b : a + (k == 1 ? 0.02 : 1e-15) * b};
           }));
}

TEST(StabilityCollision, CrossingsThatMeetVerticesEdgesAndFacesExactly) {
  StabilityCase attack(
      "Nodes and tool lie on the same lattice, so that segments run exactly through vertices, along edges and within "
      "faces. Such a hit belongs to several triangles, or to none.");
  Indexed body(on_lattice(bumpy(sphere_surface(3, 1))));
  std::mt19937 random(103);
  std::uniform_int_distribution<int> at(-90, 90), node(0, static_cast<int>(body.surface.points.size()) - 1), kind(0, 3);
  const auto lattice = [&] { return Vec3{at(random) / 64.0, at(random) / 64.0, at(random) / 64.0}; };
  const auto any = [&]() -> std::pair<Vec3, Vec3> {
    const Vec3 a = lattice();
    if (kind(random) == 0) return {a, lattice()};
    const Vec3 through = load3(body.surface.points[node(random)].data());
    const Vec3 other = load3(body.surface.points[node(random)].data());
    if (kind(random) == 1) return {a, a + 2.0 * (through - a)};
    // From vertex to vertex, and extended beyond both.
    if (kind(random) == 2) return {through, other};
    return {through + 2.0 * (through - other), other + 2.0 * (other - through)};
  };
  hold_all(attack, " on a lattice", cross(body.rest, quick_or_long(100000L, 10000000L), any));
}

TEST(StabilityCollision, TrianglesOfFourDecadesBesideOneBucketSize) {
  StabilityCase attack(
      "All buckets have one size. Where triangles are much smaller, thousands share a bucket; where they are much "
      "larger, each is in many buckets. Both must be found.");
  Indexed body(graded(sphere_surface(4, 1)));
  double shortest = 1, longest = 0;
  for (const auto& [a, b, c] : body.surface.triangles) {
    const Vec3 edge = load3(body.surface.points[a].data()) - load3(body.surface.points[b].data());
    shortest = std::min(shortest, length(edge)), longest = std::max(longest, length(edge));
  }
  attack.hold("shortest edge over longest", shortest / longest, 1e-4, "the test reaches what it claims");
  std::mt19937 random(107);
  std::uniform_real_distribution<double> at(-1, 1), decade(-7, 0);
  hold_all(attack, " about the pole", cross(body.rest, quick_or_long(50000L, 5000000L), [&] {
             const auto near = [&] {
               const double size = std::pow(10.0, decade(random));
               return Vec3{size * at(random), size * at(random), 1 + size * at(random)};
             };
             return std::pair{near(), near()};
           }));
}

TEST(StabilityCollision, SurfaceFarFromTheOrigin) {
  StabilityCase attack(
      "A million metres from the origin, a coordinate has ten digits left below a metre: signs could flip.");
  const Point centre = {1e5, -9e5, 5e5};
  Indexed body(sphere_surface(3, 0.1, centre));
  std::mt19937 random(109);
  std::uniform_real_distribution<double> at(-0.12, 0.12);
  const auto any = [&] { return Vec3{centre[0] + at(random), centre[1] + at(random), centre[2] + at(random)}; };
  hold_all(attack, " far away", cross(body.rest, quick_or_long(50000L, 5000000L), [&] {
             return std::pair{any(), any()};
           }));
}

// ---- one tool point on a scene --------------------------------------------------------------------------------------

struct Hand : TouchedScene {
  explicit Hand(const TouchedBox& box) : TouchedScene(box) {}
  bool move(const Vector3d& to) {
    press(to);
    return touches();
  }
};

TEST(StabilityCollision, ToolsAtAnySpeedFromAnywhere) {
  StabilityCase attack(
      "Steps of a nanometre to a centimetre, starting outside, inside and on the surface, often standing still: a tool "
      "that entered must be felt, and one that never entered must not.");
  const TouchedBox box({.cells = {4, 4, 4}});
  TriangleSurface surface;
  for (std::int32_t n = 0; n < box.body.surface_nodes; ++n) surface.points.push_back(box.body.mesh.nodes[n]);
  surface.triangles = box.body.triangles;
  Indexed body(surface);
  std::mt19937 random(113);
  std::uniform_real_distribution<double> unit(0, 1), speed(-9, -2);
  std::normal_distribution<double> normal;
  const Vector3d middle(0.03, 0.025, 0.02);
  long missed = 0, imagined = 0, moved = 0, entered = 0;
  palpate_step_flags odd_flags = 0;
  Hand hand(box);
  Vector3d p = middle;
  bool was_outside = false, touched = false, first = true;
  const long steps = quick_or_long(100000L, 20000000L);
  for (long s = 0; s < steps; ++s) {
    const Vector3d from = p;
    if (s % 200 == 0) {  // a new start: anywhere, in the middle of the body, or on a node
      hand.reset();
      const long way = s / 200;
      p = way % 3 == 0   ? Vector3d(0.08 * unit(random) - 0.01, 0.07 * unit(random) - 0.01, 0.06 * unit(random) - 0.01)
          : way % 3 == 1 ? middle
                         : box.node(box.touchable[way % box.touchable.size()]);
      was_outside = touched = false, first = true;
    } else if (s % 5 != 0) {  // in every fifth step the tool stands still
      const double length = std::pow(10.0, speed(random));
      p += length * Vector3d(normal(random), normal(random), normal(random)).normalized();
      if ((p - middle).norm() > 0.06) p = middle + 0.06 * (p - middle).normalized();
    }
    const Vector3d before = hand.force();
    const bool touches = hand.move(p);
    const Vec3 now{p[0], p[1], p[2]}, last{from[0], from[1], from[2]};
    const bool inside = body.rest.inside(now);
    SurfaceCrossing found[DeformedSurface::kMaxCrossings];
    const int crossings = first ? 0 : body.rest.crossings(last, now, found);
    // A contact on the fixed face exists but has no free node.
    missed += inside && was_outside && !touches && !(hand.flags & PALPATE_STEP_NOT_TOUCHABLE);
    odd_flags |= hand.flags & ~static_cast<unsigned>(PALPATE_STEP_NOT_TOUCHABLE);
    imagined += touches && !touched && crossings == 0 && !on_surface(body.rest, last);
    moved += !first && p == from && touches && touched && hand.force() != before;
    entered += touches && !touched;
    was_outside = was_outside || (!inside && !on_surface(body.rest, now)), touched = touches, first = false;
  }
  const std::string of = " of " + std::to_string(steps) + " steps, " + std::to_string(entered) + " ways in";
  EXPECT_GT(entered, steps / 500);
  EXPECT_EQ(odd_flags, 0u);
  attack.hold("inside and not felt," + of, missed, 0, "collision is complete");
  attack.hold("felt without a crossing," + of, imagined, 0, "a contact begins on the way in");
  attack.hold("force that changed while the tool stood still," + of, moved, 0, "no motion, no change");
}

TEST(StabilityCollision, ToolsThatMeetVerticesEdgesAndFacesExactly) {
  StabilityCase attack(
      "Motions through a vertex, along an edge or within a face: however they are counted, a tool that entered must be "
      "felt, and one that left must not.");
  const TouchedBox box({.cells = {4, 4, 4}, .size = {0.5, 0.5, 0.5}});
  std::mt19937 random(127);
  std::uniform_int_distribution<int> at(-16, 48);
  Hand hand(box);
  long missed = 0, kept = 0, ways = 0;
  const auto inside = [](const Vector3d& p) { return p.minCoeff() > 0 && p.maxCoeff() < 0.5; };
  const auto outside = [](const Vector3d& p) { return p.minCoeff() < 0 || p.maxCoeff() > 0.5; };
  for (long s = 0; s < quick_or_long(100000L, 10000000L); ++s) {
    const auto lattice = [&] { return Vector3d(at(random) / 64.0, at(random) / 64.0, at(random) / 64.0); };
    const Vector3d a = lattice(), b = lattice();
    if (!outside(a) || !inside(b)) continue;
    hand.reset();
    hand.move(a);
    missed += !hand.move(b) && !(hand.flags & PALPATE_STEP_NOT_TOUCHABLE);
    kept += hand.move(a) || hand.force().norm() != 0;
    ++ways;
  }
  EXPECT_GT(ways, 1000);
  attack.hold("inside and not felt, of " + std::to_string(ways) + " ways in", missed, 0, "collision is complete");
  attack.hold("outside again and felt, of " + std::to_string(ways) + " ways out", kept, 0,
              "a contact ends on the way out where it went in");
}

TEST(StabilityCollision, MotionsWithinThePlaneOfAFaceThatIsAskew) {
  StabilityCase attack(
      "On a surface that is not aligned with the axes, rounding loses the crossing of a motion through a vertex or "
      "within a face's plane, unless planes and edges are judged by the same signs.");
  // Only collision is tested, so the nodes may be moved although the tensors belong to the original positions.
  TriangleSurface surface;
  const TouchedBox box({.cells = {4, 4, 4}, .size = {1, 1, 1}}, [&](BundleParts& parts) {
    auto nodes = parts.get<double>(formats::SectionId::nodes);
    for (std::size_t n = 0; n < nodes.size(); n += 3) {
      const double bump = 1 + 0.2 * std::sin(7 * nodes[n]) * std::cos(6 * nodes[n + 1] + nodes[n + 2]);
      for (std::size_t d = 0; d < 3; ++d) nodes[n + d] = std::round(64 * bump * nodes[n + d]) / 64;
      surface.points.push_back({nodes[n], nodes[n + 1], nodes[n + 2]});
    }
    parts.set(formats::SectionId::nodes, {nodes.size() / 3, 3}, nodes);
  });
  surface.triangles = box.body.triangles;
  Indexed body(surface);
  std::mt19937 random(131);
  std::uniform_int_distribution<int> at(-32, 96), node(0, box.body.surface_nodes - 1), kind(0, 1);
  Hand hand(box);
  long missed = 0, contradictions = 0, ways = 0;
  for (long s = 0; s < quick_or_long(300000L, 30000000L); ++s) {
    const Vec3 a{at(random) / 64.0, at(random) / 64.0, at(random) / 64.0};
    const Vec3 through = load3(surface.points[node(random)].data());
    const Vec3 other = load3(surface.points[node(random)].data());
    // Through a vertex half-way; from a chord's extension to its middle, or to the other side of its middle.
    const bool across = kind(random);
    const Vec3 from = across ? a : through + 2.0 * (through - other);
    const Vec3 to = across ? a + 2.0 * (through - a) : through + (kind(random) ? 0.5 : 0.75) * (other - through);
    if (body.rest.inside(from) || !body.rest.inside(to)) continue;
    if (on_surface(body.rest, from) || on_surface(body.rest, to)) continue;
    SurfaceCrossing found[DeformedSurface::kMaxCrossings];
    contradictions += body.rest.crossings(from, to, found) % 2 == 0;
    hand.reset();
    hand.move({from.x, from.y, from.z});
    missed +=
        !hand.move({to.x, to.y, to.z}) && !(hand.flags & (PALPATE_STEP_NOT_TOUCHABLE | PALPATE_STEP_TRACKING_LOST));
    ++ways;
  }
  EXPECT_GT(ways, 1000);
  const std::string of = " of " + std::to_string(ways) + " ways in";
  attack.hold("without a crossing," + of, contradictions, 0, "exact signs are consistent");
  attack.hold("inside and not felt," + of, missed, 0, "collision is complete");
}

TEST(StabilityCollision, MoreCrossingsInAStepThanAreKept) {
  StabilityCase attack(
      "One step through the teeth of a saw crosses the surface more often than a list of fixed length holds: a dropped "
      "crossing may be the entry.");
  // Teeth of 90 degrees on a bar, so that leaving a tooth never counts as the far side of a thin part.
  constexpr int kCells = 40;
  const TouchedBox saw({.cells = {kCells, 1, 1}, .size = {kCells, 1, 1}, .interior = false}, [](BundleParts& parts) {
    auto nodes = parts.get<double>(formats::SectionId::nodes);
    for (std::size_t n = 0; n < nodes.size(); n += 3)
      if (nodes[n + 2] == 1 && std::lround(nodes[n]) % 2) nodes[n + 2] = 2;
    parts.set(formats::SectionId::nodes, {nodes.size() / 3, 3}, nodes);
  });
  Hand hand(saw);
  double missed = 0;
  for (int tooth = 1; tooth < kCells; tooth += 2) {
    hand.reset();
    hand.move({-1, 0.37, 1.6});
    missed += !hand.move({1.0 * tooth, 0.37, 1.6}) && !(hand.flags & PALPATE_STEP_NOT_TOUCHABLE);
  }
  attack.hold("inside and not felt, after 1 to 39 crossings in a step", missed, 0,
              "when the list is full, the sides of the two ends decide");
}

TEST(StabilityCollision, TheFirstOfMoreCrossingsThanAreKept) {
  StabilityCase attack(
      "Triangles are tested box by box, in any order: a full list may hold any of the crossings, "
      "and miss the entry.");
  // Parallel sheets, in any order.
  constexpr int kSheets = 200;
  std::vector<int> place(kSheets);
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), std::mt19937(139));
  TriangleSurface sheets;
  for (int t = 0; t < kSheets; ++t) {
    const double x = 1.0 * place[t] / kSheets;
    for (const Point& p : {Point{x, -1, -1}, Point{x, 2, -1}, Point{x, -1, 2}}) sheets.points.push_back(p);
    sheets.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  Indexed body(sheets);
  SurfaceCrossing found[DeformedSurface::kMaxCrossings];
  EXPECT_EQ(body.rest.crossings({-1, 0, 0}, {2, 0, 0}, found), kSheets);
  double off = 0;
  for (int c = 0; c < DeformedSurface::kMaxCrossings; ++c)
    off = std::max(off, std::abs(3 * found[c].time - 1 - 1.0 * c / kSheets));
  attack.hold("distance of the crossings kept from the first ones", off, 1e-15 * 10, "some roundings near one");
}

TEST(StabilityCollision, FacesOnTheBorderOfABox) {
  StabilityCase attack(
      "A flat face has a box without thickness: by rounding, a motion through it or a ray along it misses the box.");
  // A large box, and a cavity in it whose top face lies anywhere, or one rounding beside that.
  const auto both = [](double low, double high) {
    TriangleSurface surface = box_surface(1, {0, 0, 0}, {11, 12, 13}),
                    cavity = box_surface(1, {4, 4, low}, {5, 5, high});
    for (int n = 0; n < 20; ++n) append(surface, box_surface(1, {1, 1, 0.2 + 0.01 * n}, {1.1, 1.1, 0.201 + 0.01 * n}));
    turn_inside_out(cavity);
    append(surface, cavity);
    return surface;
  };
  long missed = 0, motions = 0;
  for (int border = 1; border < 12; ++border)
    for (int step = -2; step <= 2; ++step) {
      double top = 2 + 0.83 * border;
      for (int s = 0; s < std::abs(step); ++s) top = std::nextafter(top, step * 100.0);
      Indexed body(both(top - 1.5, top));
      SurfaceCrossing found[DeformedSurface::kMaxCrossings];
      for (const double x : {4.1, 4.5, 4.9})
        for (const double y : {4.2, 4.5, 4.8}) {
          missed += body.rest.crossings({x, y, top + 0.3}, {x, y, top - 0.3}, found) != 1;
          missed += body.rest.crossings({x, y, top - 0.3}, {x, y, top + 0.3}, found) != 1;
          missed += body.rest.inside({x, y, top - 1e-9}) || !body.rest.inside({x, y, top + 1e-9});
          motions += 3;
        }
    }
  EXPECT_GT(motions, 500);
  attack.hold("missed, or another side, of " + std::to_string(motions), missed, 0,
              "boxes are compared with their borders included");
}

TEST(StabilityCollision, HugeTrianglesAmongTinyOnes) {
  StabilityCase attack(
      "If buckets were as wide as the mean edge, a few hundred huge triangles among tiny ones would be entered in "
      "50,000 buckets each: creating a scene would take minutes and gigabytes.");
  std::mt19937 random(137);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto any = [&](double size) { return Point{size * unit(random), size * unit(random), size * unit(random)}; };
  double worst = 0;
  for (const int share : {4, 30, 127, 254, 1000}) {
    TriangleSurface soup;
    for (int t = 0; t < 20000; ++t) {
      const bool huge = t % share == 0;
      const Point at = huge ? Point{} : any(1);
      for (int v = 0; v < 3; ++v) soup.points.push_back(at + any(huge ? 1 : 1e-6));
      soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    std::size_t bytes = 0;
    SceneMemory memory({[](void* user, std::size_t count, std::size_t alignment) {
                          *static_cast<std::size_t*>(user) += count;
                          return std::aligned_alloc(alignment, (count + alignment - 1) / alignment * alignment);
                        },
                        [](void*, void* taken) { std::free(taken); }, &bytes});
    SurfaceIndex index;
    EXPECT_TRUE(index.build(memory, soup.points[0].data(), soup.triangles[0].data(), 20000));
    worst = std::max(worst, static_cast<double>(bytes) / 20000);
    memory.release_all();
  }
  attack.hold(
      "bytes of the buckets for each triangle", worst, 2000,
      "a bucket is a quarter of the root mean square edge or more: some dozen entries for each triangle, and up "
      "to four slots of 16 bytes for each");
}

TEST(StabilityCollision, PressedBeyondTheMiddleOfAThinPart) {
  StabilityCase attack(
      "A sliding contact is at the nearest point of the surface. Beyond the middle of a thin part this point is on the "
      "far side: the force would reverse and pull the tool through.");
  const TouchedBox plate({.cells = {6, 6, 1}, .size = {0.06, 0.06, 0.006}});
  double drawn = 0, fall = 0;
  for (const auto law : {PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    TouchedScene scene(plate, unlimited_def(law));
    double before = 0;
    for (int s = 0; s <= 60; ++s) {  // from above down to 1 mm from the bottom, a little aside
      const double point[3] = {0.041 + 1e-5 * s, 0.032, 0.007 - 1e-4 * s};
      scene.touch({point_tool(point, 1, 0, 0.3)});
      const double up = scene.tool().force_raw[2];
      drawn = std::max(drawn, -up), fall = std::max(fall, before - up), before = up;
    }
    EXPECT_GT(before, 0);
  }
  attack.hold("force that draws the tool in, N", drawn, 0, "the tool is pressed out where it entered");
  attack.hold("fall of the force from one depth to the next, N", fall, 0, "a deeper tool has a larger force");
}

TEST(StabilityCollision, GrazingAFace) {
  StabilityCase attack(
      "A tool that runs along a face, one rounding above or below it: contact must not flicker, nor depend on the "
      "triangles that it passes.");
  const TouchedBox box({.cells = {4, 4, 4}});
  long wrong = 0, steps = 0;
  for (const double height : {1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 0.0, -1e-15, -1e-12, -1e-9, -1e-6, -1e-3})
    for (int lane = 0; lane < 20; ++lane) {
      Hand hand(box);
      // From above down to the height, then along the top, over edges and nodes of the mesh.
      const double y = lane < 5 ? 0.0125 * lane : 0.05 * (lane + 0.5) / 20, z = 0.04 + height;
      if (y <= 0 || y >= 0.05) continue;
      hand.move({0.005, y, 0.05});
      bool touches = hand.move({0.005, y, z}), flickered = false;
      for (int s = 1; s <= 100; ++s, ++steps) {
        const bool now = hand.move({0.005 + 0.0005 * s, y, z});
        flickered = flickered || now != touches;
        if (z != 0.04) wrong += now != (z < 0.04);
        touches = now;
        wrong += !hand.force().allFinite();
      }
      wrong += flickered;
    }
  attack.hold("wrong or flickering, of " + std::to_string(steps) + " steps", wrong, 0,
              "below the face is inside, above it is not, by exact signs");
}

TEST(StabilityCollision, TwoDiscsDeepInAThinLobe) {
  StabilityCase attack(
      "Two discs press into a thin lobe to twice its thickness. Each moves the surface off the other, so that contacts "
      "could begin and end in every step.");
  const PressedBar lobe = {{.cells = {8, 4, 2}, .size = {0.08, 0.03, 0.01}}, 0.01, 0.02};
  static const char* const names[] = {"sticking", "sliding", "unilateral", "coulomb"};
  for (const auto law : kEveryLaw) {
    const Unrest unrest = unrest_of_two_discs(lobe, law, quick_or_long(40, 4000));
    const double pairs = unrest.pairs;
    const std::string with = std::string(", ") + names[law];
    attack.hold(
        "beginnings and ends beyond the least, the worst pair" + with, unrest.worst, quick_or_long(14, 200),
        "a disc slips off an edge and touches the next face, and back. Weak: under friction one pair in 4,000 has 122");
    attack.hold("beginnings and ends beyond the least, the mean of all pairs" + with, unrest.more / pairs, 4,
                "each disc slips once; sliding contacts that are not kept under their tool: 44");
    attack.hold("contacts that begin again within eight steps, for a pair" + with, unrest.again / pairs, 1,
                "a disc that slips soon meets the next face; sliding contacts that are not kept under their tool: 20");
    attack.hold("steps that change a force by a tenth of its largest, for a pair" + with, unrest.jumps / pairs, 10,
                "two discs slip, and their contact points move over an edge, there and back");
    attack.hold("discs that rest and whose force swings on by 1e-6, for a pair" + with, unrest.swinging / pairs, 0.4,
                "weak: where the surface bends most, the point under a sliding disc may have no position of rest");
  }
}

}  // namespace
}  // namespace palpate::tests
