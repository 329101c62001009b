// Organs that touch one another: against full solves and Hertz, at rest, pushed at random, overlapping, with friction.
#include "studies/coupled/coupled_rows.h"
#include "tests/runtime/world/random_pushes.h"
#include "tests/runtime/world/touching_world.h"
#include "tests/support/ball_body.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// The displacement along z of nodes per force along z on them, from the full stiffness.
Eigen::MatrixXd compliance_along_z(const TouchedBody& body, const std::vector<std::int32_t>& nodes) {
  std::vector<Eigen::Index> free;
  std::vector<Eigen::Index> place(static_cast<std::size_t>(body.dofs()), -1);
  for (Eigen::Index i = 0; i < body.dofs(); ++i)
    if (!body.fixed[static_cast<std::size_t>(i)]) {
      place[static_cast<std::size_t>(i)] = static_cast<Eigen::Index>(free.size());
      free.push_back(i);
    }
  Eigen::MatrixXd loads =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(free.size()), static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t i = 0; i < nodes.size(); ++i)
    loads(place[static_cast<std::size_t>(3 * nodes[i] + 2)], static_cast<Eigen::Index>(i)) = 1;
  const Eigen::MatrixXd stiffness = body.stiffness()(free, free), u = stiffness.llt().solve(loads);
  Eigen::MatrixXd c(loads.cols(), loads.cols());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    c.row(static_cast<Eigen::Index>(i)) = u.row(place[static_cast<std::size_t>(3 * nodes[i] + 2)]);
  return c;
}

// Forces of rows that only push.
Eigen::VectorXd unilateral(const Eigen::MatrixXd& c, const Eigen::VectorXd& d) {
  return studies::solve_rows(c, d, std::vector<bool>(static_cast<std::size_t>(d.size()), true));
}

std::int32_t node_at(const TouchedBody& body, const Vector3d& place) {
  for (std::int32_t n = 0; n < body.body.surface_nodes; ++n)
    if ((body.node(n) - place).norm() < 1e-9) return n;
  return -1;
}

// The nodes of both blocks coincide where they touch, so that a full solve with both stiffness matrices has the same constraints.
TEST(Touching, TwoBlocksPressAsFullSolvesDo) {
  Touching blocks({{&upper_block(), {0, 0, 0.03}}, {&lower_block(), {0, 0, 0}}});
  std::vector<std::int32_t> above, below;
  for (std::int32_t n = 0; n < upper_block().body.surface_nodes; ++n) {
    const Vector3d p = upper_block().node(n);
    if (p.z() != 0) continue;
    above.push_back(n), below.push_back(node_at(lower_block(), p + Vector3d(0, 0, 0.03)));
    ASSERT_GE(below.back(), 0);
  }
  const Eigen::MatrixXd c = compliance_along_z(upper_block(), above) + compliance_along_z(lower_block(), below);
  for (const double pushed : {1e-4, 1e-3, 2.5e-3}) {
    blocks.place(0, {0, 0, 0.03 - pushed});
    palpate_step_flags flags = 0;
    for (int s = 0; s < 6; ++s) flags = blocks.step();
    EXPECT_EQ(flags, 0u);
    const double expected = unilateral(c, Eigen::VectorXd::Constant(c.rows(), pushed)).sum();
    // Places on the lower block lag by a tenth of an edge, and normals turn with the surface: measured 0.6 % at 2.5 mm.
    EXPECT_NEAR(blocks.pressed(0).z() / expected, 1, 0.03) << pushed;
    EXPECT_LT(Vector3d(blocks.pressed(0) + blocks.pressed(1)).norm(), 1e-12 * expected);
    EXPECT_EQ(blocks.contacts->organ(0).tool_count, 0);
  }
  // Apart again: no force and no displacement.
  blocks.place(0, {0, 0, 0.031});
  for (int s = 0; s < 3; ++s) EXPECT_EQ(blocks.step(), 0u);
  EXPECT_EQ(blocks.pressed(0).norm(), 0);
  for (const float u : blocks.shape(1, lower_block())) EXPECT_EQ(u, 0);
}

// A block that stands on a held face presses with that face as a rigid punch does, and nothing of its own gives way.
TEST(Touching, AHeldFacePressesAnotherOrganAsARigidPunch) {
  const TouchedBody punch(block(0.015, 0.02, 4, 4, false));
  Touching blocks({{&punch, {0, 0, 0.03}}, {&lower_block(), {0, 0, 0}}});
  std::vector<std::int32_t> below;
  for (std::int32_t n = 0; n < punch.body.surface_nodes; ++n)
    if (const Vector3d p = punch.node(n); p.z() == 0) below.push_back(node_at(lower_block(), p + Vector3d(0, 0, 0.03)));
  const Eigen::MatrixXd c = compliance_along_z(lower_block(), below);
  for (const double pushed : {1e-4, 1e-3, 2.5e-3}) {
    blocks.place(0, {0, 0, 0.03 - pushed});
    palpate_step_flags flags = 0;
    for (int s = 0; s < 6; ++s) flags = blocks.step();
    EXPECT_EQ(flags, 0u);
    const double expected = unilateral(c, Eigen::VectorXd::Constant(c.rows(), pushed)).sum();
    // The normals below the punch's border lean by up to 7 degrees, halfway to the surface beside it; those of the full solve stand.
    EXPECT_NEAR(blocks.pressed(0).z() / expected, 1, 0.04) << pushed;
    EXPECT_LT(Vector3d(blocks.pressed(0) + blocks.pressed(1)).norm(), 1e-12 * expected);
    // A held vertex sinks in by 5 % at most of what its own force presses.
    for (std::int32_t i = 0; i < blocks.contacts->get()->pair_count; ++i) EXPECT_GT(blocks.pair(i).gap, -0.05 * pushed);
    for (const float u : blocks.shape(0, punch)) EXPECT_EQ(u, 0);
  }
}

// Held vertices lie closer than the nodes of the other organ: no displacement of these nodes meets all of them, and many forces would.
TEST(Touching, MoreHeldVerticesThanTheOtherOrganHasNodesAreSolved) {
  for (const int cells : {6, 12})
    for (const double friction : {0.0, 0.3}) {
      SCOPED_TRACE(testing::Message() << cells << " cells, friction " << friction);
      const TouchedBody punch(block(0.014, 0.02, cells, 3, false));
      Touching blocks({{&punch, {0.0011, 0.0007, 0.0302}}, {&lower_block(), {0, 0, 0}}}, friction);
      double before = 0;
      for (int s = 0; s < 60; ++s) {
        blocks.place(0, {0.0011 + 1e-5 * s, 0.0007, 0.0302 - 5e-5 * s});
        const palpate_step_flags flags = blocks.step();
        // 169 of them, where 16 nodes lie below, may miss their laws, but say so.
        EXPECT_EQ(flags & ~(cells == 12 ? static_cast<palpate_step_flags>(PALPATE_STEP_SOLVE_INEXACT) : 0u), 0u) << s;
        // A step presses 50 um, which is 0.04 N.
        EXPECT_LT(std::fabs(blocks.pressed(0).z() - before), 0.06) << s;
        before = blocks.pressed(0).z();
        for (std::int32_t i = 0; i < blocks.contacts->get()->pair_count; ++i)
          ASSERT_GT(blocks.pair(i).gap, -0.05 * std::max(0.0, 5e-5 * s - 2e-4) - 1e-9) << s;
      }
      EXPECT_GT(before, 0.5);
    }
}

// Where both faces are held, nothing can press them apart: the step says so until they are in one another by less than a tenth of an edge, here 0.84 mm.
TEST(Touching, HeldFacesInOneAnotherAreFlagged) {
  const TouchedBody upper(block(0.015, 0.02, 4, 4, false));
  const TouchedBody lower(block(0.03, 0.03, 8, 4, true, 8000));
  Touching blocks({{&upper, {0, 0, 0.0305}}, {&lower, {0, 0, 0}}});
  for (int s = 0; s < 3; ++s) EXPECT_EQ(blocks.step(), 0u);
  EXPECT_EQ(blocks.contacts->get()->pair_count, 0);
  blocks.place(0, {0, 0, 0.027});
  for (int s = 0; s < 3; ++s) EXPECT_EQ(blocks.step(), static_cast<palpate_step_flags>(PALPATE_STEP_NOT_TOUCHABLE));
  ASSERT_GT(blocks.contacts->get()->pair_count, 0);
  EXPECT_NEAR(blocks.pair(0).gap, -0.003, 1e-9);
  EXPECT_EQ(blocks.pressed(0).norm(), 0);
  blocks.place(0, {0, 0, 0.0295});
  for (int s = 0; s < 3; ++s) EXPECT_EQ(blocks.step(), 0u);
  // An overlap as they stand is not one that grows.
  Touching overlapping({{&upper, {0, 0, 0.0292}}, {&lower, {0, 0, 0}}});
  for (int s = 0; s < 3; ++s) EXPECT_EQ(overlapping.step(), 0u);
}

// A quarter of a cap of radius R on a stiff block, symmetric about x = 0 and y = 0. The force F belongs to the contact radius a by
// a^3 = 3 F R / (4 E*), whatever the body is like farther away.
TEST(Touching, ACapOnAStiffBlockHasTheContactRadiusOfHertz) {
  constexpr double radius = 0.05, young = 5000, poisson = 0.3, mm = 1e-3;
  GridBody grid;
  grid.lines = {std::vector<double>{0, 1 * mm, 2 * mm, 3 * mm, 4 * mm, 5 * mm, 6 * mm, 8 * mm, 12 * mm, 20 * mm},
                {0, 1 * mm, 2 * mm, 3 * mm, 4 * mm, 5 * mm, 6 * mm, 8 * mm, 12 * mm, 20 * mm},
                {0, 1 * mm, 2 * mm, 3.5 * mm, 6 * mm, 11 * mm, 20 * mm}};
  grid.held = [](auto p) { return p[2] == 0.02; };
  grid.young = young, grid.poisson = poisson;
  DenseBody cap = dense_grid(grid);
  auto& nodes = cap.body.mesh.nodes;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (nodes[n][0] == 0) cap.fixed[3 * n] = 1;
    if (nodes[n][1] == 0) cap.fixed[3 * n + 1] = 1;
    const double square = nodes[n][0] * nodes[n][0] + nodes[n][1] * nodes[n][1];
    nodes[n][2] +=
        square / (2 * radius) * (1 - nodes[n][2] / 0.02);  // the bottom rises with the distance from the axis
  }
  const TouchedBody above(cap);
  const TouchedBody below(block(0.05, 0.02, 4, 2, false, 1e5 * young));
  Touching both({{&above, {0, 0, 0.02}}, {&below, {0, 0, 0}}});
  const double modulus = young / (1 - poisson * poisson);
  double before = 0;
  for (const double pushed : {0.3e-3, 0.45e-3}) {
    both.place(0, {0, 0, 0.02 - pushed});
    for (int s = 0; s < 5; ++s) both.step();
    double force = 0, second = 0, most = 0;
    for (std::int32_t i = 0; i < both.contacts->get()->pair_count; ++i) {
      const palpate_world_pair& pair = both.pair(i);
      // The vertex of the block on the axis has a pair too.
      const bool of_cap = pair.organ[0] == 0;
      const Vector3d p = (of_cap ? above : below).node(pair.node);
      const double f = of_cap ? pair.force[2] : -pair.force[2];
      force += 4 * f, second += 4 * f * (p.x() * p.x() + p.y() * p.y());
      if (f > 0) most = std::max(most, std::hypot(p.x(), p.y()));
    }
    // Hertz' pressure has the mean square radius 2/5 a^2.
    const double found = std::sqrt(2.5 * second / force), expected = std::cbrt(0.75 * force * radius / modulus);
    EXPECT_NEAR(found / expected, 1, 0.05)
        << "pushed by " << pushed << " m: force " << force << " N, largest radius " << most;
    EXPECT_GT(expected, 3e-3);  // three edges and more
    EXPECT_GT(force, before);
    before = force;
  }
}

// The one in the middle is held at one side.
TEST(Touching, AStackOfThreeAtRestIsSteady) {
  Touching stack({{&upper_block(), {0, 0, 0.045}}, {&side_plate(), {0, 0, 0.03}}, {&lower_block(), {0, 0, 0}}});
  for (int s = 0; s < 10; ++s) stack.place(0, {0, 0, 0.045 - 1e-4 * s}), stack.step();
  for (int s = 0; s < 40; ++s) stack.step();
  Vector3d rest[3];
  for (int k = 0; k < 3; ++k) rest[k] = stack.pressed(k);
  EXPECT_GT(rest[0].z(), 0.05);
  EXPECT_LT(rest[2].z(), -0.05);
  for (int s = 0; s < 300; ++s) {
    EXPECT_EQ(stack.step(), 0u);
    for (int k = 0; k < 3; ++k) EXPECT_LT((stack.pressed(k) - rest[k]).norm(), 1e-6 * rest[0].norm()) << s;
  }
}

// Two domes, pressed on one another beside their tops, slide aside as far as the tissue lets them. Where a place follows its vertex at
// once, the next step takes both back again, for ever.
TEST(Touching, DomesThatSlideOffOneAnotherComeToRest) {
  for (const double friction : {0.0, 0.05}) {
    PressedDomes domes(friction);
    for (int s = 0; s < 200; ++s) domes.step();
    const Vector3d rest = domes.pressed(0);
    Vector3d last = rest;
    double way = 0;
    for (int s = 0; s < 40; ++s) {
      domes.step();
      way += (domes.pressed(0) - last).norm(), last = domes.pressed(0);
    }
    EXPECT_LT(way, 1e-6 * rest.norm()) << friction;
  }
}

// Where the vertices of pairs hardly move from their places, a step looks for no place anew. A step that does takes a quarter of what it takes
// where the places move on, because the bound on the motion is some ten times the motion.
TEST(Touching, PairsThatStandCostNoSearch) {
  const auto operations = [](PressedDomes& domes, double way) {
    std::int64_t sum = 0;
    for (int s = 0; s < 20; ++s) {
      domes.move({s % 2 ? way : -way, 0, 0});
      sum += domes.contacts->organ(0).operations + domes.contacts->organ(1).operations;
    }
    return sum;
  };
  PressedDomes domes(0);
  for (int s = 0; s < 100; ++s) domes.step();
  const std::int64_t standing = operations(domes, 1e-5), moving = operations(domes, 1e-3);
  EXPECT_LT(standing, moving / 10);
}

// One row of the upper block's vertices stands 0.5 mm inside of the edge of the lower one. A step of 2 mm brings these vertices nearer to the
// lower block's side than to its top. Their pairs go on pressing, so that the force is that of small steps.
TEST(Touching, PairsNearAnEdgeGoOnPressing) {
  constexpr double aside = 0.0145, begun = 2e-4, far = 2e-3;
  double force[2] = {};
  for (const int steps : {1, 40}) {
    Touching blocks({{&upper_block(), {aside, 0, 0.03}}, {&lower_block(), {0, 0, 0}}});
    blocks.place(0, {aside, 0, 0.03 - begun});
    for (int s = 0; s < 5; ++s) EXPECT_EQ(blocks.step(), 0u);
    for (int s = 1; s <= steps; ++s) {
      blocks.place(0, {aside, 0, 0.03 - begun - far * s / steps});
      EXPECT_EQ(blocks.step(), 0u);
    }
    force[steps > 1] = blocks.pressed(0).z();
  }
  // Without these pairs the force is 5 % smaller. What is left comes from places that follow.
  EXPECT_NEAR(force[0] / force[1], 1, 0.02);
}

// Pairs that are near one another and do not press cost no friction: 0.5 mm apart, each step moves all of them.
TEST(Touching, FrictionCostsNothingWherePairsDoNotPress) {
  std::int64_t operations[2] = {};
  for (const double friction : {0.0, 0.3}) {
    Touching blocks({{&upper_block(), {0, 0, 0.0305}}, {&lower_block(), {0, 0, 0}}}, friction);
    for (int s = 1; s <= 20; ++s) {
      blocks.place(0, {1e-4 * s, 0, 0.0305});
      EXPECT_EQ(blocks.step(), 0u);
      EXPECT_GT(blocks.contacts->get()->pair_count, 10);
      operations[friction > 0] += blocks.contacts->organ(0).operations + blocks.contacts->organ(1).operations;
    }
  }
  EXPECT_EQ(operations[0], operations[1]);
}

// The side of the upper block jumps into the lower block, 2 mm beside its parallel side: its vertices do not face that side, and no pair holds
// them. The step says so as long as a vertex is deep inside.
TEST(Touching, AVertexInsideThatNoPairHoldsIsFlagged) {
  Touching organs({{&upper_block(), {0.047, 0, 0.02}}, {&lower_block(), {0, 0, 0}}});
  EXPECT_EQ(organs.step(), 0u);
  organs.place(0, {0.013, 0, 0.02});
  DeformedTruth lower(lower_block().body), upper(upper_block().body);
  int flagged = 0, deep = 0;
  for (int s = 0; s < 20; ++s) {
    const palpate_step_flags flags = organs.step();
    lower.move(organs.shape(1, lower_block())), upper.move(organs.shape(0, upper_block()));
    double deepest = 0;
    for (std::int32_t n = 0; n < upper_block().body.surface_nodes; ++n)
      deepest = std::max(deepest, -lower.signed_distance(upper.place(n) + Vector3d(0.013, 0, 0.02)));
    flagged += (flags & PALPATE_STEP_NOT_TOUCHABLE) != 0, deep += deepest > 0.004;
    // A tenth of a mean edge of 8 mm, and the half of a millimetre by which a step moves them.
    if (flags == 0) {
      EXPECT_LT(deepest, 0.0013) << s;
    }
  }
  EXPECT_GE(flagged, 1);
  EXPECT_GE(deep, 1);
  organs.place(0, {0.013, 0, 0.06});
  for (int s = 0; s < 3; ++s) organs.step();
  EXPECT_EQ(organs.step(), 0u);
  // Where they are so from the beginning, nothing is wrong.
  Touching overlapping({{&upper_block(), {0.013, 0, 0.02}}, {&lower_block(), {0, 0, 0}}});
  for (int s = 0; s < 20; ++s) EXPECT_EQ(overlapping.step() & PALPATE_STEP_NOT_TOUCHABLE, 0u) << s;
}

// The short form of `make -f Makefile.data organ-pushes`; random_pushes.h says what counts as having passed through.
TEST(Touching, NothingPassesThroughUnderRandomPushes) {
  PushCounts all;
  for (std::uint64_t seed = 0; seed < 6; ++seed)
    play_pushes(seed, 500, 7, &all, [](const PassedThrough& found) { ADD_FAILURE() << sentence_of(found); });
  EXPECT_GT(all.pressed, 500);
  EXPECT_GT(all.looked, 10000);
  EXPECT_GT(all.told, 100);
  EXPECT_EQ(all.told_in_vain, 0);
  RecordProperty("deepest_edges", std::to_string(all.deepest));
}

// m: how deep the deepest vertex of an organ is inside another one. Each with a place in the world and a turn.
double deepest(const DeformedTruth& organ, std::int32_t count, const palpate_pose& at, const DeformedTruth& other,
               const palpate_pose& there) {
  double deepest = 0;
  for (std::int32_t n = 0; n < count; ++n) {
    Vector3d world, local;
    palpate_point_to_world(at.position, at.orientation, organ.place(n).data(), world.data());
    palpate_point_to_organ(there.position, there.orientation, world.data(), local.data());
    deepest = std::max(deepest, -other.signed_distance(local));
  }
  return deepest;
}

TEST(Touching, BallsOfSixtyMillimetresPressedByFifteenStayOutOfOneAnother) {
  constexpr double radius = 0.03, pressed = 0.015;
  constexpr int steps = 60;
  const TouchedBody ball(dense_ball(radius, 6));
  const std::int32_t nodes = ball.body.surface_nodes;
  double edge = 0;  // m, mean
  for (const auto& t : ball.body.triangles)
    for (int v = 0; v < 3; ++v)
      edge += (ball.node(t[v]) - ball.node(t[(v + 1) % 3])).norm() /
              (3.0 * static_cast<double>(ball.body.triangles.size()));
  EXPECT_NEAR(edge, 0.0075, 0.0015);
  for (const double friction : {0.0, 0.5}) {
    Touching both({{&ball, {0, 0, 0}}, {&ball, {0, 0, 2.1 * radius}}}, friction, 400);
    std::vector<DeformedTruth> truth(2, DeformedTruth(ball.body));
    int looked = 0;
    double worst = 0;
    palpate_pose pose[] = {pose_at({0, 0, 0}), pose_at({0, 0, 0})};
    for (int s = 0; s <= steps + 5; ++s) {
      // No vertex stands on a vertex.
      const Vector3d at(0.0021, 0.0013, 2 * radius + 0.0005 - (pressed + 0.0005) * std::min(s, steps) / steps);
      pose[1] = pose_at(at, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX())));
      ASSERT_EQ(palpate_scene_set_pose(palpate_world_scene(both.world.get(), 1), &pose[1], nullptr), PALPATE_OK);
      if (both.step() != 0 || s % 5 != 0) continue;
      ++looked;
      for (std::int32_t k = 0; k < 2; ++k) truth[static_cast<std::size_t>(k)].move(both.shape(k, ball));
      worst = std::max({worst, deepest(truth[0], nodes, pose[0], truth[1], pose[1]),
                        deepest(truth[1], nodes, pose[1], truth[0], pose[0])});
    }
    EXPECT_GT(looked, 10) << friction;
    EXPECT_GT(both.pressed(0).norm(), 0.5) << friction;
    // A tenth of an edge is promised. Where pairs of one ball alone hold, the other one's vertices are .034 of an edge deep.
    EXPECT_LT(worst, 0.01 * edge) << friction;
  }
}

// Unit, at the place of a pair on its second organ, in that organ's frame: between the normals of the triangle's corners, each the mean of its
// triangles' by their areas.
Vector3d normal_between_corners(const DeformedTruth& organ, const TouchedBody& body, const palpate_world_pair& pair) {
  Vector3d sum = Vector3d::Zero();
  for (int v = 0; v < 3; ++v) {
    const std::int32_t corner = body.body.triangles[static_cast<std::size_t>(pair.triangle)][v];
    Vector3d of_corner = Vector3d::Zero();
    for (std::size_t t = 0; t < body.body.triangles.size(); ++t) {
      const auto& own = body.body.triangles[t];
      if (std::find(own.begin(), own.end(), corner) == own.end()) continue;
      const Vector3d first = organ.corner(t, 0);
      of_corner += (organ.corner(t, 1) - first).cross(organ.corner(t, 2) - first);
    }
    sum += pair.barycentric[v] * of_corner.normalized();
  }
  return sum.normalized();
}

double degrees_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

// Two balls of 60 mm that come together by 50 mm/s: the normal of each pair that presses is that of the surface as the last step has left it.
TEST(Touching, NormalsOfPairsLagByLessThanADegreeBehindTheSurface) {
  constexpr double radius = 0.03, pressed = 0.015, way = 5e-5;
  const TouchedBody ball(dense_ball(radius, 6));
  const DeformedTruth rest(ball.body);
  for (const double friction : {0.0, 0.5}) {
    Touching both({{&ball, {0, 0, 0}}, {&ball, {0, 0, 2.1 * radius}}}, friction, 400);
    std::vector<DeformedTruth> truth(2, rest);
    palpate_pose pose[] = {pose_at({0, 0, 0}), pose_at({0, 0, 0})};
    double lag = 0, turned = 0;
    for (double at = 2 * radius; at > 2 * radius - pressed; at -= way) {
      // No vertex stands on a vertex.
      pose[1] =
          pose_at({0.0021, 0.0013, at}, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX())));
      ASSERT_EQ(palpate_scene_set_pose(palpate_world_scene(both.world.get(), 1), &pose[1], nullptr), PALPATE_OK);
      both.step();
      for (std::int32_t i = 0; i < both.contacts->get()->pair_count; ++i) {
        const palpate_world_pair& pair = both.pair(i);
        if (Vector3d(pair.force).norm() == 0) continue;
        const auto second = static_cast<std::size_t>(pair.organ[1]);
        Vector3d normal;
        palpate_vector_to_organ(pose[second].orientation, pair.normal, normal.data());
        const Vector3d expected = normal_between_corners(truth[second], ball, pair);
        lag = std::max(lag, degrees_between(normal, expected));
        turned = std::max(turned, degrees_between(normal_between_corners(rest, ball, pair), expected));
      }
      for (std::int32_t k = 0; k < 2; ++k) truth[static_cast<std::size_t>(k)].move(both.shape(k, ball));
    }
    EXPECT_LT(lag, 1) << friction;  // as docs/method.md, section 17, states
    EXPECT_GT(turned, 15) << friction;
  }
}

// A stiff die of 16 x 16 x 12 mm, pressed into a soft slab of 25 mm and dragged by 22 mm. Nothing depends on where the die is, so as long as the slab
// passes beneath, the force across is that of friction. Pressed deep, tissue in front of the die is carried along, and the force grows with the way.
TEST(Touching, ADraggedDieHasTheForceOfItsFrictionOrTellsThatItJams) {
  const TouchedBody die(block(0.008, 0.012, 4, 4, true, 5e5));
  const TouchedBody slab([] {
    GridBody grid;
    grid.lines = {grid_lines(-0.03, 0.03, 14), grid_lines(-0.02, 0.02, 10), grid_lines(0, 0.025, 5)};
    grid.held = [](auto p) { return p[2] == 0; };
    grid.poisson = 0.3;
    return dense_grid(grid);
  }());
  struct Case {
    double friction, depth, most;  // most: ratio of the forces where the step does not tell that they jam
    bool jams;
  };
  for (const auto& [friction, depth, most_ratio, jams] :
       {Case{0, 0.01, 0.1, false}, Case{0.3, 0.003, 0.35, false}, Case{0.5, 0.01, 0.6, true}}) {
    SCOPED_TRACE(testing::Message() << "friction " << friction << ", " << 1e3 * depth << " mm deep");
    Touching both({{&die, {-0.012, 0.0007, 0.0255}}, {&slab, {0, 0, 0}}}, friction, 400);
    const int down = static_cast<int>(std::lround((depth + 0.0005) / 1e-4));
    double ratio = 0, most = 0;
    int told = 0;
    for (int s = 0; s <= down + 220; ++s) {
      both.place(0, {-0.012 + 1e-4 * std::max(0, s - down), 0.0007, 0.0255 - 1e-4 * std::min(s, down)});
      const bool is_told = (both.step() & PALPATE_STEP_FRICTION_JAMS) != 0;
      const Vector3d force = both.pressed(0);
      ratio = force.head<2>().norm() / force.z();
      told += is_told;
      if (!is_told && s >= down + 50) most = std::max(most, ratio);
    }
    EXPECT_LT(most, most_ratio);
    EXPECT_GE(most, 0.9 * friction);
    EXPECT_EQ(told > 0, jams);
    EXPECT_GT(ratio, jams ? 0.8 : 0.0);
  }
}

TEST(Touching, AnOverlapAtRestCountsAsTouchingUntilTheOrgansPart) {
  Touching blocks({{&upper_block(), {0, 0, 0.03 - 0.0013}}, {&lower_block(), {0, 0, 0}}});
  EXPECT_EQ(blocks.step(), 0u);
  EXPECT_LT(blocks.pressed(0).norm(), 1e-6);
  ASSERT_GT(blocks.contacts->get()->pair_count, 0);
  double overlap = 0;
  for (std::int32_t i = 0; i < blocks.contacts->get()->pair_count; ++i)
    overlap = std::max(overlap, blocks.pair(i).overlap);
  EXPECT_NEAR(overlap, 0.0013, 1e-9);
  // A push beyond the overlap presses like the same push of blocks that do not overlap.
  blocks.place(0, {0, 0, 0.03 - 0.0018});
  Touching apart({{&upper_block(), {0, 0, 0.03}}, {&lower_block(), {0, 0, 0}}});
  apart.place(0, {0, 0, 0.0295});
  for (int s = 0; s < 5; ++s) blocks.step(), apart.step();
  EXPECT_NEAR(blocks.pressed(0).z() / apart.pressed(0).z(), 1, 0.02);
  // Apart and back: the surfaces are met where they are.
  for (const double z : {0.031, 0.03 - 0.0005}) {
    blocks.place(0, {0, 0, z});
    for (int s = 0; s < 5; ++s) blocks.step();
  }
  EXPECT_NEAR(blocks.pressed(0).z() / apart.pressed(0).z(), 1, 0.02);
}

TEST(Touching, FrictionHoldsUpToItsCoefficientAndThenSlips) {
  Touching blocks({{&upper_block(), {0, 0, 0.03}}, {&lower_block(), {0, 0, 0}}}, 0.3);
  blocks.place(0, {0, 0, 0.029});
  for (int s = 0; s < 5; ++s) blocks.step();
  for (int s = 1; s <= 60; ++s) {
    blocks.place(0, {1e-4 * s, 0, 0.029});
    blocks.step();
    const Vector3d f = blocks.pressed(0);
    const double share = std::hypot(f.x(), f.y()) / f.z();
    EXPECT_GT(share, s == 3 ? 0.02 : 0) << s;
    int sticking = 0;
    for (std::int32_t i = 0; i < blocks.contacts->get()->pair_count; ++i) {
      const Vector3d normal(blocks.pair(i).normal), force(blocks.pair(i).force);
      const double n = force.dot(normal), t = (force - n * normal).norm();
      ASSERT_GE(n, 0);
      ASSERT_LE(t, 0.3 * n * (1 + 1e-6)) << s;
      sticking += n > 0 && t < 0.3 * n * (1 - 1e-6);
    }
    // Once the block has moved by 3 mm all places slip, in every step.
    if (s >= 30) {
      EXPECT_EQ(sticking, 0) << s;
      EXPECT_LT(f.x(), -0.2 * f.z());
    }
  }
}

// A tool presses the upper block on the lower one; the force goes through.
TEST(Touching, AToolPressesOneOrganOnTheOther) {
  Touching both({{&side_plate(), {0, 0, 0.03}}, {&lower_block(), {0, 0, 0}}});
  double point[3] = {0.01, 0, 0.0455};
  for (int s = 0; s < 40; ++s) {
    point[2] = 0.0455 - 5e-5 * s;
    const palpate_tool tool = point_tool(point, 1, 0.004);
    EXPECT_EQ(both.step({tool}), 0u) << s;
  }
  const Vector3d on_tool(both.contacts->tool(0).force_raw);
  EXPECT_GT(on_tool.z(), 0.02);
  EXPECT_LT(both.pressed(1).z(), -0.3 * on_tool.z());  // the rest goes to the plate's support
  EXPECT_GT(both.pressed(1).z(), -1.0 * on_tool.z());
  EXPECT_EQ(both.contacts->tool(0).organ_count, 1);
  bool of_pair = false;
  for (std::int32_t n = 0; n < both.contacts->organ(1).node_count; ++n)
    of_pair = of_pair || palpate_contacts_node(&both.contacts->organ(1), n)->source == PALPATE_SOURCE_ORGAN;
  EXPECT_TRUE(of_pair);
}

TEST(Touching, OrgansApartGiveTheBitsOfTheirScenes) {
  const SceneDef def = touching_def();
  const ScenePointer scene = upper_block().scene(def);
  const palpate_pose pose = pose_at({0, 0, 0.1});
  palpate_scene_set_pose(scene.get(), &pose, nullptr);
  Touching blocks({{&upper_block(), {0, 0, 0.1}}, {&lower_block(), {0, 0, 0}}});
  Contacts alone(scene.get());
  long touched = 0;
  for (int s = 0; s < 100; ++s) {
    const double point[3] = {0.0155 - 1e-4 * (s % 50), 0.001, 0.11};
    const palpate_tool tool = point_tool(point, 1, 0.004);
    blocks.step({tool});
    palpate_scene_touch(scene.get(), &tool, 1, 1e-3, alone.get(), alone.bytes());
    const palpate_contacts& in_world = blocks.contacts->organ(0);
    ASSERT_EQ(in_world.node_count, alone->node_count) << s;
    for (std::int32_t n = 0; n < alone->node_count; ++n)
      ASSERT_EQ(std::memcmp(palpate_contacts_node(&in_world, n), palpate_contacts_node(alone, n),
                            sizeof(palpate_contact_node)),
                0)
          << s;
    touched += alone->node_count;
  }
  EXPECT_GT(touched, 100);
}

TEST(Touching, ARestoredStateGoesOnWithTheSameBits) {
  const std::vector<Stack> stack = {{&upper_block(), {0, 0, 0.0295}}, {&lower_block(), {0, 0, 0}}};
  Touching played(stack, 0.2), other(stack, 0.2);
  std::vector<std::uint64_t> state;
  for (int s = 0; s < 60; ++s) {
    const Vector3d at(1e-4 * s, 5e-5 * s, 0.0295 - 3e-5 * (s % 40));
    played.place(0, at);
    const auto flags = played.step();
    if (s == 30) {
      state.resize(palpate_world_state_bytes(played.world.get()) / 8);
      ASSERT_EQ(palpate_world_save(played.world.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
      ASSERT_EQ(palpate_world_restore(other.world.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
    }
    if (s <= 30) continue;
    other.place(0, at);
    EXPECT_EQ(other.step(), flags);
    ASSERT_EQ(played.contacts->get()->used_bytes, other.contacts->get()->used_bytes) << s;
    ASSERT_EQ(std::memcmp(played.contacts->get(), other.contacts->get(), played.contacts->get()->used_bytes), 0) << s;
  }
}

TEST(Touching, FewPairsAreTheNearestAndTheStepSaysSo) {
  Touching blocks({{&upper_block(), {0, 0, 0.03}}, {&lower_block(), {0, 0, 0}}}, 0, 6);
  blocks.place(0, {0, 0, 0.0295});
  palpate_step_flags flags = 0;
  for (int s = 0; s < 5; ++s) flags = blocks.step();
  EXPECT_TRUE(flags & PALPATE_STEP_CONTACTS_DROPPED);
  EXPECT_EQ(blocks.contacts->get()->pair_count, 6);
  EXPECT_GT(blocks.pressed(0).z(), 0);
}

TEST(Touching, OrgansThatCannotTouchAreRefusedByASentence) {
  SceneDef def = touching_def();
  def.collision = PALPATE_COLLISION_REST;
  const palpate_world_organ organs[2] = {organ_of(upper_block().bundle(), &def, nullptr),
                                         organ_of(lower_block().bundle(), &def, nullptr)};
  palpate_world_def world = palpate_default_world_def();
  world.organs = organs, world.organ_count = 2, world.max_pairs = 10;
  palpate_world* made = nullptr;
  palpate_error error = {};
  EXPECT_EQ(palpate_world_create(&world, &made, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::AllOf(testing::StartsWith("organ 0: "), testing::HasSubstr("collision DEFORMED")));
  world.max_pairs = -1;
  EXPECT_EQ(palpate_world_create(&world, &made, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::HasSubstr("max_pairs must"));
}

// Each vertex of one block lies on one of the other, so that their pairs say the same.
TEST(Touching, MeshesWhoseVerticesLieOnOneAnotherMeetTheirLaws) {
  Touching blocks({{&upper_block(), {0, 0, 0.03}}, {&lower_block(), {0, 0, -1e-4}}});
  for (int s = 0; s <= 50; ++s) {
    const double share = s / 50.0;
    blocks.place(1, {0, 0, share * 1e-3 - 1e-4 * (1 - share)});
    EXPECT_EQ(blocks.step(), 0u) << s;
  }
}

}  // namespace
}  // namespace palpate::tests
