// Links between organs of a world against the dense bodies: the ends stand where both bodies take them under the forces that the links
// report, and these forces are those that the links' laws ask for at these places.
#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cstring>
#include <numbers>
#include <random>

#include "studies/coupled/coupled_rows.h"
#include "tests/runtime/moved_box.h"
#include "tests/runtime/world/touching_world.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

const Vector3d kMiddle(.3, .3, .4);

struct Organ {
  const TouchedBody* body;
  const MatrixXd* compliance;
  palpate_pose pose;

  Matrix3d turn() const {
    return Quaterniond(pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3])
        .toRotationMatrix();
  }
  Vector3d to_world(const Vector3d& p) const { return Vector3d(pose.position) + turn() * p; }
};

Organ box_at(const palpate_pose& pose) {
  static const TouchedBox body;
  static const MatrixXd compliance = compliance_of(body);
  return {&body, &compliance, pose};
}
Organ plate_at(const palpate_pose& pose) {
  static const MatrixXd compliance = compliance_of(side_plate());
  return {&side_plate(), &compliance, pose};
}
Quaterniond turned(double angle, const Vector3d& axis) {
  return Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}
// Two organs whose far faces look at one another at an angle, 15 mm or so apart.
std::vector<Organ> two_organs() {
  return {box_at(pose_at({0.3, -0.2, 0.1}, turned(0.4, {1, 2, 3}))),
          plate_at(pose_at(Vector3d(0.3, -0.2, 0.1) + turned(0.4, {1, 2, 3}) * Vector3d(0.14, 0.02, 0.03),
                           turned(0.4, {1, 2, 3}) * turned(std::numbers::pi, {0, 0.2, 1})))};
}

SceneDef linked_def() {
  SceneDef def = unlimited_def();
  def.contact = PALPATE_CONTACT_POINT, def.collision = PALPATE_COLLISION_OFF;
  return def;
}

palpate_link_end on_surface(std::int32_t triangle, Vector3d k = kMiddle) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_SURFACE_POINT, end.triangle = triangle;
  Eigen::Map<Vector3d>(end.barycentric) = k;
  return end;
}
palpate_link_end in_world(const Vector3d& point) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_WORLD;
  Eigen::Map<Vector3d>(end.point) = point;
  return end;
}
palpate_world_link link_of(palpate_link_kind kind, std::int32_t a, palpate_link_end end_a, std::int32_t b,
                           palpate_link_end end_b, double rest_length = 0, double stiffness = INFINITY) {
  palpate_world_link link = palpate_default_world_link();
  link.kind = kind, link.organ[0] = a, link.organ[1] = b;
  link.ends[0] = end_a, link.ends[1] = end_b, link.rest_length = rest_length, link.stiffness = stiffness;
  return link;
}

class Linked {
 public:
  explicit Linked(std::vector<Organ> given = two_organs(), const SceneDef& scene_def = linked_def(),
                  std::int32_t max_links = 16, std::int32_t max_pairs = 0)
      : organs(std::move(given)) {
    std::vector<palpate_world_organ> list;
    for (const Organ& organ : organs) list.push_back(organ_of(organ.body->bundle(), &scene_def, &organ.pose));
    palpate_world_def def = palpate_default_world_def();
    def.organs = list.data(), def.organ_count = static_cast<std::int32_t>(list.size());
    def.max_links = max_links, def.max_pairs = max_pairs;
    palpate_world* made = nullptr;
    palpate_error error = {};
    if (palpate_world_create(&def, &made, &error) != PALPATE_OK) throw std::runtime_error(error.text);
    world.reset(made);
    contacts = std::make_unique<WorldContacts>(made);
  }
  // The places that a link names, as all are of the far faces.
  std::int32_t far(std::int32_t organ, int which) const {
    return organs[static_cast<std::size_t>(organ)].body->far_triangle(which);
  }
  palpate_world_link between(palpate_link_kind kind, int a, int b, double rest_length = 0, double k = INFINITY) const {
    return link_of(kind, 0, on_surface(far(0, a)), 1, on_surface(far(1, b)), rest_length, k);
  }
  void set(const std::vector<palpate_world_link>& wanted) {
    links = wanted;
    palpate_error error = {};
    ASSERT_EQ(palpate_world_set_links(world.get(), links.data(), static_cast<std::int32_t>(links.size()), &error),
              PALPATE_OK)
        << error.text;
  }
  void place(std::int32_t organ, const palpate_pose& pose) {
    organs[static_cast<std::size_t>(organ)].pose = pose;
    ASSERT_EQ(palpate_scene_set_pose(scene(organ), &pose, nullptr), PALPATE_OK);
  }
  palpate_scene* scene(std::int32_t organ) { return palpate_world_scene(world.get(), organ); }
  palpate_step_flags step(const std::vector<palpate_tool>& tools = {}) {
    return palpate_world_touch(world.get(), tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3,
                               contacts->get(), contacts->bytes());
  }
  palpate_step_flags steps(int count, const std::vector<palpate_tool>& tools = {}) {
    palpate_step_flags flags = 0;
    for (int s = 0; s < count; ++s) flags = step(tools);
    return flags;
  }
  const palpate_link_state& state(std::size_t i = 0) {
    return *palpate_world_link_state(world.get(), static_cast<std::int32_t>(i));
  }

  // N, in the frame of the organ, of all its contact nodes; of one link's alone where one is given.
  VectorXd force_on(std::int32_t k, std::int32_t link = -1) {
    const palpate_contacts& of = contacts->organ(k);
    VectorXd force = VectorXd::Zero(organs[static_cast<std::size_t>(k)].body->dofs());
    for (std::int32_t n = 0; n < of.node_count; ++n) {
      const palpate_contact_node& node = *palpate_contacts_node(&of, n);
      if (link < 0 || (node.source == PALPATE_SOURCE_WORLD_LINK && node.index == link))
        force.segment<3>(3 * node.node) += Vector3d(node.force);
    }
    return force;
  }
  Vector3d end_of(std::size_t link, int e, const std::vector<VectorXd>& u) {
    const palpate_link_end& end = links[link].ends[e];
    if (end.kind == PALPATE_END_WORLD) return Vector3d(end.point);
    const auto k = static_cast<std::size_t>(links[link].organ[e]);
    const TouchedBody& body = *organs[k].body;
    Vector3d sum = Vector3d::Zero();
    for (int v = 0; v < 3; ++v) {
      const auto n = body.body.triangles[static_cast<std::size_t>(end.triangle)][static_cast<std::size_t>(v)];
      sum += end.barycentric[v] * (body.node(n) + u[k].segment<3>(3 * n));
    }
    return organs[k].to_world(sum);
  }
  // Of bodies whose supports stand.
  void expect_equilibrium() {
    std::vector<VectorXd> u;
    for (std::size_t k = 0; k < organs.size(); ++k)
      u.push_back(*organs[k].compliance * force_on(static_cast<std::int32_t>(k)));
    expect_equilibrium(u);
  }
  void expect_equilibrium(const std::vector<VectorXd>& u) {
    for (std::size_t l = 0; l < links.size(); ++l) {
      const palpate_link_state& found = state(l);
      const Vector3d a = end_of(l, 0, u), b = end_of(l, 1, u), x = b - a, force(found.force);
      // Columns are stored in single precision: 6e-8 of displacements of a centimetre.
      EXPECT_LT((a - Vector3d(found.ends[0])).norm(), 2e-8) << l;
      EXPECT_LT((b - Vector3d(found.ends[1])).norm(), 2e-8) << l;
      EXPECT_NEAR(found.length, x.norm(), 4e-8) << l;
      if (links[l].kind == PALPATE_LINK_CLIP) {
        EXPECT_LT((x - force / links[l].stiffness).norm(), 1e-7) << l;
        continue;
      }
      // A line that turned by less than 0.1 milliradian keeps its row; short lines turn by more than that in the steps that settle.
      EXPECT_LT((force - found.tension * x.normalized()).norm(), 2e-3 * std::fabs(found.tension) + 1e-12) << l;
      if (found.condition == PALPATE_LINK_TAUT) {
        EXPECT_NEAR(x.norm(), found.rest_length + found.tension / links[l].stiffness, 1e-7) << l;
      } else {
        EXPECT_EQ(found.tension, 0) << l;
      }
    }
  }

  std::vector<Organ> organs;
  std::vector<palpate_world_link> links;
  WorldPointer world;
  std::unique_ptr<WorldContacts> contacts;
};

double apart_at_rest(Linked& linked) {
  std::vector<VectorXd> u;
  for (const Organ& organ : linked.organs) u.push_back(VectorXd::Zero(organ.body->dofs()));
  return (linked.end_of(0, 1, u) - linked.end_of(0, 0, u)).norm();
}

// m/N, in the world: what a force on an end of a link moves that end by.
Matrix3d softness_of(const Linked& linked, std::size_t link, int e) {
  const palpate_link_end& end = linked.links[link].ends[e];
  const Organ& organ = linked.organs[static_cast<std::size_t>(linked.links[link].organ[e])];
  MatrixXd h = MatrixXd::Zero(3, organ.body->dofs());
  for (int v = 0; v < 3; ++v)
    h.block<3, 3>(0,
                  3 * organ.body->body.triangles[static_cast<std::size_t>(end.triangle)][static_cast<std::size_t>(v)]) =
        end.barycentric[v] * Matrix3d::Identity();
  const Matrix3d own = h * *organ.compliance * h.transpose();
  return organ.turn() * own * organ.turn().transpose();
}

TEST(WorldLinks, AClipHasTheForceOfADenseSolveOfBothOrgans) {
  for (const double k : {double(INFINITY), 300.0}) {
    Linked linked;
    linked.set({linked.between(PALPATE_LINK_CLIP, 2, 5, 0, k)});
    ASSERT_EQ(linked.step(), 0u);
    std::vector<VectorXd> u;
    for (const Organ& organ : linked.organs) u.push_back(VectorXd::Zero(organ.body->dofs()));
    const Vector3d x0 = linked.end_of(0, 1, u) - linked.end_of(0, 0, u);
    std::vector<studies::CoupledBody> bodies;
    for (const Organ& organ : linked.organs)
      bodies.push_back(
          {[c = organ.compliance](const MatrixXd& loads) { return MatrixXd(*c * loads); }, organ.body->dofs()});
    std::vector<studies::Row> rows(3);
    for (int d = 0; d < 3; ++d) {
      studies::Row& row = rows[static_cast<std::size_t>(d)];
      row.target = x0[d], row.softness = 1 / k;
      for (int e = 0; e < 2; ++e)
        for (int v = 0; v < 3; ++v)
          row.add(static_cast<std::size_t>(e),
                  linked.organs[e].body->body.triangles[linked.links[0].ends[e].triangle][v],
                  (e ? -1 : 1) * linked.links[0].ends[e].barycentric[v] * linked.organs[e].turn().transpose() *
                      Vector3d::Unit(d));
    }
    const Vector3d expected = studies::solve_coupled(rows, bodies).force, found(linked.state().force);
    // Single precision of the stored columns, 6e-8, times the condition of three nodes' compliance, some tens.
    EXPECT_LT((found - expected).norm(), 3e-6 * expected.norm());
    EXPECT_NEAR(linked.state().tension, expected.norm(), 3e-6 * expected.norm());
    linked.expect_equilibrium();
  }
}

TEST(WorldLinks, TheShapeOfEachOrganHasWhatTheyDo) {
  Linked linked;
  linked.set({linked.between(PALPATE_LINK_CLIP, 2, 5)});
  ASSERT_EQ(linked.step(), 0u);
  for (std::int32_t k = 0; k < 2; ++k) {
    const Organ& organ = linked.organs[static_cast<std::size_t>(k)];
    const VectorXd expected = *organ.compliance * linked.force_on(k);
    palpate_step_flags flags = 0;
    const std::vector<float> u =
        displacements(linked.scene(k), &linked.contacts->organ(k), organ.body->body.surface_nodes, &flags);
    EXPECT_EQ(flags, 0u);
    // The shape is in single precision.
    for (std::size_t i = 0; i < u.size(); ++i)
      EXPECT_NEAR(u[i], expected[static_cast<Eigen::Index>(i)], 1e-6 * expected.cwiseAbs().maxCoeff()) << i;
  }
}

TEST(WorldLinks, ThreadsPullAsADirectSolveOfTheTurningLine) {
  for (const double share : {0.9, 0.5, 0.1})
    for (const double k : {double(INFINITY), 30.0}) {
      Linked linked;
      linked.set({linked.between(PALPATE_LINK_THREAD, 0, 6, 0, k)});
      const double length = share * apart_at_rest(linked);
      linked.set({linked.between(PALPATE_LINK_THREAD, 0, 6, length, k)});
      EXPECT_EQ(linked.steps(60), 0u);
      std::vector<VectorXd> u;
      for (const Organ& organ : linked.organs) u.push_back(VectorXd::Zero(organ.body->dofs()));
      const Vector3d x0 = linked.end_of(0, 1, u) - linked.end_of(0, 0, u);
      const Matrix3d m = softness_of(linked, 0, 0) + softness_of(linked, 0, 1);
      const auto along = [&](double t) {
        return Vector3d(((length + t / k) * Matrix3d::Identity() + t * m).inverse() * x0);
      };
      double low = 0, high = 1000;
      for (int i = 0; i < 200; ++i) (along(0.5 * (low + high)).norm() > 1 ? low : high) = 0.5 * (low + high);
      // As in Links.ThreadsPullAsADirectSolveOfTheTurningLine: the line keeps its row within 0.1 milliradian.
      EXPECT_NEAR(linked.state().tension, high, 1e-3 * high) << share << ' ' << k;
      EXPECT_LT((Vector3d(linked.state().force) - high * along(high)).norm(), 2e-3 * high);
      linked.expect_equilibrium();
    }
}

TEST(WorldLinks, ActAndReactUnderAnyPoses) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  for (int round = 0; round < 10; ++round) {
    Linked linked({box_at(pose_at(any(), turned(3 * normal(random), any()))),
                   plate_at(pose_at(any(), turned(3 * normal(random), any())))});
    linked.set({linked.between(PALPATE_LINK_THREAD, 0, 6, 0.01, 0.5),
                linked.between(PALPATE_LINK_SPRING, 3, 2, 0.02, 0.3), linked.between(PALPATE_LINK_CLIP, 7, 9, 0, 0.4)});
    linked.steps(20);
    for (std::int32_t l = 0; l < 3; ++l) {
      Vector3d sum[2];
      for (std::int32_t k = 0; k < 2; ++k) {
        const VectorXd force = linked.force_on(k, l);
        sum[k] = Vector3d::Zero();
        for (Eigen::Index n = 0; n < force.size(); n += 3) sum[k] += force.segment<3>(n);
        sum[k] = linked.organs[static_cast<std::size_t>(k)].turn() * sum[k];
      }
      const Vector3d force(linked.state(static_cast<std::size_t>(l)).force);
      ASSERT_GT(force.norm(), 0.01);
      // Rounding of two turns and of sums over three nodes.
      EXPECT_LT((sum[0] + sum[1]).norm(), 1e-13 * force.norm()) << l;
      EXPECT_LT((sum[0] - force).norm(), 1e-13 * force.norm()) << l;
    }
  }
}

TEST(WorldLinks, HoldOrgansThatMoveAtEachPose) {
  Linked linked;
  linked.set({linked.between(PALPATE_LINK_SPRING, 0, 6, 0.02, 40), linked.between(PALPATE_LINK_CLIP, 7, 2, 0, 100)});
  for (int s = 0; s < 5; ++s) {
    palpate_pose pose = two_organs()[1].pose;
    pose.position[1] += 0.004 * std::sin(s);
    const Quaterniond turn = turned(0.1 * s, {0.3, 1, 0}) * Quaterniond(linked.organs[1].turn());
    linked.place(1, pose_at(Vector3d(pose.position), turn));
    ASSERT_EQ(linked.steps(40), 0u);
    linked.expect_equilibrium();
  }
}

TEST(WorldLinks, OnOneOrganOrToTheWorldPullLikeThoseOfAScene) {
  const Organ organ = box_at(pose_at({0.1, 0.2, -0.1}, turned(0.7, {1, -1, 2})));
  const Vector3d anchor =
      organ.to_world(organ.body->place(organ.body->far_triangle(9), kMiddle) + Vector3d(0.03, 0.01, 0));
  SceneDef def = linked_def();
  def.links.max_links = 4;
  Linked by_world({organ}, def), by_scene({organ}, def);
  by_world.set(
      {link_of(PALPATE_LINK_THREAD, 0, on_surface(by_world.far(0, 0)), 0, on_surface(by_world.far(0, 14)), 0.02),
       link_of(PALPATE_LINK_SPRING, 0, on_surface(by_world.far(0, 9)), -1, in_world(anchor), 0.02, 80)});
  std::vector<palpate_link> links;
  for (const palpate_world_link& of : by_world.links) {
    palpate_link& link = links.emplace_back(palpate_default_link());
    link.kind = of.kind, link.ends[0] = of.ends[0], link.ends[1] = of.ends[1];
    link.rest_length = of.rest_length, link.stiffness = of.stiffness;
  }
  ASSERT_EQ(palpate_scene_set_links(by_scene.scene(0), links.data(), 2, nullptr), PALPATE_OK);
  by_world.steps(60), by_scene.steps(60);
  by_world.expect_equilibrium();
  for (std::int32_t l = 0; l < 2; ++l) {
    const double expected = palpate_scene_link_state(by_scene.scene(0), l)->tension;
    ASSERT_GT(std::fabs(expected), 0.1);
    // Each has turned its line to within 0.1 milliradian, on its own way.
    EXPECT_NEAR(by_world.state(static_cast<std::size_t>(l)).tension, expected, 1e-4 * std::fabs(expected));
  }
}

TEST(WorldLinks, WithoutThemAWorldOfOneOrganHasTheBitsOfItsScene) {
  SceneDef def = linked_def();
  def.links.max_links = 2;
  const Organ organ = box_at(pose_at({0.1, 0, 0}, turned(0.3, {1, 0, 1})));
  Linked with_room({organ}, def, 8), without({organ}, def, 0);
  ScenePointer scene = organ.body->scene(def);
  ASSERT_EQ(palpate_scene_set_pose(scene.get(), &organ.pose, nullptr), PALPATE_OK);
  Contacts alone(scene.get());
  palpate_link link = palpate_default_link();
  link.kind = PALPATE_LINK_THREAD, link.rest_length = 0.02;
  link.ends[0] = on_surface(with_room.far(0, 0)), link.ends[1] = on_surface(with_room.far(0, 14));
  for (palpate_scene* each : {with_room.scene(0), without.scene(0), scene.get()})
    ASSERT_EQ(palpate_scene_set_links(each, &link, 1, nullptr), PALPATE_OK);
  for (int s = 0; s < 40; ++s) {
    with_room.step(), without.step();
    palpate_scene_touch(scene.get(), nullptr, 0, 1e-3, alone.get(), alone.bytes());
    ASSERT_EQ(std::memcmp(&without.contacts->organ(0), alone.get(), alone->used_bytes), 0) << s;
    // The head of contacts states the capacity, which differs.
    const palpate_contacts& roomy = with_room.contacts->organ(0);
    ASSERT_EQ(roomy.node_count, alone->node_count);
    ASSERT_EQ(std::memcmp(palpate_contacts_node(&roomy, 0), alone.nodes(),
                          static_cast<std::size_t>(alone->node_count) * sizeof(palpate_contact_node)),
              0)
        << s;
  }
}

TEST(WorldLinks, SlackThreadsLeaveOrgansApart) {
  Linked slack, none;
  slack.set({slack.between(PALPATE_LINK_THREAD, 0, 6, 1)});
  const std::int32_t triangle = slack.far(0, 5);
  for (int s = 0; s < 30; ++s) {
    const std::vector<palpate_grip> grips = {grip_at_place(triangle, kMiddle, {-1e-4 * s, 0, 5e-5 * s})};
    palpate_tool tool = tool_of(grips);
    tool.organ = 0;
    ASSERT_EQ(slack.step({tool}), none.step({tool}));
    const palpate_contacts &one = slack.contacts->organ(0), &other = none.contacts->organ(0);
    ASSERT_EQ(std::memcmp(&one, &other, one.used_bytes), 0) << s;
    EXPECT_EQ(slack.state().condition, PALPATE_LINK_SLACK);
    EXPECT_EQ(slack.state().tension, 0);
  }
  std::vector<VectorXd> u;
  for (std::int32_t k = 0; k < 2; ++k)
    u.push_back(*slack.organs[static_cast<std::size_t>(k)].compliance * slack.force_on(k));
  EXPECT_NEAR(slack.state().length, (slack.end_of(0, 1, u) - slack.end_of(0, 0, u)).norm(), 4e-8)
      << "a slack link tells its length";
}

TEST(WorldLinks, WithoutRoomForThemAWorldTakesNothing) {
  Linked none(two_organs(), linked_def(), 0), some(two_organs(), linked_def(), 1);
  const auto passes = [](Linked& of) {
    std::string names;
    std::int32_t organ = 0;
    for (std::int32_t p = 0; const palpate_plan_pass* pass = palpate_world_plan(of.world.get(), p, &organ); ++p)
      if (organ == -1) names += std::string(pass->name) + "; ";
    return names;
  };
  EXPECT_EQ(passes(none), "world: input; world: output; ");
  EXPECT_EQ(passes(some), "world: input; world: joint solve; world: links; world: output; ");
  EXPECT_LT(palpate_world_state_bytes(none.world.get()), palpate_world_state_bytes(some.world.get()));
  palpate_error error = {};
  const palpate_world_link link = none.between(PALPATE_LINK_CLIP, 0, 0);
  EXPECT_EQ(palpate_world_set_links(none.world.get(), &link, 1, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, HasSubstr("max_links (0)"));
  EXPECT_EQ(palpate_world_link_state(none.world.get(), 0), nullptr);
}

TEST(WorldLinks, BreakBeyondTheirForce) {
  Linked linked;
  palpate_world_link link = linked.between(PALPATE_LINK_THREAD, 0, 6, 0.001);
  linked.set({link});
  linked.steps(40);
  link.breaking_force = 0.9 * linked.state().tension;
  linked.set({link});
  EXPECT_EQ(linked.step(), std::uint32_t{PALPATE_STEP_LINK_BROKE});
  EXPECT_EQ(linked.state().condition, PALPATE_LINK_BROKEN);
  EXPECT_EQ(linked.state().broken, 41u);
  EXPECT_GT(linked.state().tension, 0) << "it acts in this step for the last time";
  EXPECT_EQ(linked.step(), 0u);
  EXPECT_EQ(linked.state().tension, 0);
  EXPECT_EQ(linked.force_on(0).norm() + linked.force_on(1).norm(), 0);
  link.breaking_force = INFINITY;
  linked.set({link});
  linked.step();
  EXPECT_EQ(linked.state().condition, PALPATE_LINK_BROKEN) << "under its id it stays broken";
  palpate_world_reset(linked.world.get());
  linked.step();
  EXPECT_EQ(linked.state().condition, PALPATE_LINK_TAUT);
}

TEST(WorldLinks, StiffnessAndLengthChangeAtRunTime) {
  Linked changed, fresh;
  palpate_world_link link = changed.between(PALPATE_LINK_THREAD, 0, 6, 0.004, 5);
  changed.set({link});
  changed.steps(60);
  const double soft = changed.state().tension;
  link.stiffness = 200, link.rest_length = 0.002;
  changed.set({link}), fresh.set({link});
  changed.steps(60), fresh.steps(60);
  EXPECT_GT(changed.state().tension, 1.2 * soft);
  EXPECT_NEAR(changed.state().tension, fresh.state().tension, 1e-4 * fresh.state().tension);
}

// A suture to and fro between two organs: one thread, whose parts have one tension in each step.
TEST(WorldLinks, AThreadRunsOnFromOrganToOrgan) {
  Linked linked;
  std::vector<palpate_world_link> suture = {
      linked.between(PALPATE_LINK_THREAD, 0, 0, 0.016),
      link_of(PALPATE_LINK_THREAD, 1, on_surface(linked.far(1, 0)), 0, on_surface(linked.far(0, 9)), 0.008),
      linked.between(PALPATE_LINK_THREAD, 9, 8, 0.012)};
  suture[2].ends[0] = suture[1].ends[1];
  suture[0].runs_on = suture[1].runs_on = 1;
  linked.set(suture);
  double given = 0;
  for (std::size_t l = 0; l < 3; ++l) given += suture[l].rest_length = (l == 1 ? 0.8 : 0.95) * linked.state(l).length;
  linked.set(suture);
  double settled = 0;
  for (int s = 0; s < 40; ++s) {
    linked.step();
    double sum = 0;
    for (std::size_t l = 0; l < 3; ++l) {
      sum += linked.state(l).rest_length;
      ASSERT_GT(linked.state(l).tension, 0.01);
      ASSERT_EQ(linked.state(l).tension, linked.state(0).tension) << l;
    }
    EXPECT_NEAR(sum, given, 1e-12);
    if (s == 20) settled = linked.state(0).tension;
  }
  EXPECT_NEAR(linked.state(0).tension, settled, 0.01 * settled) << "lines still turn by some degrees";
}

TEST(WorldLinks, HoldOrgansThatTouch) {
  // The upper block is drawn on the lower one by a spring at each side.
  const std::vector<Organ> organs = {{&upper_block(), nullptr, pose_at({0, 0, 0.0302})},
                                     {&lower_block(), nullptr, pose_at({0, 0, 0})}};
  Linked linked(organs, touching_def(), 4, 200);
  const auto nearest = [&](std::size_t k, const Vector3d& p) {
    std::int32_t best = 0;
    const TouchedBody& body = *organs[k].body;
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(body.body.triangles.size()); ++t)
      if ((organs[k].to_world(body.place(t, kMiddle)) - p).norm() <
          (organs[k].to_world(body.place(best, kMiddle)) - p).norm())
        best = t;
    return on_surface(best);
  };
  std::vector<palpate_world_link> springs;
  for (const double side : {-1.0, 1.0})
    springs.push_back(link_of(PALPATE_LINK_SPRING, 0, nearest(0, {0.015 * side, 0, 0.042}), 1,
                              nearest(1, {0.025 * side, 0, 0.03}), 0.004, 30));
  linked.set(springs);
  linked.steps(150);
  const Vector3d pressed(linked.contacts->state(0).pressed);
  EXPECT_GT(pressed[2], 0.01) << "the springs press it on the lower block";
  for (std::int32_t i = 0; i < linked.contacts->get()->pair_count; ++i) {
    const palpate_world_pair& pair = *palpate_world_contacts_pair(linked.contacts->get(), i);
    EXPECT_GT(pair.gap, -1e-8);
    EXPECT_GE(pair.pressure, 0);
  }
  for (std::size_t l = 0; l < 2; ++l) {
    const palpate_link_state& state = linked.state(l);
    EXPECT_NEAR(state.length, 0.004 + state.tension / 30, 1e-7) << "the spring's law holds beside the pairs";
    EXPECT_LT(state.force[2], 0);
  }
  EXPECT_NEAR(Vector3d(linked.contacts->state(1).pressed)[2], -pressed[2], 1e-13 * pressed[2]);
}

// An organ that breathes and another one that hangs on it by a ligament and a clip.
TEST(WorldLinks, AnOrganThatHangsOnABreathingOneFollowsIt) {
  static const MovedBox breathing(true);
  SceneDef moved = moved_def(), still = linked_def();
  moved.collision = PALPATE_COLLISION_OFF;
  const palpate_pose at[2] = {two_organs()[0].pose, two_organs()[1].pose};
  static const MatrixXd compliance = compliance_of(breathing);
  Linked linked;  // its world is replaced by one whose organs have other definitions
  const palpate_world_organ list[2] = {organ_of(breathing.bundle(), &moved, at),
                                       organ_of(side_plate().bundle(), &still, at + 1)};
  palpate_world_def def = palpate_default_world_def();
  def.organs = list, def.organ_count = 2, def.max_links = 2;
  palpate_world* made = nullptr;
  ASSERT_EQ(palpate_world_create(&def, &made, nullptr), PALPATE_OK);
  linked.world.reset(made), linked.contacts = std::make_unique<WorldContacts>(made);
  linked.organs[0].body = &breathing, linked.organs[0].compliance = &compliance;
  linked.set({linked.between(PALPATE_LINK_THREAD, 0, 6, 0.01, 60), linked.between(PALPATE_LINK_CLIP, 7, 2, 0, 40)});
  double least = INFINITY, most = 0;
  for (int phase = 0; phase < 8; ++phase) {
    const double t = 2 * std::numbers::pi * phase / 8;
    const Eigen::Vector4d q(0.005 * std::sin(t), 0.05 * std::cos(t), 80 * std::sin(2 * t), 9.81 * std::cos(t));
    set_amounts(linked.scene(0), q);
    ASSERT_EQ(linked.steps(60), 0u) << phase;
    linked.expect_equilibrium({breathing.motions.field * q + compliance * linked.force_on(0),
                               *linked.organs[1].compliance * linked.force_on(1)});
    least = std::min(least, linked.state(1).tension), most = std::max(most, linked.state(1).tension);
  }
  EXPECT_GT(most, 1.1 * least) << "the breath must be felt";
  // A volume that is held is followed in the joint solve.
  const palpate_motion_state& filling = *palpate_scene_motion_state(linked.scene(0), kFilling);
  const double volume = filling.volume + 1e-6;
  ASSERT_EQ(palpate_scene_hold_volume(linked.scene(0), kFilling, 1, volume, nullptr), PALPATE_OK);
  ASSERT_EQ(linked.steps(60), 0u);
  EXPECT_NEAR(filling.volume, volume, 1e-6 * std::fabs(volume));
  const double last = 2 * std::numbers::pi * 7 / 8;
  const Eigen::Vector4d q(0.005 * std::sin(last), 0.05 * std::cos(last), filling.amount, 9.81 * std::cos(last));
  linked.expect_equilibrium({breathing.motions.field * q + compliance * linked.force_on(0),
                             *linked.organs[1].compliance * linked.force_on(1)});
}

TEST(WorldLinks, GoOnFromASavedStateWithTheSameBits) {
  Linked saved, restored;
  for (Linked* each : {&saved, &restored}) {
    std::vector<palpate_world_link> links = {each->between(PALPATE_LINK_THREAD, 0, 6, 0.003),
                                             each->between(PALPATE_LINK_THREAD, 9, 8, 0.03, 40),
                                             each->between(PALPATE_LINK_CLIP, 3, 2, 0, 50)};
    links[2].breaking_force = 0.2;
    links[0].runs_on = 1;
    each->set(links);
  }
  const auto move = [](Linked& of, int s) {
    palpate_pose pose = two_organs()[1].pose;
    pose.position[2] += 0.004 * std::sin(0.07 * s);
    of.place(1, pose);
    return of.step();
  };
  for (int s = 0; s < 50; ++s) move(saved, s);
  std::vector<std::uint64_t> state(palpate_world_state_bytes(saved.world.get()) / 8 + 1);
  ASSERT_EQ(palpate_world_save(saved.world.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
  ASSERT_EQ(palpate_world_restore(restored.world.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
  for (int s = 50; s < 120; ++s) {
    ASSERT_EQ(move(saved, s), move(restored, s));
    ASSERT_EQ(std::memcmp(saved.contacts->get(), restored.contacts->get(), saved.contacts->get()->used_bytes), 0) << s;
    for (std::size_t l = 0; l < 3; ++l)
      ASSERT_EQ(std::memcmp(&saved.state(l), &restored.state(l), sizeof(palpate_link_state)), 0) << s << ' ' << l;
  }
  Linked other(two_organs(), linked_def(), 3);
  EXPECT_NE(palpate_world_restore(other.world.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK)
      << "a world with other limits refuses the state";
}

TEST(WorldLinks, ThatCannotBeAreRefusedWithOneSentence) {
  Linked linked;
  const palpate_world_link good = linked.between(PALPATE_LINK_THREAD, 0, 6, 0.01);
  linked.set({good});
  linked.steps(20);
  const double tension = linked.state().tension;
  const auto refusal = [&](auto change) {
    palpate_world_link link = good;
    change(link);
    palpate_error error = {};
    EXPECT_EQ(palpate_world_set_links(linked.world.get(), &link, 1, &error), PALPATE_ERROR_ARGUMENT);
    return std::string(error.text);
  };
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.organ[1] = 2; }), HasSubstr("organ_count"));
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.organ[0] = -1; }), HasSubstr("the world keeps its links"));
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.kind = PALPATE_LINK_UNSAID; }),
              HasSubstr("THREAD, SPRING or CLIP"));
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.ends[1].triangle = 100000; }),
              HasSubstr("triangle from 0 to F-1"));
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.stiffness = NAN; }), HasSubstr("stiffness above 0"));
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.radius = 0.004; }), HasSubstr("contact is not PATCH"));
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.runs_on = 1; }), HasSubstr("a link behind"));
  EXPECT_THAT(refusal([](palpate_world_link& link) { link.struct_bytes = 8; }), HasSubstr("world_link"));
  linked.step();
  EXPECT_EQ(linked.state().tension, tension) << "the world keeps its links";
  SceneDef large = linked_def();
  large.large.deformation = PALPATE_DEFORMATION_LARGE;
  EXPECT_THROW(Linked(two_organs(), large), std::runtime_error);
}

// Discs of tissue on both organs, which the mesh does not resolve: both sides' local compliance is in the row.
TEST(WorldLinks, TakeHoldOfDiscsOfBothOrgans) {
  SceneDef def = linked_def();
  def.contact = PALPATE_CONTACT_PATCH;
  Linked wide(two_organs(), def), narrow(two_organs(), def);
  palpate_world_link link = wide.between(PALPATE_LINK_SPRING, 9, 8, 0, 500);
  link.radius = 0.008;
  wide.set({link});
  link.radius = 0.002;
  narrow.set({link});
  ASSERT_EQ(wide.steps(60), 0u);
  ASSERT_EQ(narrow.steps(60), 0u);
  EXPECT_GT(wide.state().tension, 1.1 * narrow.state().tension) << "more tissue is stiffer";
  EXPECT_GT(narrow.state().tension, 0);
}

}  // namespace
}  // namespace palpate::tests
