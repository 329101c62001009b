// Links between organs of a world beyond what any deformation meets: sutures that cannot close, clips against one another, against a grasp
// and against a breath, poses far from the origin, a chain of ten organs, and grips of hard contradiction on organs that touch.
#include <numbers>

#include "tests/runtime/moved_box.h"
#include "tests/runtime/world/touching_world.h"
#include "tests/stability/conflict.h"
#include "tests/stability/held_places.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

const char* const kOnce =
    "the stiffest node's stiffness times the longest way asked for, for the three nodes of a place";
const char* const kBound =
    "1,024 times the stiffest node's stiffness times the longest line, for the three nodes of a place";

SceneDef linked_def() {
  return unlimited_def(PALPATE_COLLISION_OFF, PALPATE_CONTACT_POINT);
}

struct Placed {
  const TouchedBody* body;
  palpate_pose pose;
};

// Organs, the links between them, and what all steps told.
class LinkedOrgans {
 public:
  explicit LinkedOrgans(std::vector<Placed> organs, const SceneDef& scene = linked_def(), int max_pairs = 0)
      : organs_(std::move(organs)) {
    std::vector<palpate_world_organ> list;
    for (const Placed& organ : organs_) list.push_back(organ_of(organ.body->bundle(), &scene, &organ.pose));
    palpate_world_def def = palpate_default_world_def();
    def.organs = list.data(), def.organ_count = static_cast<std::int32_t>(list.size());
    def.max_links = 32, def.max_pairs = max_pairs;
    palpate_world* made = nullptr;
    palpate_error error = {};
    if (palpate_world_create(&def, &made, &error) != PALPATE_OK) throw std::runtime_error(error.text);
    world_.reset(made), contacts_ = std::make_unique<WorldContacts>(made);
  }
  palpate_scene* scene(std::int32_t organ) { return palpate_world_scene(world_.get(), organ); }
  void place(std::int32_t organ, const palpate_pose& pose) { palpate_scene_set_pose(scene(organ), &pose, nullptr); }

  // From the middle of a triangle that looks along `outward` in organ a to one in organ b, each the nearest to a point of its frame.
  palpate_world_link link(palpate_link_kind kind, std::int32_t a, const Vector3d& outward_a, const Vector3d& at_a,
                          std::int32_t b, const Vector3d& outward_b, const Vector3d& at_b) const {
    palpate_world_link link = palpate_default_world_link();
    link.kind = kind, link.organ[0] = a, link.organ[1] = b;
    const FacePlace place[] = {face_place(*organs_[a].body, outward_a, at_a),
                               face_place(*organs_[b].body, outward_b, at_b)};
    for (int e = 0; e < 2; ++e) {
      link.ends[e].kind = PALPATE_END_SURFACE_POINT, link.ends[e].triangle = place[e].triangle;
      std::copy(place[e].barycentric, place[e].barycentric + 3, link.ends[e].barycentric);
    }
    return link;
  }
  void set(const std::vector<palpate_world_link>& links) {
    count_ = static_cast<std::int32_t>(links.size());
    palpate_error error = {};
    ASSERT_EQ(palpate_world_set_links(world_.get(), links.data(), count_, &error), PALPATE_OK) << error.text;
  }
  palpate_step_flags step(const std::vector<palpate_tool>& tools = {}) {
    const palpate_step_flags flags =
        palpate_world_touch(world_.get(), tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3, contacts_->get(),
                            contacts_->bytes());
    raised |= flags, in_every_step &= flags;
    for (std::int32_t l = 0; l < count_; ++l) {
      const palpate_link_state& state = *palpate_world_link_state(world_.get(), l);
      keep(Vector3d(state.force).norm(), &largest);
      keep(state.length, &longest);
    }
    for (std::int32_t t = 0; t < contacts_->get()->tool_count; ++t)
      keep(Vector3d(contacts_->tool(t).force_raw).norm(), &largest_tool),
          keep(Vector3d(contacts_->tool(t).force).norm(), &largest_sent);
    return flags;
  }
  Vector3d force(std::int32_t link) const { return Vector3d(palpate_world_link_state(world_.get(), link)->force); }
  double largest_shape() {
    double most = 0;
    for (std::size_t k = 0; k < organs_.size(); ++k) {
      const auto organ = static_cast<std::int32_t>(k);
      for (const float u : displacements(scene(organ), &contacts_->organ(organ), organs_[k].body->body.surface_nodes))
        keep(std::fabs(u), &most);
    }
    return most;
  }
  // N: what contradictions may ask for where no line is longer than `way` m.
  double bound(double way) const { return 1024 * once(way); }
  // N: the same where nothing contradicts.
  double once(double way) const {
    double most = 0;
    for (const Placed& organ : organs_) most = std::max(most, stiffest(*organ.body));
    return 3 * most * way;
  }
  // Links and tools gone: nothing is left of them.
  void hold_nothing_is_left(StabilityCase& attack, const std::string& with = "") {
    set({});
    palpate_step_flags flags = 0;
    for (int s = 0; s < 3; ++s) flags = step();
    attack.hold("flags without links" + with, flags, 0, "nothing acts");
    attack.hold("displacement without links, m" + with, largest_shape(), 0, "nothing acts");
  }

  palpate_step_flags raised = 0, in_every_step = ~palpate_step_flags{0};
  double largest = 0, longest = 0;            // N, m: of links
  double largest_tool = 0, largest_sent = 0;  // N: on tools, and within the device's limits

 private:
  std::vector<Placed> organs_;
  WorldPointer world_;
  std::unique_ptr<WorldContacts> contacts_;
  std::int32_t count_ = 0;
};

// The free faces of a lower and an upper block look at one another, `apart` m from face to face.
std::vector<Placed> two_blocks(double apart, const Vector3d& origin = Vector3d::Zero(),
                               const Quaterniond& turn = Quaterniond::Identity()) {
  return {{&lower_block(), pose_at(origin, turn)},
          {&upper_block(), pose_at(origin + turn * Vector3d(0, 0, 0.03 + apart), turn)}};
}
palpate_world_link between(const LinkedOrgans& blocks, palpate_link_kind kind, double x, double other_x) {
  return blocks.link(kind, 0, Vector3d::UnitZ(), {x, 0.002, 0.03}, 1, -Vector3d::UnitZ(), {other_x, 0.002, 0});
}

// A clip of a place of the lower block to a point of the world.
palpate_world_link pinned(const LinkedOrgans& blocks, double x, const Vector3d& to) {
  palpate_world_link link = between(blocks, PALPATE_LINK_CLIP, x, 0);
  link.ends[1] = {}, link.ends[1].kind = PALPATE_END_WORLD, link.organ[1] = -1;
  Eigen::Map<Vector3d>(link.ends[1].point) = to;
  return link;
}

TEST(StabilityLinkedOrgans, SuturesAndClipsThatContradict) {
  StabilityCase attack(
      "Clips take one place of an organ to two places of another one and to two points of the world, and threads of no "
      "length pull beside them over 0.1 m: no deformation meets them, and the joint matrix is singular");
  LinkedOrgans blocks(two_blocks(0.1));
  blocks.set({between(blocks, PALPATE_LINK_CLIP, 0, -0.008), between(blocks, PALPATE_LINK_CLIP, 0, 0.008),
              pinned(blocks, 0, {0, 0.03, 0.05}), pinned(blocks, 0, {0, -0.03, 0.05}),
              between(blocks, PALPATE_LINK_CLIP, 0.01, 0.008), between(blocks, PALPATE_LINK_THREAD, 0, 0),
              between(blocks, PALPATE_LINK_THREAD, -0.01, -0.008)});
  for (int s = 0; s < quick_or_long(200, 5000); ++s) blocks.step();
  attack.hold("largest force, N", blocks.largest, blocks.bound(0.15), kBound);
  attack.hold("longest line, m", blocks.longest, 0.3, "twice the longest line at rest");
  attack.hold("other flags", blocks.raised & ~kOfConflict, 0, "nothing else is wrong with the input");
  attack.hold("steps that do not say so", blocks.in_every_step & kOfConflict ? 0 : 1, 0, "the clips are never met");
  blocks.hold_nothing_is_left(attack);
}

TEST(StabilityLinkedOrgans, ClipsAgainstAGraspThatTearsAway) {
  StabilityCase attack(
      "A grasp takes the tissue at the end of two clips away by 50 mm and turns it: jaws and clips hold the same "
      "nodes");
  SceneDef def = linked_def();
  def.contact = PALPATE_CONTACT_PATCH, def.grasps.grasps = 1;
  LinkedOrgans blocks(two_blocks(0.005), def);
  blocks.set({between(blocks, PALPATE_LINK_CLIP, 0, 0), between(blocks, PALPATE_LINK_CLIP, 0.008, 0.008)});
  for (int s = 0; s < 20; ++s) blocks.step();
  palpate_grasp grasp = face_grasp(upper_block(), -Vector3d::UnitZ(), {0, 0.002, 0}, 0.005);
  grasp.position[2] += 0.035;
  palpate_tool tool = palpate_default_tool();
  tool.parts = &grasp.part, tool.organ = 1;
  const Vector3d from(grasp.position);
  for (int s = 0; s < quick_or_long(300, 5000); ++s) {
    const double part = std::min(1.0, s / 200.0);
    Eigen::Map<Vector3d>(grasp.position) = from + part * Vector3d(0.04, 0, 0.03);
    const Quaterniond turn(Eigen::AngleAxisd(part, Vector3d::UnitX()));
    grasp.orientation[0] = turn.w(), grasp.orientation[1] = turn.x();
    blocks.step({tool});
  }
  attack.hold("largest force of a clip, N", blocks.largest, blocks.once(0.06), kOnce);
  attack.hold("largest force of the grasp, N", blocks.largest_tool, blocks.once(0.06), kOnce);
  attack.hold("least force of the grasp, N", 0.01 / blocks.largest_tool, 1, "it pulls both organs");
  attack.hold("largest displacement, m", blocks.largest_shape(), 0.2, "some times the way of the jaws");
  attack.hold("other flags", blocks.raised & ~kOfConflict, 0, "nothing else is wrong with the input");
  for (int s = 0; s < 3; ++s) blocks.step();
  blocks.hold_nothing_is_left(attack);
}

// The box breathes; a grasp holds its free end still, and clips and a spring tie that end to a block that stands.
TEST(StabilityLinkedOrgans, GraspsAndClipsAgainstABreath) {
  StabilityCase attack(
      "Supports move an organ by 10 mm in a breath and by 80 mm at once, while jaws hold its end still and clips tie "
      "it "
      "to an organ that stands: targets less what motions do grow, and the three contradict one another");
  const MovedBox box(false);
  SceneDef def = moved_def();
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_PATCH, def.grasps.grasps = 1;
  // Both organs stand on the bundle with motions: an organ without them takes none.
  for (const double friction : {double{INFINITY}, 0.3}) {
    const std::string with = std::isfinite(friction) ? ", jaws that slip" : ", jaws that hold";
    LinkedOrgans organs(
        {{&box, pose_at({0, 0, 0})},
         {&box, pose_at({0.14, 0.05, 0}, Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitZ())))}},
        def);
    const auto tie = [&](palpate_link_kind kind, double y) {
      return organs.link(kind, 0, Vector3d::UnitX(), {0.06, y, 0.02}, 1, Vector3d::UnitX(), {0.06, 0.05 - y, 0.02});
    };
    palpate_world_link spring = tie(PALPATE_LINK_SPRING, 0.04);
    spring.rest_length = 0.01, spring.stiffness = 100;
    organs.set({tie(PALPATE_LINK_CLIP, 0.02), tie(PALPATE_LINK_CLIP, 0.03), spring});
    palpate_grasp grasp = face_grasp(box, Vector3d::UnitZ(), {0.05, 0.02, 0.04}, 0.008);
    oppose(box, grasp, -Vector3d::UnitZ(), {0.05, 0.02, 0});
    grasp.closing = 0.003, grasp.friction = friction;
    palpate_tool tool = palpate_default_tool();
    tool.parts = &grasp.part, tool.organ = 0;
    const auto breathe = [&](double q, bool held) {
      set_amounts(organs.scene(0), {q, 0, 0, 0});
      organs.step(held ? std::vector<palpate_tool>{tool} : std::vector<palpate_tool>{});
    };
    for (int s = 0; s < 200; ++s) breathe(0.005 * std::sin(0.1 * s), s >= 20);
    for (int s = 0; s < 200; ++s) breathe(s % 50 < 25 ? 0.04 : -0.04, true);
    attack.hold("largest force of a link, N" + with, organs.largest, organs.once(0.1), kOnce);
    attack.hold("largest force of the grasp, N" + with, organs.largest_tool, organs.once(0.1), kOnce);
    attack.hold("largest displacement, m" + with, organs.largest_shape(), 0.3, "some times the motion of the supports");
    attack.hold("other flags" + with, organs.raised & ~(kOfConflict | PALPATE_STEP_MOTION_LIMITED), 0,
                "nothing else is wrong with the input");
    for (int s = 0; s < 5; ++s) breathe(0, false);
    organs.hold_nothing_is_left(attack, with);
  }
}

TEST(StabilityLinkedOrgans, PosesTenKilometresAway) {
  StabilityCase attack(
      "Poses of 1e4 m leave 2e-12 m of a place: the line of a link is the difference of two such numbers");
  Vector3d force[2][3];
  palpate_step_flags flags = 0;
  const Quaterniond turn(Eigen::AngleAxisd(2.2, Vector3d(1, -2, 0.5).normalized()));
  for (const bool far : {false, true}) {
    LinkedOrgans blocks(far ? two_blocks(0.01, {1e4, -1e4, 1e4}, turn) : two_blocks(0.01));
    palpate_world_link spring = between(blocks, PALPATE_LINK_SPRING, -0.01, -0.008),
                       thread = between(blocks, PALPATE_LINK_THREAD, 0.01, 0.004);
    spring.stiffness = 100, spring.rest_length = 0.005, thread.rest_length = 0.004;
    blocks.set({spring, thread, between(blocks, PALPATE_LINK_CLIP, 0, 0)});
    for (int s = 0; s < 100; ++s) blocks.step();
    for (std::int32_t l = 0; l < 3; ++l)
      force[far][l] = far ? Vector3d(turn.inverse() * blocks.force(l)) : blocks.force(l);
    flags |= blocks.raised;
  }
  for (int l = 0; l < 3; ++l)
    attack.hold("force of link " + std::to_string(l) + " against that near the origin",
                (force[1][l] - force[0][l]).norm() / force[0][l].norm(), 1e-7,
                "the rounding of places, 1e-11 m of a line of 1 mm, times ten");
  attack.hold("flags", flags, 0, "nothing is wrong with the input");
}

// Ten plates beside one another, each tied to the next one by two springs; the last one is drawn away by 30 mm and let back.
TEST(StabilityLinkedOrgans, TenOrgansInAChainOfSprings) {
  StabilityCase attack(
      "Ten organs in a chain are one system: springs of 1e-2 to 1e8 N/m, soft ones beside stiff ones, carry what the "
      "last organ does through all others, and the lines turn while it moves");
  constexpr int kOrgans = 10;
  std::vector<Placed> chain;
  for (int k = 0; k < kOrgans; ++k) chain.push_back({&side_plate(), pose_at({0.05 * k, 0, 0})});
  LinkedOrgans organs(chain);
  std::vector<palpate_world_link> springs;
  for (std::int32_t k = 0; k + 1 < kOrgans; ++k)
    for (const double y : {-0.01, 0.01}) {
      // From the free face of a plate to the upper face of the next one, beside its support.
      palpate_world_link spring = organs.link(PALPATE_LINK_SPRING, k, Vector3d::UnitX(), {0.02, y, 0.008}, k + 1,
                                              Vector3d::UnitZ(), {-0.005, y, 0.015});
      spring.rest_length = 0.015, spring.stiffness = std::pow(10.0, -2 + (10 * (7 * k % 9)) / 8);
      springs.push_back(spring);
    }
  organs.set(springs);
  for (int s = 0; s < 100; ++s) organs.step();
  Vector3d rest[2 * kOrgans];
  const auto count = static_cast<std::int32_t>(springs.size());
  for (std::int32_t l = 0; l < count; ++l) rest[l] = organs.force(l);
  double swing = 0, largest = 0;
  for (int s = 0; s < 20; ++s) {
    organs.step();
    for (std::int32_t l = 0; l < count; ++l)
      keep((organs.force(l) - rest[l]).norm(), &swing), keep(rest[l].norm(), &largest);
  }
  attack.hold("swing at rest, of the largest force", swing / largest, 1e-6,
              "what a stack of three that presses is held to");
  attack.hold("0.001 N over the largest force at rest", 1e-3 / largest, 1, "the springs pull");
  for (int s = 0; s < quick_or_long(200, 2000); ++s) {
    organs.place(kOrgans - 1, pose_at(Vector3d(0.05 * (kOrgans - 1) + 0.03 * std::sin(0.05 * s), 0, 0)));
    organs.step();
  }
  attack.hold("largest force, N", organs.largest, 3 * stiffest(side_plate()) * 0.08,
              "three nodes that give way by the longest line; springs alone contradict nothing");
  attack.hold("longest line, m", organs.longest, 0.16, "twice the longest line at rest, 0.05 m and 0.03 m of motion");
  attack.hold("flags", organs.raised, 0, "nothing is wrong with the input");
  organs.place(kOrgans - 1, pose_at(Vector3d(0.05 * (kOrgans - 1), 0, 0)));
  organs.hold_nothing_is_left(attack);
}

// Two blocks press, clips join them, and grips hold one triangle of each at its corners and at a middle that moves away.
TEST(StabilityLinkedOrgans, ContradictingGripsOnOrgansThatTouch) {
  StabilityCase attack(
      "Grips contradict one another in one triangle of each of two organs that press and that clips join: the limit of "
      "a force in the joint system is that of one organ, and pairs and clips share its rows");
  SceneDef def = touching_def();
  def.contact = PALPATE_CONTACT_POINT, def.max_tools = 2;
  LinkedOrgans blocks(two_blocks(0), def, 200);
  blocks.set({between(blocks, PALPATE_LINK_CLIP, 0, 0), between(blocks, PALPATE_LINK_CLIP, 0, 0.008)});
  std::vector<palpate_grip> grips[2];
  palpate_tool tools[2] = {palpate_default_tool(), palpate_default_tool()};
  for (std::int32_t t = 0; t < 2; ++t) {
    const FacePlace place = t == 0 ? face_place(lower_block(), Vector3d::UnitZ(), {0, 0.002, 0.03})
                                   : face_place(upper_block(), -Vector3d::UnitZ(), {0, 0.002, 0});
    // The corners are held where they rest, and the middle is drawn away.
    const Vector3d at[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ(), Vector3d::Constant(1.0 / 3)};
    for (int g = 0; g < 4; ++g)
      grips[t].push_back(grip_at_place(place.triangle, at[g], Vector3d(0, 0, g == 3 ? 0.01 : 0)));
    tools[t] = tool_of(grips[t]), tools[t].organ = t, tools[t].id = t;
  }
  for (int s = 0; s < quick_or_long(150, 5000); ++s) {
    blocks.place(1, pose_at({0, 0, 0.03 - 1e-3 * std::min(1.0, s / 50.0)}));
    blocks.step({tools[0], tools[1]});
  }
  attack.hold("largest force of a clip, N", blocks.largest, blocks.bound(0.02), kBound);
  attack.hold("largest force of a tool, N", blocks.largest_tool, 4 * blocks.bound(0.02),
              "four grips, each within that bound");
  attack.hold("largest force that a device gets, N", blocks.largest_sent, 50 * (1 + 1e-12),
              "the default force_limit, rounded");
  attack.hold("largest displacement, m", blocks.largest_shape(), 1, "the tissue stays where the tools are");
  attack.hold("steps that do not say so", blocks.in_every_step & kOfConflict ? 0 : 1, 0, "the grips are never met");
  attack.hold("other flags", blocks.raised & ~(kOfConflict | PALPATE_STEP_FORCE_LIMITED | PALPATE_STEP_NOT_TOUCHABLE),
              0, "nothing is wrong but the grips, which may press vertices past a side of the other organ");
  blocks.place(1, pose_at({0, 0, 0.04}));
  for (int s = 0; s < 3; ++s) blocks.step();
  blocks.hold_nothing_is_left(attack);
}

}  // namespace
}  // namespace palpate::tests
