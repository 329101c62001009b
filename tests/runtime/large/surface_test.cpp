// What else a scene may do under large deformation: tools meet the deformed surface, queries and the report see it, the rest state
// is an equilibrium under the preload, forces relax.
#include <gmock/gmock.h>

#include "tests/runtime/large/pressed_box.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

const TouchedBox& box() {
  return large_box();
}
const Vector3d kOut(1, 0, 0);  // of the far face x = 60 mm

// Solved in the touch, and beside it.
class LargeSurface : public testing::TestWithParam<palpate_deformation_model> {};
INSTANTIATE_TEST_SUITE_P(Both, LargeSurface,
                         testing::Values(PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE));

SceneDef deformed_def(palpate_deformation_model model, palpate_contact_law law = PALPATE_LAW_STICKING) {
  SceneDef def = large_def(PALPATE_CONTACT_PATCH);
  def.large.deformation = model;
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = law, def.queries.queries = PALPATE_QUERIES_ON;
  return def;
}

TEST_P(LargeSurface, ASecondToolMeetsTheSurfaceWhereItIs) {
  Play play(deformed_def(GetParam()));
  const Vector3d deep(0.06, 0.02, 0.02);
  const double y = 0.031, z = 0.022;
  play.move({deep + 1e-4 * kOut, Vector3d(0.07, y, z)});
  for (int tick = 0; tick <= 120; ++tick) play.move({deep - 1e-4 * tick * kOut, Vector3d(0.07, y, z)});
  ASSERT_EQ(play.touching(0), 1);
  const double front = play.front(y, z);
  EXPECT_LT(front, 0.058) << "the surface has not moved there";
  double x = 0.0605;
  for (; x > 0.04; x -= 5e-5) {
    play.move({deep - 0.012 * kOut, Vector3d(x, y, z)});
    if (play.touching(1) > 0) break;
  }
  if (GetParam() == PALPATE_DEFORMATION_LARGE) {
    EXPECT_NEAR(x, front, 5e-5 + 1e-6);
    return;
  }
  // Beside the touch a disc meets the surface where its row has no force, in the dent of the first one (docs/method.md, section 9).
  EXPECT_LE(x, front + 5e-5 + 1e-6);
  EXPECT_GT(x, front - 0.0015);
  EXPECT_GE(play.force(1)[0], 0);
  EXPECT_LT(play.force(1)[0], 0.02 * play.force(0)[0]);
}

TEST_P(LargeSurface, AContactHoldsWhileItIsPressedAndEndsWhereThePointIsOut) {
  for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    Play play(deformed_def(GetParam(), law));
    const Vector3d at(0.06, 0.025, 0.02);
    play.move({at + 1e-4 * kOut});
    for (int tick = 1; tick <= 150; ++tick) {
      play.move({at - 1e-4 * tick * kOut});
      ASSERT_EQ(play.touching(0), 1) << law << tick;
      ASSERT_GT(play.force(0)[0], 0) << law << tick;
    }
    for (int tick = 149; tick >= 5; --tick) {
      play.move({at - 1e-4 * tick * kOut});
      ASSERT_EQ(play.touching(0), 1) << law << tick;
    }
    for (int tick = 5; tick >= -20; --tick) play.move({at - 1e-4 * tick * kOut});
    EXPECT_EQ(play.touching(0), 0) << law;
    for (int tick = 0; tick < 60; ++tick) play.move({at + 2e-3 * kOut});
    EXPECT_EQ(play.touching(0), 0) << law;
    EXPECT_NEAR(play.front(0.025, 0.02), 0.06, 1e-6) << law;
  }
}

// Neighbours are pressed in together, by more than their distance, and then leave one after the other.
TEST_P(LargeSurface, NeighboursHoldTogetherAndLeaveOneAfterTheOther) {
  for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    Play play(deformed_def(GetParam(), law));
    const std::vector<Vector3d> at = {{0.06, 0.018, 0.02}, {0.06, 0.026, 0.02}, {0.06, 0.034, 0.02}};
    const auto moved = [&](double a, double b, double c) {
      return std::vector<Vector3d>{at[0] - a * kOut, at[1] - b * kOut, at[2] - c * kOut};
    };
    play.move(moved(-1e-4, -1e-4, -1e-4), 0.003);
    for (int tick = 1; tick <= 120; ++tick) {
      play.move(moved(1e-4 * tick, 1e-4 * tick, 1e-4 * tick), 0.003);
      for (int i = 0; i < 3; ++i) ASSERT_EQ(play.touching(i), 1) << law << tick << i;
    }
    // The middle one comes out while the others hold the surface down: free of it at once where it may not pull.
    int left = 0;
    for (int tick = 120; tick >= -10; --tick) {
      play.move(moved(0.012, 1e-4 * tick, 0.012), 0.003);
      ASSERT_EQ(play.touching(0), 1) << law << tick;
      ASSERT_EQ(play.touching(2), 1) << law << tick;
      if (play.touching(1) == 0 && left == 0) left = tick;
    }
    EXPECT_EQ(play.touching(1), 0) << law;
    EXPECT_GT(left, 5) << law << ": it left where the others hold the surface";
    for (int tick = 120; tick >= -10; --tick) play.move(moved(1e-4 * tick, -1e-3, 1e-4 * tick), 0.003);
    EXPECT_EQ(play.touching(0) + play.touching(2), 0) << law;
  }
}

TEST_P(LargeSurface, QueriesSeeTheDeformedSurface) {
  for (const auto shape : {PALPATE_SHAPE_OFF, PALPATE_SHAPE_SURFACE, PALPATE_SHAPE_VOLUME}) {
    SceneDef def = deformed_def(GetParam());
    def.shape = shape;
    Play play(def), seen(deformed_def(GetParam()));
    const Vector3d at(0.06, 0.025, 0.02);
    for (Play* one : {&play, &seen})
      for (int tick = -1; tick <= 100; ++tick) one->move({at - 1e-4 * tick * kOut});
    const double origin[3] = {0.08, 0.0231, 0.0172}, along[3] = {-1, 0, 0};
    palpate_surface_hit hit = {};
    hit.struct_bytes = sizeof hit;
    EXPECT_EQ(palpate_scene_cast_ray(play.scene.get(), play.contacts.get(), origin, along, 1, &hit), 0u);
    ASSERT_EQ(hit.hit, 1);
    const double front = seen.front(origin[1], origin[2]);
    EXPECT_LT(front, 0.057);
    EXPECT_NEAR(hit.point[0], front, 1e-8) << shape;  // single precision of the displacement
    double distance = 0;
    const double inside[3] = {front - 1e-4, origin[1], origin[2]}, outside[3] = {front + 1e-4, origin[1], origin[2]};
    palpate_scene_signed_distance(play.scene.get(), play.contacts.get(), inside, &distance);
    EXPECT_LT(distance, 0);
    palpate_scene_signed_distance(play.scene.get(), play.contacts.get(), outside, &distance);
    EXPECT_GT(distance, 0);
    // Of another step, and at rest.
    play.move({at + 1e-3 * kOut});
    EXPECT_EQ(palpate_scene_cast_ray(play.scene.get(), nullptr, origin, along, 1, &hit), 0u);
    EXPECT_NEAR(hit.point[0], 0.06, 1e-12);
  }
}

TEST_P(LargeSurface, TheReportTellsPlaceNormalAndVelocity) {
  SceneDef def = deformed_def(GetParam());
  def.report.report = PALPATE_REPORT_CONTACTS, def.contact = PALPATE_CONTACT_POINT;
  Play play(def);
  const Vector3d at(0.06, 0.023, 0.021);
  for (int tick = -1; tick <= 100; ++tick) {
    const Vector3d p = at + Vector3d(-1e-4, 0.4e-4, 0) * tick;
    play.move({p});
    const palpate_contact_report* report = palpate_scene_report(play.scene.get());
    ASSERT_NE(report, nullptr);
    if (tick < 5) continue;
    ASSERT_EQ(report->contact_count, 1) << tick;
    const palpate_contact& contact = *palpate_report_contact(report, 0);
    EXPECT_LE((Vector3d(contact.place) - p).norm(), 2e-6) << tick;  // the step's tolerance of C
    EXPECT_LE(Vector3d(contact.velocity).norm(), 1e-3) << tick;     // it sticks; the tool moves at 0.1 m/s
    const auto places = play.places();
    const auto& t = box().body.triangles[static_cast<std::size_t>(contact.triangle)];
    const Vector3d normal = (places[t[1]] - places[t[0]]).cross(places[t[2]] - places[t[0]]).normalized();
    EXPECT_LE((Vector3d(contact.normal) - normal).norm(), 1e-5) << tick;
    EXPECT_LE((Vector3d(contact.force) - play.force(0)).norm(), 1e-12 + 1e-9 * play.force(0).norm());
  }
}

TEST_P(LargeSurface, ForcesRelax) {
  SceneDef def = large_def(PALPATE_CONTACT_NODE);
  def.large.deformation = GetParam();
  Play plain(def);
  def.relaxation.terms = 1;
  def.relaxation.share[0] = 0.4, def.relaxation.time[0] = 0.05;
  Play relaxing(def);
  Vector3d force[2];
  int k = 0;
  for (Play* play : {&plain, &relaxing}) {
    const std::vector<palpate_grip> grips = {grip_at_node(box().touchable.back(), {-0.01, 0, 0})};
    const palpate_tool tool = tool_of(grips);
    for (int tick = 0; tick < 500; ++tick) play->touch(tool);
    force[k++] = play->force(0);
  }
  EXPECT_LE((force[1] - 0.6 * force[0]).norm(), 1e-3 * force[0].norm());
}

TEST_P(LargeSurface, UnderAPreloadTheRestStateIsAnEquilibrium) {
  for (const bool nodal : {false, true}) {
    VectorXd load, linear;
    const TouchedBody body = large_body(nodal, [&](BundleParts& parts) {
      const TouchedBox plain;
      const Seen seen(plain, nodal, 0);
      const LargeReference reference(seen.body);
      load = VectorXd::Zero(reference.dofs());
      for (Eigen::Index i = 0; i < load.size(); i += 3)
        if (!seen.fixed[static_cast<std::size_t>(i)]) load[i + 2] = -0.008;  // N at each node
      const Eigen::MatrixXd k = Eigen::MatrixXd(reference.tangent(VectorXd::Zero(reference.dofs())));
      std::vector<Eigen::Index> free;
      for (Eigen::Index i = 0; i < load.size(); ++i)
        if (!seen.fixed[static_cast<std::size_t>(i)]) free.push_back(i);
      linear = VectorXd::Zero(load.size());
      const VectorXd solved = Eigen::MatrixXd(k(free, free)).llt().solve(VectorXd(load(free)));
      linear(free) = solved;
      parts.set(formats::SectionId::preload_displacement, {static_cast<std::size_t>(load.size() / 3), 3},
                std::vector<double>(linear.data(), linear.data() + linear.size()));
    });
    SceneDef def = large_def(PALPATE_CONTACT_NODE);
    def.large.deformation = GetParam();
    def.preload = PALPATE_PRELOAD_ON, def.shape = PALPATE_SHAPE_VOLUME, def.collision = PALPATE_COLLISION_REST;
    Play play(def, body);
    play.move({});
    const auto count = static_cast<std::int32_t>(body.body.mesh.nodes.size());
    std::vector<float> u(3 * static_cast<std::size_t>(count)), x(u.size());
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = u.data(), out.positions = x.data(), out.node_capacity = count;
    palpate_scene_shape(play.scene.get(), play.contacts.get(), &out);
    VectorXd sag(3 * count);
    for (Eigen::Index i = 0; i < sag.size(); ++i) {
      EXPECT_EQ(u[static_cast<std::size_t>(i)], 0);
      sag[i] = static_cast<double>(x[static_cast<std::size_t>(i)]) - body.node(static_cast<std::int32_t>(i / 3))[i % 3];
    }
    EXPECT_GT((sag - linear).norm(), 0.03 * linear.norm()) << "not a large strain";
    const Seen seen(body, nodal, 0);
    const LargeReference reference(seen.body);
    VectorXd held;
    reference.energy(sag, &held);
    for (Eigen::Index i = 0; i < held.size(); ++i)
      if (seen.fixed[static_cast<std::size_t>(i)]) held[i] = 0;
    // The rest state is solved to 1e-4; the positions have single precision: 4e-9 m of 60 mm, against 10 mm of sag.
    EXPECT_LE((held - load).norm(), 2e-3 * load.norm()) << nodal;

    // A push and its release end there again; the push itself is the converged one, with the load.
    const std::int32_t node = body.touchable.back();
    for (int tick = 1; tick <= 100; ++tick) {
      const std::vector<palpate_grip> grips = {grip_at_node(node, {-1e-4 * tick, 0, 0})};
      const palpate_tool tool = tool_of(grips);
      EXPECT_EQ(play.touch(tool), 0u);
    }
    palpate_scene_shape(play.scene.get(), play.contacts.get(), &out);
    VectorXd pushed(3 * count);
    for (Eigen::Index i = 0; i < pushed.size(); ++i)
      pushed[i] =
          static_cast<double>(x[static_cast<std::size_t>(i)]) - body.node(static_cast<std::int32_t>(i / 3))[i % 3];
    reference.energy(pushed, &held);
    for (Eigen::Index i = 0; i < held.size(); ++i)
      if (seen.fixed[static_cast<std::size_t>(i)]) held[i] = 0;
    const Vector3d at_node = (held - load).segment<3>(3 * node);
    EXPECT_LE((at_node + play.force(0)).norm(), 0.02 * at_node.norm()) << nodal;
    for (int tick = 0; tick < 60; ++tick) play.move({});
    palpate_scene_shape(play.scene.get(), play.contacts.get(), &out);
    for (const float v : u) EXPECT_LE(std::abs(v), 1e-6f);
  }
}

TEST_P(LargeSurface, APreloadThatFlattensTheBodyIsRefused) {
  const TouchedBox body({}, [&](BundleParts& parts) {
    with_large(true)(parts);
    const auto nodes = parts.get<double>(formats::SectionId::nodes);
    std::vector<double> preload(nodes.size(), 0.0);
    for (std::size_t i = 0; i < nodes.size(); i += 3) preload[i] = -8 * nodes[i];
    parts.set(formats::SectionId::preload_displacement, {nodes.size() / 3, 3}, preload);
  });
  SceneDef def = large_def(PALPATE_CONTACT_NODE);
  def.large.deformation = GetParam();
  def.preload = PALPATE_PRELOAD_ON;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_create(body.bundle(), &def, &scene, &error), PALPATE_ERROR_EFFECT);
  EXPECT_THAT(error.text, testing::HasSubstr("comes to rest"));
}

}  // namespace
}  // namespace palpate::tests
