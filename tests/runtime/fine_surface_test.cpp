// Tools that meet a finer surface than the mesh's: contact begins on it, its normals count, and it is the one that is drawn.
#include <random>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/random_scenes.h"
#include "tests/support/fine_body.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const TouchedBody& ball() {
  static const TouchedBody shared(coarse_ball());
  return shared;
}
const FineHost& sphere() {
  static const FineHost shared = fine_sphere(4);
  return shared;
}

SceneDef ball_def(const palpate_fine_surface* fine, palpate_collision collision = PALPATE_COLLISION_DEFORMED,
                  palpate_contact_model contact = PALPATE_CONTACT_POINT) {
  SceneDef def = unlimited_def(collision, contact);
  if (fine) def.fine_surface = *fine;
  def.report.report = PALPATE_REPORT_CONTACTS, def.queries.queries = PALPATE_QUERIES_ON;
  return def;
}

// A scene with one tool of one point.
struct Touching : TouchedScene {
  Touching(const TouchedBody& body, const SceneDef& def) : TouchedScene(body, def) {}
  // Whether the point touches.
  bool touch(const Vector3d& p, double radius = 0) {
    press(p, radius);
    return touches();
  }
  const palpate_contact& contact() const { return *palpate_report_contact(palpate_scene_report(scene.get()), 0); }
  palpate_surface_hit closest(const Vector3d& p) {
    palpate_surface_hit hit = palpate_default_surface_hit();
    palpate_scene_closest_point(scene.get(), contacts, p.data(), INFINITY, &hit);
    return hit;
  }
};

// Directions from the middle of the ball, away from its held part.
std::vector<Vector3d> directions() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> one(-1, 1);
  std::vector<Vector3d> all;
  while (all.size() < 12) {
    const Vector3d d(one(random), one(random), one(random));
    if (d.norm() > 0.3 && d.norm() < 1 && d.normalized()[2] > 0) all.push_back(d.normalized());
  }
  return all;
}

// m, from the middle: where the ray passes through a surface.
double radius_along(const SurfaceFirst& surface, const Vector3d& direction) {
  return 2 * kBallRadius - DeformedTruth(surface).first_crossing(2 * kBallRadius * direction, -direction, 1).distance;
}

TEST(FineSurface, ContactBeginsOnItAndNotOnTheMesh) {
  const palpate_fine_surface fine = sphere().view();
  const SurfaceFirst fine_surface = sphere().surface();
  double farthest = 0;
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const Vector3d& out : directions()) {
      const double r = radius_along(fine_surface, out), on_mesh = radius_along(ball().body, out);
      farthest = std::max(farthest, r - on_mesh);
      ASSERT_GT(r, on_mesh + 1e-4);
      Touching fine_scene(ball(), ball_def(&fine, collision)), mesh_scene(ball(), ball_def(nullptr, collision));
      for (const double above : {.01, 1e-9}) {
        EXPECT_FALSE(fine_scene.touch((r + above) * out));
        EXPECT_FALSE(mesh_scene.touch((on_mesh + above) * out));
      }
      EXPECT_TRUE(fine_scene.touch((r - 1e-9) * out));
      EXPECT_TRUE(mesh_scene.touch((on_mesh - 1e-9) * out));
      // Where it touches: on the fine surface, within the depth.
      const palpate_contact& contact = fine_scene.contact();
      EXPECT_LT((Vector3d(contact.place) - r * out).norm(), 3e-9);
      const DeformedTruth::Crossing crossing =
          DeformedTruth(fine_surface).first_crossing(2 * kBallRadius * out, -out, 1);
      const Vector3d normal = DeformedTruth(fine_surface).outward(static_cast<std::size_t>(crossing.triangle));
      EXPECT_LT((Vector3d(contact.normal) - normal).norm(), 1e-6);  // the contact deforms it by a nanometre
      EXPECT_NEAR(contact.depth, 1e-9 * out.dot(normal), 1e-12);
      // The mesh's place below it: what a grip takes.
      const Vector3d below = ball().place(contact.triangle, Vector3d(contact.barycentric));
      EXPECT_LT((below - contact.depth * normal - Vector3d(contact.place)).norm(), 0.004);
      EXPECT_GT(below.normalized().dot(out), 0.99);
      EXPECT_NEAR(Vector3d(contact.barycentric).sum(), 1, 1e-12);
    }
  EXPECT_GT(farthest, 0.0015);
}

TEST(FineSurface, ALinearPushBringsItsPlaceToTheTool) {
  // The place moves with the nodes around it: by what the contact imposes on the mesh below, apart from how the triangle turns.
  const palpate_fine_surface fine = sphere().view();
  const SurfaceFirst fine_surface = sphere().surface();
  for (const Vector3d& out : directions()) {
    const double r = radius_along(fine_surface, out);
    Touching scene(ball(), ball_def(&fine));
    scene.touch((r + 1e-3) * out);
    double last = 0;
    for (int ms = 1; ms <= 30; ++ms) {
      const double depth = 1e-4 * ms;
      ASSERT_TRUE(scene.touch((r - depth) * out));
      EXPECT_NEAR(scene.contact().depth, depth, 0.02 * depth + 1e-9) << "the ball is not quite round";
      EXPECT_LT((Vector3d(scene.contact().place) - (r - depth) * out).norm(), 0.2 * depth);
      EXPECT_LT(std::abs(scene.contact().gap), 0.05 * depth + 1e-9);
      const double force = scene.force().dot(out);
      EXPECT_GT(force, last);
      last = force;
    }
    // It comes out where the surface would be without it, which is at rest.
    EXPECT_TRUE(scene.touch((r - 1e-9) * out));
    EXPECT_FALSE(scene.touch((r + 1e-9) * out));
    EXPECT_EQ(scene.force().norm(), 0);
  }
}

// m: the largest distance between the vertices of the mesh that is drawn and the surface that queries, and so tools, meet.
double drawn_to_met(const palpate_fine_surface* fine, double depth, double* moved) {
  palpate_render_mesh drawn = render_mesh(sphere().positions.data(), nullptr, sphere().vertices());
  Touching scene(ball(), with(ball_def(fine), drawn));
  scene.hold({grip_at_place(7, {.2, .3, .5}, -depth * ball().outward(7))});
  std::vector<float> u = scene.shape(), x(sphere().positions.size());
  palpate_shape_out shape = shape_out(u.data(), nullptr, ball().body.surface_nodes);
  shape.node_count = ball().body.surface_nodes;
  palpate_skin_out out = skin_out(x.data(), nullptr, sphere().vertices());
  palpate_scene_skin(scene.scene.get(), &shape, &out);
  double farthest = 0;
  for (std::int32_t v = 0; v < sphere().vertices(); ++v) {
    const Vector3d at = Eigen::Map<const Eigen::Vector3f>(&x[3 * v]).cast<double>();
    farthest = std::max(farthest, scene.closest(at).distance);
    *moved = std::max(*moved, (at - sphere().vertex(v)).norm());
  }
  return farthest;
}

TEST(FineSurface, IsTheSurfaceThatIsDrawn) {
  const palpate_fine_surface fine = sphere().view();
  for (const double depth : {.0005, .001, .002, .004}) {
    double moved = 0;
    const double met = drawn_to_met(&fine, depth, &moved), mesh = drawn_to_met(nullptr, depth, &moved);
    EXPECT_GT(moved, 0.5 * depth);
    EXPECT_GT(mesh, 0.0015);
    // Edges of 16 mm, of which one end is pressed in, stretch by depth^2 / (2 (16 mm)^2), and the offsets of up to 2 mm turn by as
    // much less. The skin's positions are floats.
    EXPECT_LT(met, 1e-8 + 0.002 * (depth / 0.016 + 0.5 * depth * depth / (0.016 * 0.016)) * 0.02);
  }
}

TEST(FineSurface, TurnsWithTheWhole) {
  const BoundFine fine(sphere(), ball().body);
  for (const double angle : {1e-4, 0.1, 0.5}) {
    const Matrix3d turn = Eigen::AngleAxisd(angle, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    const Vector3d shift(0.01, -0.02, 0.005);
    std::vector<float> u;
    for (std::int32_t n = 0; n < ball().body.surface_nodes; ++n) {
      const Vector3d moved = turn * ball().node(n) + shift - ball().node(n);
      for (int d = 0; d < 3; ++d) u.push_back(static_cast<float>(moved[d]));
    }
    const std::vector<float> moved = fine.moved_by(u);
    double worst = 0;
    for (std::int32_t v = 0; v < sphere().vertices(); ++v)
      worst = std::max(worst, (Eigen::Map<const Eigen::Vector3f>(&moved[3 * v]).cast<double>() -
                               (turn * sphere().vertex(v) + shift - sphere().vertex(v)))
                                  .norm());
    // Of second order in the angle, times the farthest offset, 3.2 mm; floats.
    EXPECT_LT(worst, 1e-8 + 0.0032 * angle * angle) << angle;
  }
}

// The bound on which all tests of tool points rest.
TEST(FineSurface, NoVertexMovesFartherThanItsReach) {
  const BoundFine fine(sphere(), ball().body);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const std::size_t nodes = static_cast<std::size_t>(ball().body.surface_nodes);
  double tightest = 0;
  for (int round = 0; round < 50; ++round) {
    std::vector<Vec3> a(nodes), b(nodes);
    std::vector<double> apart(nodes);
    const double size = std::pow(10.0, -4 + 0.06 * round);
    for (std::size_t n = 0; n < nodes; ++n) {
      a[n] = size * Vec3{normal(random), normal(random), normal(random)};
      b[n] = a[n] + (n % 7 == static_cast<std::size_t>(round) % 7 ? size : 0) *
                        Vec3{normal(random), normal(random), normal(random)};
      apart[n] = length(b[n] - a[n]);
    }
    for (std::int32_t v = 0; v < sphere().vertices(); ++v) {
      const Vec3 u = fine->displacement(v, [&](std::int32_t n) { return a[n]; }),
                 w = fine->displacement(v, [&](std::int32_t n) { return b[n]; });
      const double reach = fine->reach(v, apart.data());
      ASSERT_LE(length(w - u), reach * (1 + 1e-9) + 1e-15 * size) << v;  // rounding
      if (reach > 0) tightest = std::max(tightest, length(w - u) / reach);
    }
  }
  EXPECT_GT(tightest, 0.8);
}

TEST(FineSurface, TheMeshsOwnTrianglesChangeNothing) {
  // But for the rounding of positions to single precision.
  const TouchedBox box;
  const FineHost own = fine_of(box.body, 0, 0);
  const palpate_fine_surface fine = own.view();
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto law : kEveryLaw) {
      SceneDef def = unlimited_def(collision, law, PALPATE_CONTACT_POINT);
      Touching mesh(box, def);
      def.fine_surface = fine;
      Touching same(box, def);
      int touching = 0;
      for (int ms = 0; ms < 200; ++ms) {
        const Vector3d p(.0611 - 2e-5 * ms, .017 + 1e-5 * ms, .021 + 2e-5 * ms);
        ASSERT_EQ(mesh.touch(p), same.touch(p)) << ms;
        touching += mesh.force().norm() > 0;
        ASSERT_LT((mesh.force() - same.force()).norm(), 1e-5 * mesh.force().norm() + 1e-6);
      }
      EXPECT_GT(touching, 100);
    }
}

TEST(FineSurface, ADiscTakesTheMeanNormalOverItself) {
  // A box whose drawn surface has bumps of a quarter millimetre every 3 mm: steep for a point, nothing for a disc.
  const TouchedBox box;
  const FineHost bumpy = fine_of(box.body, 3, 0.00025);
  const palpate_fine_surface fine = bumpy.view();
  double worst[2] = {0, 0};
  for (int place = 0; place < 20; ++place)
    for (const bool disc : {false, true}) {
      Touching scene(box, unlimited_def(PALPATE_LAW_SLIDING, fine));
      const double y = .018 + .0007 * place, z = .016 + .0004 * place;
      for (int ms = 0; ms <= 20; ++ms) scene.touch({.061 - 1e-4 * ms, y, z}, disc ? .006 : 0);
      ASSERT_GT(scene.force()[0], 0);
      worst[disc] = std::max(worst[disc], std::hypot(scene.force()[1], scene.force()[2]) / scene.force()[0]);
    }
  EXPECT_GT(worst[0], 0.09);
  EXPECT_LT(worst[1], 0.02);
}

TEST(FineSurface, QueriesMeetIt) {
  const palpate_fine_surface fine = sphere().view();
  const SurfaceFirst surface = sphere().surface();
  Touching scene(ball(), with(ball_def(&fine), PALPATE_COLLISION_OFF, PALPATE_REPORT_OFF));
  for (const Vector3d& out : directions()) {
    const double r = radius_along(surface, out);
    const Vector3d from = 0.05 * out, along = -out;
    palpate_surface_hit hit = palpate_default_surface_hit();
    EXPECT_EQ(palpate_scene_cast_ray(scene.scene.get(), nullptr, from.data(), along.data(), 1, &hit), 0u);
    EXPECT_NEAR(hit.distance, 0.05 - r, 1e-12);
    EXPECT_LT((Vector3d(hit.point) - r * out).norm(), 1e-12);
    EXPECT_GT(ball().place(hit.triangle, Vector3d(hit.barycentric)).normalized().dot(out), 0.99);
    double distance = 0;
    palpate_scene_signed_distance(scene.scene.get(), nullptr, from.data(), &distance);
    EXPECT_NEAR(distance, DeformedTruth(surface).signed_distance(from), 1e-12);
  }
}

// Points come down on a body that grips open and bend, beside the winding number of its fine surface.
TEST(FineSurface, IsMetWhereGripsOpenABody) {
  const TouchedBody block(slotted_block());
  const FineHost host = fine_of(block.body, 1, 0.0005);
  const BoundFine bound(host, block.body);
  std::vector<palpate_grip> rim;
  int in_the_air = 0, touched = 0, contradictions = 0;
  for (double x = .0215; x < .033; x += .0023)
    for (const double y : {.0041, .0263}) {
      SceneDef def = deformed_def();
      const palpate_fine_surface fine = host.view();
      def.fine_surface = fine;
      Watched watched(block, def, &host, &bound);
      Vector3d p(x, y, .070);
      for (int ms = 0; ms < 180 && !watched.touches(); ++ms) {
        rim.clear();
        for (const std::int32_t n : block.touchable)
          if (std::abs(block.node(n)[0] - .030) < 1e-9 && std::abs(block.node(n)[2] - .050) < 1e-9)
            rim.push_back(grip_at_node(n, {-2e-4 * std::min(ms, 50), 0, 0}));
        if (ms > 50) p[2] -= 5e-4;
        watched.step(p, rim);
        const double tolerance = watched.moved() + kStored;
        in_the_air += watched.height() > tolerance;
        contradictions += watched.touches() ? watched.height() > tolerance : watched.height() < -tolerance;
      }
      touched += watched.touches();
    }
  EXPECT_EQ(rim.size(), 4u);
  EXPECT_EQ(contradictions, 0);
  EXPECT_GT(in_the_air, 500);
  EXPECT_EQ(touched, 10);
}

TEST(FineSurface, IsMetInRandomScenes) {
  const RandomScenes scenes(0.0004);
  Contradictions thick, thin;
  for (std::uint64_t seed = 0; seed < 12; ++seed)
    scenes.play(seed, 500, scenes.is_thin(seed) ? &thin : &thick,
                [](const Contradiction& found) { ADD_FAILURE() << sentence_of(found); });
  for (const Contradictions& all : {thick, thin}) {
    EXPECT_GT(all.near, all.steps / 20);
    EXPECT_GT(all.begun, 3);
    EXPECT_GT(all.touched, all.steps / 50);
  }
}

TEST(FineSurface, BelongsToASavedState) {
  const FineHost other_host = fine_sphere(3);
  const palpate_fine_surface fine = sphere().view(), other = other_host.view();
  Touching scene(ball(), ball_def(&fine)), same(ball(), ball_def(&fine)), another(ball(), ball_def(&other)),
      mesh(ball(), ball_def(nullptr));
  const Vector3d out(0, 0, 1);
  for (int ms = 0; ms < 20; ++ms) scene.touch((kBallRadius + .001 - 1e-4 * ms) * out);
  ASSERT_GT(scene.force().norm(), 0);
  std::vector<std::uint64_t> state(palpate_scene_state_bytes(scene.scene.get()) / 8);
  ASSERT_EQ(palpate_scene_save(scene.scene.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
  const auto restored = [&](Touching& into) {
    return palpate_scene_restore(into.scene.get(), state.data(), 8 * state.size(), nullptr);
  };
  ASSERT_EQ(restored(same), PALPATE_OK);
  const Vector3d next = (kBallRadius - .0015) * out;
  scene.touch(next), same.touch(next);
  EXPECT_EQ(scene.force(), same.force());
  EXPECT_EQ(restored(another), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(restored(mesh), PALPATE_ERROR_ARGUMENT);
}

// ---- what is refused -------------------------------------------------------------------------------------------------

std::string refusal_of(const FineHost& host, const std::function<void(SceneDef&)>& change = {}) {
  const palpate_fine_surface fine = host.view();
  SceneDef def = ball_def(&fine);
  if (change) change(def);
  const palpate_error error = refusal_of(ball(), def);
  EXPECT_TRUE(error.status == PALPATE_OK || error.status == PALPATE_ERROR_ARGUMENT);
  return error.text;
}

TEST(FineSurface, IsRefusedWhereItIsNotTheOrgansClosedSurface) {
  using testing::HasSubstr;
  const FineHost good = fine_sphere(2);
  EXPECT_EQ(refusal_of(good), "");
  FineHost bad = good;
  bad.positions[3 * 17 + 1] = NAN;
  EXPECT_THAT(refusal_of(bad), HasSubstr("vertex 17"));
  bad = good;
  bad.positions[3 * 17 + 1] = INFINITY;
  EXPECT_THAT(refusal_of(bad), HasSubstr("vertex 17"));
  bad = good;
  for (float& x : bad.positions) x *= 1000;  // millimetres
  EXPECT_THAT(refusal_of(bad), HasSubstr("in metres"));
  for (const std::int32_t wrong : {-1, good.vertices(), 0x7fffffff}) {
    bad = good;
    bad.triangles[3 * 5 + 2] = wrong;
    EXPECT_THAT(refusal_of(bad), HasSubstr("triangle 5 has vertex " + std::to_string(wrong)));
  }
  bad = good;
  bad.triangles[3 * 5] = bad.triangles[3 * 5 + 1];
  EXPECT_THAT(refusal_of(bad), HasSubstr("a vertex twice"));
  bad = good;
  bad.triangles.resize(bad.triangles.size() - 3);  // open
  EXPECT_THAT(refusal_of(bad), HasSubstr("give a closed surface"));
  bad = good;
  std::swap(bad.triangles[0], bad.triangles[1]);  // one triangle the other way round
  EXPECT_THAT(refusal_of(bad), HasSubstr("give a closed surface"));
  bad = good;
  bad.triangles.insert(bad.triangles.end(), bad.triangles.begin(), bad.triangles.begin() + 3);  // one triangle twice
  EXPECT_THAT(refusal_of(bad), HasSubstr("give a closed surface"));
  bad = good;
  for (std::size_t t = 0; t < bad.triangles.size(); t += 3) std::swap(bad.triangles[t], bad.triangles[t + 1]);
  EXPECT_THAT(refusal_of(bad), HasSubstr("counter-clockwise from outside"));
  EXPECT_THAT(refusal_of({}, [](auto& def) { def.fine_surface.vertex_count = 3; }), HasSubstr("4 vertices"));
  EXPECT_THAT(
      refusal_of(good,
                 [](auto& def) { def.collision = PALPATE_COLLISION_OFF, def.queries.queries = PALPATE_QUERIES_OFF; }),
      HasSubstr("collision and queries are OFF"));
  palpate_fine_surface none = palpate_default_fine_surface();
  none.vertex_count = none.triangle_count = 10;
  EXPECT_THAT(refusal_of(good, [&](auto& def) { def.fine_surface = none; }), HasSubstr("must not be NULL"));
  palpate_fine_surface unsized = good.view();
  unsized.part.struct_bytes = 0;
  EXPECT_THAT(refusal_of(good, [&](auto& def) { def.fine_surface = unsized; }),
              HasSubstr("start from palpate_default_fine_surface()"));
}

}  // namespace
}  // namespace palpate::tests
