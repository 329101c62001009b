// The mesh that a blade cuts.
#include "runtime/cut/cut_mesh.h"

#include <gtest/gtest.h>

#include <chrono>

#include "tests/runtime/cut/cut_bodies.h"

namespace palpate::tests {
namespace {

std::set<std::int32_t> faces_in(const CutPlay& play, FaceState state) {
  std::set<std::int32_t> found;
  for (const std::int32_t face : play.body.inner_faces())
    if (play.mesh.state().face(face) == state) found.insert(face);
  return found;
}

// ---- which faces can be cut ---------------------------------------------------------------------------------------

struct Subsets {
  long all = 0, valid = 0, cut_in_part = 0, larger = 0;
};

// Cuts the faces at once, and compares with a search that has none of the code: all are cut if they may be, else some of them so that the
// surface is manifold.
void cut_subset(const BodyToCut& body, const std::vector<std::int32_t>& faces, bool looks_for_larger,
                Subsets* counted) {
  CutPlay play(body);
  play.mesh.cut(faces.data(), static_cast<std::int32_t>(faces.size()));
  const std::set<std::int32_t> wanted(faces.begin(), faces.end()), cut = faces_in(play, FaceState::cut);
  ASSERT_EQ(fault_of(play), "") << testing::PrintToString(faces) << testing::PrintToString(cut);
  const bool valid = fault_of(body, wanted, {}).empty();
  ++counted->all, counted->valid += valid, counted->cut_in_part += !valid && !cut.empty();
  ASSERT_EQ(cut == wanted, valid);
  for (const std::int32_t face : cut) ASSERT_TRUE(wanted.count(face));
  if (valid || !looks_for_larger) return;
  std::vector<std::int32_t> rest;
  for (const std::int32_t face : wanted)
    if (!cut.count(face)) rest.push_back(face);
  for (std::uint32_t more = 1; more < 1u << rest.size(); ++more) {
    std::set<std::int32_t> larger = cut;
    for (std::size_t i = 0; i < rest.size(); ++i)
      if (more >> i & 1) larger.insert(rest[i]);
    if (fault_of(body, larger, {}).empty()) {
      ++counted->larger;
      return;
    }
  }
}

TEST(CutRules, EverySetOfFacesOfSmallMeshesIsCutWhereTheSurfaceStaysManifold) {
  for (const BodyToCut& body : {octahedron(), block_to_cut(1, 1, 1, 0, 0), block_to_cut(2, 1, 1, 0, 0)}) {
    const std::vector<std::int32_t> inner = body.inner_faces();
    Subsets counted;
    for (std::uint32_t set = 0; set < 1u << inner.size(); ++set) {
      std::vector<std::int32_t> faces;
      for (std::size_t i = 0; i < inner.size(); ++i)
        if (set >> i & 1) faces.push_back(inner[i]);
      cut_subset(body, faces, set % 16 == 7, &counted);
      if (HasFatalFailure()) return;
    }
    std::printf("%zu faces: %ld sets, %ld manifold, %ld cut in part, %ld could be larger\n", inner.size(), counted.all,
                counted.valid, counted.cut_in_part, counted.larger);
    EXPECT_GT(counted.valid, 1);
  }
}

TEST(CutRules, RandomSetsOfFacesAroundInnerNodesAreCutWhereTheSurfaceStaysManifold) {
  const BodyToCut body = block_to_cut(3, 2, 2, 0.2, 3);
  const std::vector<std::int32_t> inner = body.inner_faces();
  std::mt19937_64 random(5);
  Subsets counted;
  for (int i = 0; i < 400; ++i) {
    // Of all faces a share, or those near a plane, which is what a blade meets.
    std::vector<std::int32_t> faces;
    const double share = std::uniform_real_distribution<double>(0.02, 0.6)(random);
    for (const std::int32_t face : inner)
      if (std::uniform_real_distribution<double>(0, 1)(random) < share) faces.push_back(face);
    cut_subset(body, faces, false, &counted);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(counted.cut_in_part, 100);
}

// ---- a blade ------------------------------------------------------------------------------------------------------

// A plane at `place` along `axis`, swept along the next axis in steps of `step` from `begin` to `end` cells; the blade is as long as the body.
void sweep_plane(CutPlay& play, std::size_t axis, double place, double begin, double end, double step,
                 double tilt = 0) {
  const std::size_t way = (axis + 1) % 3, line = (axis + 2) % 3;
  const auto at = [&](double along) {
    std::array<double, 6> blade{};
    for (std::size_t p = 0; p < 2; ++p)
      blade[3 * p + axis] = place + tilt * along, blade[3 * p + way] = along, blade[3 * p + line] = p ? 20 : -20;
    return blade;
  };
  const double sign = end > begin ? 1 : -1;
  for (double along = begin; sign * (end - along) > 0; along += sign * step) {
    play.sweep(at(along), at(along + sign * step));
    ASSERT_EQ(fault_of(play), "");
  }
  play.sweep(at(end), at(end));
}

TEST(CutMesh, ABladeThroughTheBodyPartsItInTwoWithoutWaitingFaces) {
  for (const double step : {0.07, 0.5, 20.0})
    for (const double place : {1.5, 2.1, 1.93}) {
      const BodyToCut body = block_to_cut(4, 4, 3, 0.25, 8);
      CutPlay play(body);
      sweep_plane(play, 0, place, -1, 6, step, 0.05);
      ASSERT_EQ(fault_of(play), "");
      EXPECT_EQ(play.mesh.pending(), 0) << step << ' ' << place;
      ASSERT_GE(play.mesh.pieces().count(), 2);
      // Small pieces may come off beside the cut; the two halves are whole.
      EXPECT_GT(play.mesh.pieces().piece(0).tetrahedra + play.mesh.pieces().piece(1).tetrahedra,
                body.tetrahedron_count() - 8);
      EXPECT_GT(std::min(play.mesh.pieces().piece(0).tetrahedra, play.mesh.pieces().piece(1).tetrahedra), 60);
    }
}

TEST(CutMesh, ObliqueBladesLeaveNothingWaitingAndNothingHanging) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> share(-1, 1);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const BodyToCut body = seed % 2 ? lattice_to_cut(4, 4, 4, 0.22, seed) : block_to_cut(4, 4, 4, 0.22, seed);
    CutPlay play(body);
    // A plane near the middle; the blade is longer than the body, and its way is across its line.
    Vec3 normal = unit_or_zero({share(random), share(random), share(random)});
    const Vec3 line = unit_or_zero(cross(normal, Vec3{share(random), share(random), share(random)}));
    const Vec3 way = cross(normal, line), middle = Vec3{2, 2, 2} + 0.6 * share(random) * normal;
    const auto blade = [&](double along) {
      std::array<double, 6> at{};
      store3(middle + along * way + 9 * line, at.data()), store3(middle + along * way + -9 * line, at.data() + 3);
      return at;
    };
    for (double along = -5; along < 5; along += 0.2) play.sweep(blade(along), blade(along + 0.2));
    for (int i = 0; i < 50; ++i) play.sweep(blade(5), blade(5));
    ASSERT_EQ(fault_of(play), "");
    EXPECT_EQ(play.mesh.pending(), 0) << seed;
    EXPECT_GE(play.mesh.pieces().count(), 2) << seed;
  }
}

TEST(CutMesh, ACutThatTouchesTheSurfaceAtANodeIsFinished) {
  // The upper side of the cut: the tetrahedra at the nodes with z = 3, but for the four around the line from one of these nodes down. Those
  // reach the surface at this node alone.
  const BodyToCut body = lattice_to_cut(4, 4, 3, 0, 0);
  const std::int32_t top = 2 + 5 * (2 + 5 * 3), below = 2 + 5 * (2 + 5 * 2);
  const auto is_upper = [&](std::int32_t t) {
    bool at_top = false, has_top = false, has_below = false;
    for (std::size_t c = 4 * static_cast<std::size_t>(t); c < 4 * static_cast<std::size_t>(t) + 4; ++c) {
      const std::int32_t node = body.tetrahedra[c];
      at_top = at_top || body.nodes[3 * static_cast<std::size_t>(node) + 2] == 3;
      has_top = has_top || node == top, has_below = has_below || node == below;
    }
    return at_top && !(has_top && has_below);
  };
  CutPlay play(body);
  std::vector<std::int32_t> faces;
  for (const std::int32_t face : body.inner_faces())
    if (is_upper(face / 4) != is_upper(play.mesh.state().rest().neighbour(face))) faces.push_back(face);
  play.mesh.cut(faces.data(), static_cast<std::int32_t>(faces.size()));
  play.follow();
  EXPECT_GT(play.mesh.pending(), 0);
  EXPECT_EQ(play.mesh.pieces().count(), 1);
  for (int i = 0; i < 50; ++i) play.sweep({9, 9, 9, 9, 9, 10}, {9, 9, 9, 9, 9, 10});
  ASSERT_EQ(fault_of(play), "");
  EXPECT_EQ(play.mesh.pending(), 0);
  EXPECT_GE(play.mesh.pieces().count(), 2);
}

// Whether the segment crosses the triangle, in plain arithmetic.
bool crosses(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const auto volume = [](Vec3 u, Vec3 v, Vec3 w, Vec3 x) { return dot(cross(v - u, w - u), x - u) > 0; };
  return volume(a, b, c, p) != volume(a, b, c, q) && volume(p, q, a, b) == volume(p, q, b, c) &&
         volume(p, q, b, c) == volume(p, q, c, a);
}

TEST(CutMesh, ABladeMeetsEachFaceWhoseCentroidsItDivides) {
  const BodyToCut block = block_to_cut(5, 5, 4, 0.2, 5), bar = block_to_cut(40, 1, 1, 0.1, 5);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> share(0, 1), step(-1, 1);
  long met = 0;
  for (int i = 0; i < 800; ++i) {
    const BodyToCut& body = i % 4 == 3 ? bar : block;
    CutPlay play(body);
    // Positions are anything: some tetrahedra are turned over, and the segments between centroids leave them.
    for (double& x : play.positions) x += (i % 4 == 1 ? 2 : 0) * step(random);
    std::array<double, 6> from{}, to{};
    // Long and short ones.
    for (std::size_t d = 0; d < 6; ++d) {
      from[d] = d < 3 || i % 4 < 2 ? share(random) * body.nodes[body.nodes.size() - 3 + d % 3]
                                   : from[d - 3] + 0.3 * step(random);
      to[d] = from[d] + (i % 2 ? 0.2 : 0.05) * step(random);
    }
    const auto middle = [&](std::int32_t t) {
      Vec3 sum;
      for (int c = 0; c < 4; ++c) sum += load3(play.positions.data() + 3 * play.mesh.nodes_of(t)[c]);
      return 0.25 * sum;
    };
    std::set<std::int32_t> expected;
    const Vec3 a = load3(from.data()), b = load3(from.data() + 3), c = load3(to.data() + 3), d = load3(to.data());
    for (const std::int32_t face : body.inner_faces()) {
      const Vec3 p = middle(face / 4), q = middle(play.mesh.state().rest().neighbour(face));
      if (crosses(p, q, a, b, c) || crosses(p, q, a, c, d)) expected.insert(face);
    }
    play.mesh.blade({from.data(), to.data(), 2}, play.positions.data());
    std::set<std::int32_t> found = faces_in(play, FaceState::pending);
    found.merge(faces_in(play, FaceState::cut));
    ASSERT_EQ(found, expected);
    met += static_cast<long>(found.size());
  }
  EXPECT_GT(met, 300);
}

TEST(CutMesh, ACutAlongAPlaneOfFacesIsThatPlane) {
  // The blade runs through nodes, edges and faces exactly.
  const BodyToCut body = block_to_cut(4, 3, 2, 0, 0);
  CutPlay play(body);
  // Steps of an eighth end on segments between centroids, too.
  sweep_plane(play, 0, 2, -1, 4, 0.125);
  ASSERT_EQ(fault_of(play), "");
  EXPECT_EQ(play.mesh.nodes() - body.node_count(), 4 * 3);
  EXPECT_EQ(play.mesh.pieces().count(), 2);
  for (std::int32_t i = body.view().triangle_count; i < play.mesh.surface().count(); ++i) {
    std::int32_t nodes[3];
    play.mesh.surface().nodes(i, nodes);
    for (const std::int32_t node : nodes) EXPECT_EQ(play.positions[3 * static_cast<std::size_t>(node)], 2);
    // The two lips of a face.
    const std::int32_t other = play.mesh.surface().other_lip(i);
    ASSERT_GE(other, 0);
    EXPECT_EQ(play.mesh.surface().other_lip(other), i);
    EXPECT_NE(play.mesh.pieces().piece_of(play.mesh.surface().face(i) / 4),
              play.mesh.pieces().piece_of(play.mesh.surface().face(other) / 4));
  }
}

TEST(CutMesh, ACutThatEndsInsideHoldsAtItsEnd) {
  const BodyToCut body = block_to_cut(4, 4, 3, 0.25, 8);
  CutPlay play(body);
  sweep_plane(play, 0, 2, -1, 2.3, 0.1);
  EXPECT_GT(play.mesh.nodes(), body.node_count() + 5);
  EXPECT_EQ(play.mesh.pieces().count(), 1);
  // Where the cut ends, the lips have nodes in common.
  int shared = 0;
  for (const std::int32_t face : faces_in(play, FaceState::cut))
    for (int c = 0; c < 4; ++c)
      for (int d = 0; d < 4; ++d) {
        const std::int32_t one = play.mesh.nodes_of(face / 4)[c];
        shared += c != face % 4 && one == play.mesh.nodes_of(play.mesh.state().rest().neighbour(face))[d];
      }
  EXPECT_GT(shared, 3);
}

TEST(CutMesh, BackAndForthInPlaceCutsOnce) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    const BodyToCut body = block_to_cut(4, 4, 3, 0.25, seed);
    CutPlay play(body);
    sweep_plane(play, 0, 2.05, -1, 2.5, 0.1);
    play.sweep({9, 9, 9, 9, 9, 10}, {9, 9, 9, 9, 9, 10});  // lifted, so that what waits at the end is finished
    const std::int32_t nodes = play.mesh.nodes(), triangles = play.mesh.surface().count();
    for (int i = 0; i < 5; ++i) {
      sweep_plane(play, 0, 2.05, 2.5, -1, 0.13);
      sweep_plane(play, 0, 2.05, -1, 2.5, 0.1);
    }
    EXPECT_EQ(play.mesh.nodes(), nodes);
    EXPECT_EQ(play.mesh.surface().count(), triangles);
  }
}

TEST(CutMesh, CutsThatCrossPartTheBodyInFour) {
  const BodyToCut body = block_to_cut(4, 4, 3, 0.2, 9);
  CutPlay play(body);
  sweep_plane(play, 0, 2.05, -1, 6, 0.3);
  const std::int32_t parts = play.mesh.pieces().count();
  EXPECT_GE(parts, 2);
  sweep_plane(play, 1, 1.95, -1, 6, 0.3);  // an X
  EXPECT_GE(play.mesh.pieces().count(), parts + 2);
  EXPECT_EQ(play.mesh.pending(), 0);
  ASSERT_EQ(fault_of(play), "");
}

TEST(CutMesh, ACutThatEndsAtAnEarlierOneTakesOffAQuarter) {
  const BodyToCut body = block_to_cut(4, 4, 3, 0.2, 9);
  CutPlay play(body);
  sweep_plane(play, 0, 2.05, -1, 6, 0.3);
  const std::int32_t parts = play.mesh.pieces().count();
  // A T: from the side x = 0 to the cut, the way along z.
  for (double z = -1; z < 5; z += 0.3) {
    play.sweep({-1, 1.95, z, 2.3, 1.95, z}, {-1, 1.95, z + 0.3, 2.3, 1.95, z + 0.3});
    ASSERT_EQ(fault_of(play), "");
  }
  EXPECT_GE(play.mesh.pieces().count(), parts + 1);
}

TEST(CutMesh, ABladeOfSeveralSegmentsCutsAHook) {
  const BodyToCut body = block_to_cut(4, 4, 3, 0.2, 9);
  CutPlay play(body);
  // The line bends inside the body; swept along z it takes out a corner.
  std::array<double, 9> from{-1, 2.02, -1, 2.02, 2.02, -1, 2.02, -1, -1}, to = from;
  for (int i = 0; i < 25; ++i, from = to) {
    for (std::size_t p = 0; p < 3; ++p) to[3 * p + 2] += 0.25;
    play.mesh.blade({from.data(), to.data(), 3}, play.positions.data());
    play.follow();
    ASSERT_EQ(fault_of(play), "");
  }
  EXPECT_GE(play.mesh.pieces().count(), 2);
}

TEST(CutMesh, ABladeThatIsInsideAlreadyWaitsUntilItReachesTheSurface) {
  const BodyToCut body = block_to_cut(6, 6, 6, 0.2, 4);
  CutPlay play(body);
  play.sweep({2.1, 2, 3.05, 4, 2, 3.05}, {2.1, 4, 3.05, 4, 4, 3.05});
  EXPECT_GT(play.mesh.pending(), 0);
  EXPECT_EQ(play.mesh.nodes(), body.node_count());
  const CutMeshChange& change = play.sweep({-1, -1, 3.05, 7, -1, 3.05}, {-1, 7, 3.05, 7, 7, 3.05});
  EXPECT_GT(change.cut_faces, 50);
  ASSERT_EQ(fault_of(play), "");
}

TEST(CutMesh, IsMovedWithTheBlade) {
  // The blade is the same in all steps, but the positions of the nodes are turned and stretched with it.
  const BodyToCut body = block_to_cut(4, 4, 3, 0.25, 8);
  CutPlay still(body), moved(body);
  const auto away = [](const double* p, double* out) { out[0] = 3 + 0.5 * p[1], out[1] = 2 * p[2] - 7, out[2] = p[0]; };
  for (double y = -1; y < 6; y += 0.25) {
    const std::array<double, 6> from{2.05, y, -9, 2.05, y, 9}, to{2.05, y + 0.25, -9, 2.05, y + 0.25, 9};
    still.sweep(from, to);
    for (std::size_t n = 0; n < static_cast<std::size_t>(moved.mesh.nodes()); ++n)
      away(body.nodes.data() + 3 * static_cast<std::size_t>(moved.mesh.at_rest(static_cast<std::int32_t>(n))),
           &moved.positions[3 * n]);
    std::array<double, 6> there{}, then{};
    for (std::size_t p = 0; p < 6; p += 3) away(&from[p], &there[p]), away(&to[p], &then[p]);
    moved.sweep(there, then);
  }
  EXPECT_EQ(faces_in(still, FaceState::cut), faces_in(moved, FaceState::cut));
  EXPECT_GT(faces_in(still, FaceState::cut).size(), 20u);
}

TEST(CutMesh, PointsThatAreNotFiniteCutNothing) {
  const BodyToCut body = block_to_cut(2, 2, 2, 0, 0);
  CutPlay play(body);
  const double nan = std::nan("");
  EXPECT_EQ(play.sweep({nan, -1, -5, 1, -1, 5}, {1, 5, -5, 1, 5, 5}).cut_faces, 0);
  EXPECT_EQ(play.sweep({1, -1, -5, 1, -1, 5}, {1, 5, -5, 1, 1 / 0., 5}).cut_faces, 0);
  EXPECT_EQ(play.mesh.pending(), 0);
}

// ---- what a step tells --------------------------------------------------------------------------------------------

TEST(CutMesh, TellsEachChange) {
  RandomCuts cuts(11);
  const CutMesh& mesh = cuts.play.mesh;
  std::vector<std::int32_t> nodes(cuts.body.tetrahedra);
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::set<std::int32_t> gone;
  std::int32_t node_count = cuts.body.node_count();
  const auto triangle = [&](std::int32_t i) {
    std::array<std::int32_t, 3> now{};
    mesh.surface().nodes(i, now.data());
    return now;
  };
  for (std::int32_t i = 0; i < mesh.surface().count(); ++i) triangles.push_back(triangle(i));
  for (int step = 0; step < 200; ++step) {
    ASSERT_EQ(cuts.step(), "");
    const CutMeshChange& change = mesh.change();
    ASSERT_EQ(change.first_node, node_count);
    for (std::int32_t n = change.first_node; n < change.end_node; ++n) {
      EXPECT_LT(mesh.from(n), n);
      EXPECT_EQ(mesh.at_rest(mesh.from(n)), mesh.at_rest(n));
    }
    node_count = change.end_node;
    for (std::int32_t i = 0; i < change.tetrahedra.count; ++i)
      for (std::int32_t c = 0; c < 4; ++c) {
        const auto corner = static_cast<std::size_t>(4 * change.tetrahedra[i] + c);
        EXPECT_EQ(nodes[corner], change.before[4 * i + c]);
        nodes[corner] = mesh.nodes_of(change.tetrahedra[i])[c];
      }
    for (const std::int32_t t : change.removed_tetrahedra) EXPECT_TRUE(gone.insert(4 * t).second);
    for (std::int32_t t = 0; t < cuts.body.tetrahedron_count(); ++t) {
      EXPECT_EQ(gone.count(4 * t) > 0, mesh.is_removed(t));
      for (std::int32_t c = 0; c < 4; ++c) ASSERT_EQ(nodes[static_cast<std::size_t>(4 * t + c)], mesh.nodes_of(t)[c]);
    }
    for (const std::int32_t i : change.removed_triangles) triangles[static_cast<std::size_t>(i)] = {-1, -1, -1};
    for (const std::int32_t i : change.renamed_triangles) {
      EXPECT_NE(triangles[static_cast<std::size_t>(i)], triangle(i));
      triangles[static_cast<std::size_t>(i)] = triangle(i);
    }
    ASSERT_EQ(change.first_triangle, static_cast<std::int32_t>(triangles.size()));
    for (std::int32_t i = change.first_triangle; i < change.end_triangle; ++i)
      triangles.push_back(mesh.surface().face(i) < 0 ? std::array<std::int32_t, 3>{-1, -1, -1} : triangle(i));
    for (std::int32_t i = 0; i < mesh.surface().count(); ++i)
      ASSERT_EQ(triangles[static_cast<std::size_t>(i)],
                mesh.surface().face(i) < 0 ? (std::array<std::int32_t, 3>{-1, -1, -1}) : triangle(i));
  }
  EXPECT_GT(gone.size(), 0u);
  EXPECT_GT(node_count, cuts.body.node_count() + 20);
}

TEST(CutMesh, AReserveThatEndsIsToldAndTheNextStepGoesOn) {
  const BodyToCut body = block_to_cut(4, 4, 3, 0.25, 8);
  CutPlay play(body, 9);
  bool full = false;
  for (double y = -1; y < 6; y += 0.1) {
    full = play.sweep({2.1, y, -9, 2.1, y, 9}, {2.1, y + 0.1, -9, 2.1, y + 0.1, 9}).full || full;
    ASSERT_EQ(fault_of(play), "");
  }
  EXPECT_TRUE(full);
  EXPECT_LE(play.mesh.nodes(), body.node_count() + 9);
  EXPECT_GT(play.mesh.nodes(), body.node_count());
  EXPECT_GT(play.mesh.pending(), 0);
  // Removal needs no node there.
  const std::array<double, 3> corner{0, 0, 0};
  EXPECT_GT(play.mesh.remove_ball(corner.data(), 1, play.positions.data()).removed_tetrahedra.count, 0);
  ASSERT_EQ(fault_of(play), "");
}

std::string refusal(const BodyToCut& body) {
  SceneMemory memory{palpate_allocator{}};
  CutMesh mesh;
  const char* const wrong = mesh.create(memory, body.view(), 8);
  const std::string text = wrong ? wrong : "";
  memory.release_all();
  return text;
}

TEST(CutMesh, BodiesThatCannotBeCutAreRefused) {
  BodyToCut body = block_to_cut(2, 1, 1, 0, 0);
  EXPECT_EQ(refusal(body), "");
  BodyToCut open = body, turned = body, flat = body, far = body, lost = body;
  open.triangles.resize(open.triangles.size() - 3);
  EXPECT_NE(refusal(open).find("face"), std::string::npos);
  std::swap(turned.triangles[0], turned.triangles[1]);
  EXPECT_NE(refusal(turned).find("turned over"), std::string::npos);
  std::swap(flat.tetrahedra[0], flat.tetrahedra[1]);
  EXPECT_NE(refusal(flat).find("volume"), std::string::npos);
  far.tetrahedra[3] = 99;
  EXPECT_NE(refusal(far).find("tetrahedron"), std::string::npos);
  lost.nodes[4] = std::nan("");
  EXPECT_NE(refusal(lost).find("finite"), std::string::npos);
  // Two tetrahedra that meet at an edge alone, and at a node alone.
  EXPECT_NE(refusal(body_of({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0, 0, 0, -1}, {0, 1, 2, 3, 0, 1, 4, 5}))
                .find("manifold"),
            std::string::npos);
  EXPECT_NE(
      refusal(body_of({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0, 0, -1, 0, 0, 0, -1}, {0, 1, 2, 3, 0, 5, 4, 6}))
          .find("node"),
      std::string::npos);
}

// ---- removal ------------------------------------------------------------------------------------------------------

TEST(CutMesh, RemovedTetrahedraLeaveAManifoldSurface) {
  const BodyToCut body = block_to_cut(3, 3, 2, 0.2, 6);
  std::mt19937_64 random(2);
  long in_part = 0, whole = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<std::int32_t> tetrahedra(1 + random() % (i % 3 ? 60 : 3));
    for (std::int32_t& t : tetrahedra)
      t = static_cast<std::int32_t>(random() % static_cast<std::uint64_t>(body.tetrahedron_count()));
    const std::set<std::int32_t> wanted(tetrahedra.begin(), tetrahedra.end());
    CutPlay play(body);
    const CutMeshChange& change = play.mesh.remove(tetrahedra.data(), static_cast<std::int32_t>(tetrahedra.size()));
    ASSERT_EQ(fault_of(play), "");
    const bool valid = fault_of(body, {}, wanted).empty();
    ASSERT_EQ(valid, change.removed_tetrahedra.count == static_cast<std::int32_t>(wanted.size()));
    in_part += !valid && change.removed_tetrahedra.count > 0, whole += valid;
    if (valid) continue;
    // A body that begins without them is refused.
    std::vector<std::int32_t> others;
    for (std::int32_t t = 0; t < body.tetrahedron_count(); ++t)
      if (!wanted.count(t))
        others.insert(others.end(), &body.tetrahedra[4 * static_cast<std::size_t>(t)],
                      &body.tetrahedra[4 * static_cast<std::size_t>(t)] + 4);
    EXPECT_NE(refusal(body_of(body.nodes, others)).find("manifold"), std::string::npos);
  }
  EXPECT_GT(in_part, 10);
  EXPECT_GT(whole, 10);
}

TEST(CutMesh, ABallInsideLeavesAHollowAndTheLostNodeIsTold) {
  const BodyToCut body = block_to_cut(4, 4, 4, 0, 0);
  CutPlay play(body);
  const std::array<double, 3> centre{2, 2, 2};
  const CutMeshChange& change = play.mesh.remove_ball(centre.data(), 1, play.positions.data());
  EXPECT_GE(change.removed_tetrahedra.count, 24);  // all around the node in the middle
  ASSERT_EQ(change.lost_nodes.count, 1);
  EXPECT_EQ(change.lost_nodes[0], 2 + 5 * (2 + 5 * 2));
  ASSERT_EQ(fault_of(play), "");
  EXPECT_EQ(play.mesh.pieces().count(), 1);
}

TEST(CutMesh, RemovalBesideACutKeepsTheSurfaceClosed) {
  const BodyToCut body = block_to_cut(4, 4, 3, 0.2, 3);
  CutPlay play(body);
  sweep_plane(play, 0, 2.05, -1, 2.3, 0.2);
  for (double y = 0; y < 4; y += 0.4) {
    const std::array<double, 3> centre{2.05, y, 1.5};
    play.mesh.remove_ball(centre.data(), 0.7, play.positions.data());
    play.follow();
    ASSERT_EQ(fault_of(play), "");
  }
  sweep_plane(play, 1, 2.05, -1, 5, 0.2);
  ASSERT_EQ(fault_of(play), "");
}

// ---- pieces -------------------------------------------------------------------------------------------------------

TEST(CutMesh, ASeveredPieceIsToldInItsStepWithWhatHoldsIt) {
  BodyToCut body = block_to_cut(6, 2, 2, 0.1, 2);
  for (std::size_t n = 0; n < body.held.size(); ++n) body.held[n] = body.nodes[3 * n] == 0;
  CutPlay play(body);
  EXPECT_EQ(play.mesh.pieces().count(), 1);
  EXPECT_TRUE(play.mesh.pieces().piece(0).is_held);
  EXPECT_EQ(play.mesh.pieces().piece(0).anchors, 9);
  int told = 0;
  for (double y = -1; y < 4; y += 0.1) {
    const std::int32_t before = play.mesh.pieces().count();
    const CutMeshChange& change = play.sweep({2.5, y, -9, 2.5, y, 9}, {2.5, y + 0.1, -9, 2.5, y + 0.1, 9});
    EXPECT_EQ(change.first_piece, before);
    EXPECT_EQ(change.end_piece, play.mesh.pieces().count());
    told += change.end_piece > change.first_piece;
  }
  EXPECT_GE(told, 1);
  ASSERT_GE(play.mesh.pieces().count(), 2);
  int held = 0;
  for (std::int32_t i = 0; i < play.mesh.pieces().count(); ++i) {
    const CutPiece& piece = play.mesh.pieces().piece(i);
    held += piece.is_held;
    EXPECT_EQ(piece.anchors, piece.is_held ? 9 : 0);
    EXPECT_EQ(play.mesh.pieces().piece_of(piece.first), i);
  }
  EXPECT_EQ(held, 1);
}

// Below the end of a block; along z alone they let it slide.
TEST(CutMesh, SupportsHoldThePieceThatHasTheirTrianglesIfTheyResistEachShift) {
  for (const bool slides : {false, true}) {
    BodyToCut body = block_to_cut(6, 2, 2, 0, 0);
    body.support.resize(body.triangles.size() / 3);
    for (std::size_t t = 0; t < body.support.size(); ++t) {
      bool below = true;
      for (std::size_t v = 3 * t; v < 3 * t + 3; ++v) {
        const double* const p = body.nodes.data() + 3 * body.triangles[v];
        below = below && p[2] == 0 && p[0] >= 4;
      }
      for (int i = 0; i < 3; ++i) body.support[t].m[i][i] = below && (i == 2 || !slides);
    }
    CutPlay play(body);
    EXPECT_EQ(play.mesh.pieces().piece(0).is_held, !slides);
    sweep_plane(play, 0, 2.5, -1, 4, 0.1);
    ASSERT_GE(play.mesh.pieces().count(), 2);
    int held = 0;
    for (std::int32_t i = 0; i < play.mesh.pieces().count(); ++i) {
      const CutPiece& piece = play.mesh.pieces().piece(i);
      held += piece.is_held;
      double most = 0;
      for (const std::int32_t n : {0, 1, 2, 3})
        most = std::max(
            most,
            body.nodes[3 * static_cast<std::size_t>(body.tetrahedra[static_cast<std::size_t>(4 * piece.first + n)])]);
      if (piece.is_held) {
        EXPECT_GE(most, 3) << "its first tetrahedron";
      }
    }
    EXPECT_EQ(held, !slides);
  }
}

TEST(CutMesh, AnchorsOnOneLineHoldNothing) {
  BodyToCut body = block_to_cut(4, 2, 2, 0, 0);
  for (std::size_t n = 0; n < body.held.size(); ++n)
    body.held[n] = body.nodes[3 * n] == 0 && body.nodes[3 * n + 1] == 0;
  const CutPlay line(body);
  EXPECT_EQ(line.mesh.pieces().piece(0).anchors, 3);
  EXPECT_FALSE(line.mesh.pieces().piece(0).is_held);
  body.held.back() = 1;
  const CutPlay plane(body);
  EXPECT_TRUE(plane.mesh.pieces().piece(0).is_held);
}

TEST(CutMesh, TetrahedraThatMeetAtAnEdgeOrANodeAloneShareNoNode) {
  // Two cells that stay when the two beside them are removed: they meet at an edge.
  const BodyToCut body = block_to_cut(2, 2, 1, 0, 0);
  CutPlay play(body);
  std::vector<std::int32_t> tetrahedra;
  for (std::int32_t t = 6; t < 18; ++t) tetrahedra.push_back(t);
  const CutMeshChange& change = play.mesh.remove(tetrahedra.data(), 12);
  ASSERT_EQ(change.removed_tetrahedra.count, 12);
  ASSERT_EQ(fault_of(play), "");
  EXPECT_EQ(play.mesh.pieces().count(), 2);
  std::set<std::int32_t> one, two;
  for (std::int32_t t = 0; t < 6; ++t) one.insert(play.mesh.nodes_of(t), play.mesh.nodes_of(t) + 4);
  for (std::int32_t t = 18; t < 24; ++t) two.insert(play.mesh.nodes_of(t), play.mesh.nodes_of(t) + 4);
  for (const std::int32_t node : one) EXPECT_FALSE(two.count(node));
}

// ---- a part of the body that may be cut -----------------------------------------------------------------------------

// The nodes of x < 2 alone may be divided.
BodyToCut half_to_cut(std::uint64_t seed) {
  BodyToCut body = block_to_cut(4, 3, 3, 0.2, seed);
  for (std::int32_t n = 0; n < body.node_count(); ++n) body.dividable.push_back(body.nodes[3 * n] < 2.5);
  return body;
}

TEST(CutMesh, NodesThatMayNotBeDividedStayWhole) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const BodyToCut body = half_to_cut(seed);
    CutPlay play(body);
    for (double x = -1; x < 5; x += 0.25) {
      play.sweep({x, 1.5, -1, x, 1.5, 4}, {x + 0.25, 1.5, -1, x + 0.25, 1.5, 4});
      ASSERT_EQ(fault_of(play), "") << seed << ' ' << x;
    }
    for (const double x : {0.5, 2.0, 3.5}) {
      const std::array<double, 3> centre{x, 2.5, 2.5};
      play.mesh.remove_ball(centre.data(), 1, play.positions.data());
      ASSERT_EQ(fault_of(play), "") << seed << ' ' << x;
    }
    EXPECT_GT(play.mesh.nodes(), body.node_count());
    for (std::int32_t n = body.node_count(); n < play.mesh.nodes(); ++n)
      EXPECT_TRUE(body.dividable[play.mesh.at_rest(n)]) << seed;
    long removed = 0;
    for (std::int32_t t = 0; t < body.tetrahedron_count(); ++t) {
      if (!play.mesh.is_removed(t)) continue;
      ++removed;
      for (int c = 0; c < 4; ++c) EXPECT_TRUE(body.dividable[body.tetrahedra[4 * t + c]]) << seed;
    }
    EXPECT_GT(removed, 0);
    // What has such a node hangs together.
    std::set<std::int32_t> pieces;
    for (std::int32_t t = 0; t < body.tetrahedron_count(); ++t)
      for (int c = 0; c < 4; ++c)
        if (!body.dividable[body.tetrahedra[4 * t + c]]) pieces.insert(play.mesh.pieces().piece_of(t));
    EXPECT_EQ(pieces.size(), 1u);
  }
}

TEST(CutMesh, ForgetsAllCuts) {
  RandomCuts cuts(3), again(3);
  for (int i = 0; i < 40; ++i) ASSERT_EQ(cuts.step(), "") << i;
  ASSERT_GT(cuts.play.mesh.nodes(), cuts.body.node_count());
  cuts.play.mesh.forget();
  cuts.play.positions = cuts.body.nodes;
  EXPECT_EQ(cuts.play.mesh.nodes(), cuts.body.node_count());
  EXPECT_EQ(cuts.play.mesh.pending(), 0);
  ASSERT_EQ(fault_of(cuts.play), "");
  // The same cuts again have the same result as in a mesh that was never cut.
  cuts.random = again.random, cuts.blade = again.blade, cuts.velocity = again.velocity, cuts.left = again.left;
  for (int i = 0; i < 40; ++i) {
    ASSERT_EQ(cuts.step(), "") << i;
    ASSERT_EQ(again.step(), "") << i;
    ASSERT_EQ(cuts.play.mesh.nodes(), again.play.mesh.nodes()) << i;
    ASSERT_EQ(cuts.play.mesh.surface().count(), again.play.mesh.surface().count()) << i;
  }
}

// ---- all of it ----------------------------------------------------------------------------------------------------

TEST(CutMesh, StaysManifoldUnderRandomCuts) {
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  long steps = 0, cut = 0, removed = 0, severed = 0, full = 0;
  for (std::uint64_t seed = 0; seed < 20 || (seconds() < 8 && seed < 200); ++seed) {
    RandomCuts cuts(seed);
    for (int i = 0; i < 60; ++i, ++steps) ASSERT_EQ(cuts.step(), "") << "seed " << seed << ", step " << i;
    cut += cuts.cut_faces, removed += cuts.removed, severed += cuts.severed, full += cuts.full;
  }
  std::printf("%ld steps: %ld faces, %ld tetrahedra, %ld pieces\n", steps, cut, removed, severed);
  EXPECT_GT(cut, steps / 3);
  EXPECT_GT(removed, 10);
  EXPECT_GT(severed, 10);
  EXPECT_GT(full, 0);
}

}  // namespace
}  // namespace palpate::tests
