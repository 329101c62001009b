#include "tests/effects/stage.h"

#include <numbers>

#include "tests/support/box_motions.h"
#include "tests/support/tool_parts.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Of organ 0 in the world, and of organ 1 in the frame of organ 0 before it comes nearer.
const Vector3d kWhere(0.31, -0.22, 0.14), kSecond(0.1215, 0.054, 0.003);
const Quaterniond kTurned(Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()));
const Quaterniond kOpposite(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitZ()));
const Vector3d kUp(0, 0, 1), kSide(0, 1, 0);
const Vector3d kFinger(0.04, 0.022, 0.04), kGrip(0.045, 0.05, 0.02), kGrasp(0.038, 0.03, 0), kEntry(0.033, 0, 0.022),
    kPusher(0.048, 0.014, -0.0005);

// Linear between the given (step, value).
double at(int s, std::initializer_list<std::pair<int, double>> points) {
  const std::pair<int, double>* before = points.begin();
  for (const auto& point : points) {
    if (s <= point.first && point.first > before->first)
      return before->second +
             (point.second - before->second) * std::max(0, s - before->first) / (point.first - before->first);
    before = &point;
  }
  return before->second;
}

template <class Place>
void put(const TouchedBody& body, const Vector3d& outward, const Vector3d& p, Place& place) {
  const PlaceOnFace on = place_at(body, outward, p);
  place.triangle = on.triangle;
  Eigen::Map<Vector3d>(place.barycentric) = on.weights;
}

palpate_link_end end_at(const TouchedBody& body, const Vector3d& p) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_SURFACE_POINT;
  put(body, kSide, p, end);
  return end;
}
palpate_link_end end_in_world(const Vector3d& p) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_WORLD;
  Eigen::Map<Vector3d>(end.point) = p;
  return end;
}

}  // namespace

Stage::Stage(const SceneOfEffects& of) : of_(of), body_(body_of(of).touched) {
  const palpate_fine_surface fine = effect_fine().view();
  SceneDef def = of.def;
  if (of.skin) def.render_mesh = effect_skin();
  if (of.fine) def.fine_surface = fine;
  palpate_obstacle plate = palpate_default_obstacle();
  plate.kind = PALPATE_OBSTACLE_RECTANGLE, plate.size[0] = plate.size[1] = 0.1, plate.friction = kPlateFriction;
  plate.position[0] = 10;  // set_plate() brings it
  if (of.obstacles) def.obstacles.list = &plate;
  // The patch of the force is a point of the tissue, which rests elsewhere under a preload.
  if (of.loads && of.def.preload == PALPATE_PRELOAD_ON) {
    const PlaceOnFace point = place_at(body_, kUp, Vector3d(kPointOfForce));
    for (int v = 0; v < 3; ++v)
      Eigen::Map<Vector3d>(def.loads.centre[0]) +=
          point.weights[v] * body_of(of).preload.segment<3>(3 * body_.body.triangles[point.triangle][v]);
  }
  poses_[0] = pose_at(kWhere, kTurned), poses_[1] = pose_of_second(0, 0);
  if (!of.is_world()) {
    palpate_scene* scene = nullptr;
    palpate_scene_create(body_.bundle(), &def, &scene, &refusal_);
    scene_.reset(scene);
    if (!scene) return;
    contacts_ = std::make_unique<Contacts>(scene);
    palpate_scene_set_pose(scene, &poses_[0], nullptr);
    if (of.holds_volume && palpate_scene_hold_volume(scene, kFilling, 0, 0, &refusal_) != PALPATE_OK) scene_.reset();
    return;
  }
  palpate_world_organ organs[2];
  for (int k = 0; k < 2; ++k) organs[k] = organ_of(body_.bundle(), &def, &poses_[k]);
  palpate_world_def world = palpate_default_world_def();
  world.organs = organs, world.organ_count = 2;
  world.force_limit = world.force_slew = world.torque_limit = world.torque_slew = INFINITY;
  if (of.touching) world.max_pairs = 60, world.friction = kPairFriction;
  if (of.world_links) world.max_links = 4;
  palpate_world* made = nullptr;
  palpate_world_create(&world, &made, &refusal_);
  world_.reset(made);
  if (made) world_contacts_ = std::make_unique<WorldContacts>(made);
}

Vector3d Stage::in_world(int organ, const Vector3d& p) const {
  Vector3d world;
  palpate_point_to_world(pose(organ).position, pose(organ).orientation, p.data(), world.data());
  return world;
}
Vector3d Stage::direction_in_world(int organ, const Vector3d& v) const {
  Vector3d world;
  palpate_vector_to_world(pose(organ).orientation, v.data(), world.data());
  return world;
}

Vector3d Stage::direction_in_organ(const double* v) const {
  Vector3d organ;
  palpate_vector_to_organ(pose(0).orientation, v, organ.data());
  return organ;
}

palpate_pose Stage::pose_of_second(double nearer, double aside) const {
  return pose_at(kWhere + kTurned * (kSecond + Vector3d(-nearer, aside, 0)), kTurned * kOpposite);
}

void Stage::restore(const Stage& from) {
  const std::size_t bytes =
      world_ ? palpate_world_state_bytes(from.world_.get()) : palpate_scene_state_bytes(from.scene_.get());
  std::vector<std::uint64_t> state(bytes / 8 + 1);
  palpate_error error = {};
  const palpate_status saved = world_ ? palpate_world_save(from.world_.get(), state.data(), 8 * state.size(), &error)
                                      : palpate_scene_save(from.scene_.get(), state.data(), 8 * state.size(), &error);
  const palpate_status restored = saved    ? saved
                                  : world_ ? palpate_world_restore(world_.get(), state.data(), bytes, &error)
                                           : palpate_scene_restore(scene_.get(), state.data(), bytes, &error);
  if (restored) throw std::runtime_error(error.text);
  std::copy_n(from.volume_before_, 2, volume_before_);
}

void Stage::move_tools(int s) {
  const double mm = 1e-3;
  finger_ =
      kFinger + mm * Vector3d(at(s, {{140, 0}, {158, -1.5}}), at(s, {{50, 0}, {90, 3}, {100, 1}}),
                              at(s, {{0, 2}, {20, 1.2}, {50, -2.5}, {90, -2.5}, {105, 2.5}, {115, 2.5}, {140, -2}}));
  grip_ = palpate_default_grip();
  grip_.kind = PALPATE_GRIP_SURFACE_POINT;
  put(body_, kSide, kGrip, grip_);
  const double drawn = at(s, {{25, 0}, {60, 1.2}, {100, -0.8}, {150, 1}});
  Eigen::Map<Vector3d>(grip_.displacement) = mm * drawn * Vector3d(0.4, 0.6, 0.3);
  tools_.clear();
  palpate_tool finger = palpate_default_tool(), grip = finger;
  finger.points = finger_.data(), finger.point_count = 1;
  finger.disc_radius = kFingerRadius, finger.friction = kFingerFriction;
  grip.grips = &grip_, grip.grip_count = 1;
  finger.id = kIdOfFinger, grip.id = kIdOfGrip;
  if (s >= kFingerIsAway[0] && s < kFingerIsAway[1])
    tools_ = {grip};
  else
    tools_ = {finger, grip};
  if (of_.grasps) {
    grasp_ = palpate_default_grasp();
    put(body_, -kUp, kGrasp, grasp_);
    grasp_.id = s < kJawsAreOpen[1] ? 1 : 2, grasp_.radius = 0.006, grasp_.friction = 0.9, grasp_.clamp_force = 20;
    const double pulled = at(s, {{10, 0}, {70, 1}, {110, 0.4}, {155, 1}});
    Eigen::Map<Vector3d>(grasp_.position) = kGrasp + mm * pulled * Vector3d(0.5, -0.4, -1.2);
    const Quaterniond turn(Eigen::AngleAxisd(0.1 * pulled, Vector3d(0.3, 0.2, 1).normalized()));
    grasp_.orientation[0] = turn.w(), grasp_.orientation[1] = turn.x(), grasp_.orientation[2] = turn.y(),
    grasp_.orientation[3] = turn.z();
    palpate_tool jaws = palpate_default_tool();
    jaws.id = kIdOfJaws, jaws.parts = s >= kJawsAreOpen[0] && s < kJawsAreOpen[1] ? nullptr : &grasp_.part;
    tool_of_grasp_ = static_cast<int>(tools_.size());
    tools_.push_back(jaws);
  }
  if (of_.needles) {
    needle_ = palpate_default_needle();
    put(body_, -kSide, kEntry, needle_);
    Eigen::Map<Vector3d>(needle_.tip) = kEntry + mm * at(s, {{15, -2}, {140, 26}, {150, 24}}) * kSide;
    Eigen::Map<Vector3d>(needle_.tip) += mm * at(s, {{100, 0}, {150, 0.6}}) * Vector3d(1, 0, 0);
    Eigen::Map<Vector3d>(needle_.direction) = kSide;
    needle_.id = 1, needle_.radius = 0.5 * mm, needle_.friction = 6, needle_.spacing = 6 * mm;
    needle_.cutting_force = 0.1, needle_.puncture_force = 0.15;
    palpate_tool pierces = palpate_default_tool();
    pierces.id = kIdOfNeedle, pierces.parts = &needle_.part;
    tool_of_needle_ = static_cast<int>(tools_.size());
    tools_.push_back(pierces);
  }
  if (of_.force_control) {
    pusher_ = kPusher;
    pushed_ = at(s, {{10, 0}, {60, 1}, {110, 0.3}, {150, 0.8}}) * Vector3d(-0.008, 0.002, 0.06);
    palpate_tool pushes = palpate_default_tool();
    pushes.id = kIdOfPusher, pushes.points = pusher_.data(), pushes.point_count = 1;
    pushes.disc_radius = kFingerRadius, pushes.friction = kFingerFriction, pushes.parts = &given_force_.part;
    tool_of_pusher_ = static_cast<int>(tools_.size());
    tools_.push_back(pushes);
  }
  for (palpate_tool& tool : tools_) {
    tool.has_torque = 1;
    Eigen::Map<Vector3d>(tool.reference) = Vector3d(0.1, -0.02, 0.03);
  }
}

// Into the world.
void Stage::send_tools() {
  sent_ = tools_;
  const auto turn = [&](double* v) { palpate_vector_to_world(pose(0).orientation, v, v); };
  const auto move = [&](double* p) { palpate_point_to_world(pose(0).position, pose(0).orientation, p, p); };
  for (palpate_tool& tool : sent_) {
    move(tool.reference);
    if (tool.points == finger_.data()) sent_finger_ = in_world(0, finger_), tool.points = sent_finger_.data();
    if (tool.points == pusher_.data()) {
      sent_pusher_ = in_world(0, pusher_), tool.points = sent_pusher_.data();
      Eigen::Map<Vector3d>(given_force_.force) = pushed_;
      turn(given_force_.force);
    }
    if (grasp_of(tool)) {
      sent_grasp_ = grasp_, tool.parts = &sent_grasp_.part;
      move(sent_grasp_.position);
      const double* const q = grasp_.orientation;
      const Quaterniond turned = kTurned * Quaterniond(q[0], q[1], q[2], q[3]);
      sent_grasp_.orientation[0] = turned.w(), sent_grasp_.orientation[1] = turned.x();
      sent_grasp_.orientation[2] = turned.y(), sent_grasp_.orientation[3] = turned.z();
    }
    if (needle_of(tool)) {
      sent_needle_ = needle_, tool.parts = &sent_needle_.part;
      move(sent_needle_.tip), turn(sent_needle_.direction);
    }
  }
}

void Stage::move_organs(int s) {
  // Each amount alone moves the box by about a millimetre.
  static const Eigen::Vector4d unit = [] {
    Eigen::Vector4d u;
    for (int m = 0; m < 4; ++m) u[m] = 0.8e-3 / body_of(Store::f32).motions.col(m).cwiseAbs().maxCoeff();
    return u;
  }();
  const double breath = at(s, {{12, 0}, {55, 1}, {95, -0.5}, {150, 0.7}});
  if (of_.motions) amounts_ = breath * Eigen::Vector4d(0.8, 0.5, 1, -0.6).cwiseProduct(unit);
  const auto nearer_at = [](int step) { return at(step, {{15, 0}, {70, 3}, {110, 2}, {150, 3.2}}); };
  for (int k = 0; k < organs() && of_.motions; ++k) {
    if (s == kHoldsVolumeFrom) volume_before_[k] = palpate_scene_motion_state(scene(k), kFilling)->volume;
    palpate_scene_set_motions(scene(k), amounts_.data(), 4, nullptr);
    if (!of_.holds_volume || s < kHoldsVolumeFrom) continue;
    // Organs that touch press one another's filled faces: these give way as the organs come nearer.
    const double pressed = of_.touching ? volume_before_[k] * nearer_at(s) / nearer_at(kHoldsVolumeFrom) : 0;
    held_volume_[k] = pressed + 1e-7 * at(s, {{kHoldsVolumeFrom, 1}, {150, 3}});
    palpate_scene_hold_volume(scene(k), kFilling, 1, held_volume_[k], nullptr);
  }
  if (!of_.is_world()) return;
  const double nearer = nearer_at(s), aside = at(s, {{70, 0}, {100, 1}, {150, 0.4}});
  poses_[1] = pose_of_second(1e-3 * nearer, 1e-3 * aside);
  palpate_scene_set_pose(scene(1), &poses_[1], nullptr);
}

void Stage::set_loads(int s) {
  if (!of_.loads) return;
  force_ = kTurned * Vector3d(0.02, -0.03, -0.06) * at(s, {{8, 0}, {60, 1}, {120, -0.4}, {150, 0.8}});
  traction_ = Vector3d(30, 10, -20) * at(s, {{30, 0}, {90, 1}, {152, 0.5}});
  for (int k = 0; k < organs(); ++k) {
    palpate_scene_set_load(scene(k), 0, PALPATE_LOAD_FORCE_IN_WORLD, force_.data(), nullptr);
    palpate_scene_set_load(scene(k), 1, PALPATE_LOAD_TRACTION, traction_.data(), nullptr);
  }
}

void Stage::set_plate(int s) {
  if (!of_.obstacles) return;
  plate_ = Vector3d(0.06, 0.025, 0.04) - 1e-3 * at(s, {{10, 1}, {60, -1.5}, {100, -0.5}, {150, -1.2}}) * kPlateNormal +
           1e-3 * at(s, {{60, 0}, {110, 1.2}, {150, 0.4}}) * kSide;
  for (int k = 0; k < organs(); ++k) {
    const Quaterniond organ(poses_[k].orientation[0], poses_[k].orientation[1], poses_[k].orientation[2],
                            poses_[k].orientation[3]);
    const palpate_pose pose =
        pose_at(in_world(k, plate_), organ * Quaterniond::FromTwoVectors(Vector3d::UnitZ(), kPlateNormal));
    palpate_scene_set_obstacle_pose(scene(k), 0, &pose, nullptr);
  }
}

Eigen::VectorXd Stage::loads(int organ) const {
  Eigen::VectorXd f = Eigen::VectorXd::Zero(body_.dofs());
  Vector3d force;
  palpate_vector_to_organ(pose(organ).orientation, force_.data(), force.data());
  const PlaceOnFace point = place_at(body_, kUp, Vector3d(kPointOfForce));
  for (int v = 0; v < 3; ++v) f.segment<3>(3 * body_.body.triangles[point.triangle][v]) += point.weights[v] * force;
  for (std::size_t t = 0; t < body_.body.triangles.size(); ++t) {
    const auto& corners = body_.body.triangles[t];
    if (body_.outward(static_cast<std::int32_t>(t))[0] < 0.99) continue;
    const Vector3d a = body_.node(corners[0]), b = body_.node(corners[1]), c = body_.node(corners[2]);
    for (const auto n : corners) f.segment<3>(3 * n) += (b - a).cross(c - a).norm() / 6 * traction_;
  }
  return f;
}

// Where an end of a link rests, without anything that holds it.
Vector3d Stage::rest_of(const palpate_link_end& end) const {
  if (end.kind == PALPATE_END_WORLD) return Vector3d(end.point);
  Vector3d place = body_.place(end.triangle, Vector3d(end.barycentric));
  const auto& nodes = body_.body.triangles[end.triangle];
  for (int v = 0; v < 3 && of_.def.preload == PALPATE_PRELOAD_ON; ++v)
    place += end.barycentric[v] * body_of(of_).preload.segment<3>(3 * nodes[v]);
  return place;
}

void Stage::set_links(int s) {
  const auto drawn = [&](double most) { return 1e-3 * at(s, {{20, 0}, {70, most}, {110, 0.5 * most}, {150, most}}); };
  if (of_.links) {
    const Vector3d a(0.03, 0.05, 0.03), b(0.03, 0.05, 0.012), c(0.055, 0.05, 0.009), d(0.056, 0.05, 0.033);
    links_.assign(3, palpate_default_link());
    links_[0].kind = PALPATE_LINK_SPRING, links_[0].stiffness = 60;
    links_[0].ends[0] = end_at(body_, a), links_[0].ends[1] = end_in_world(a + Vector3d(0.005, 0.02, 0));
    links_[1].kind = PALPATE_LINK_THREAD, links_[1].ends[0] = end_at(body_, b), links_[1].ends[1] = end_at(body_, c);
    links_[2].kind = PALPATE_LINK_CLIP, links_[2].ends[0] = end_at(body_, d);
    links_[2].ends[1] = end_in_world(rest_of(links_[2].ends[0]));
    for (int l = 0; l < 2; ++l)
      links_[l].rest_length =
          (rest_of(links_[l].ends[0]) - rest_of(links_[l].ends[1])).norm() + (l == 0 ? -drawn(5) : 0.5e-3 - drawn(2.5));
    std::vector<palpate_link> sent = links_;
    for (palpate_link& link : sent)
      for (palpate_link_end& end : link.ends)
        if (end.kind == PALPATE_END_WORLD) Eigen::Map<Vector3d>(end.point) = in_world(0, Vector3d(end.point));
    palpate_scene_set_links(scene(0), sent.data(), static_cast<std::int32_t>(sent.size()), nullptr);
  }
  if (of_.world_links) {
    const Vector3d a(0.05, 0.05, 0.01), b(0.045, 0.05, 0.034);
    world_links_.assign(2, palpate_default_world_link());
    for (palpate_world_link& link : world_links_) link.organ[0] = 0, link.organ[1] = 1;
    world_links_[0].kind = PALPATE_LINK_SPRING, world_links_[0].stiffness = 50;
    world_links_[0].ends[0] = world_links_[0].ends[1] = end_at(body_, a);
    world_links_[1].kind = PALPATE_LINK_THREAD;
    world_links_[1].ends[0] = world_links_[1].ends[1] = end_at(body_, b);
    for (int l = 0; l < 2; ++l) {
      const Vector3d place = rest_of(world_links_[l].ends[0]);
      if (apart_[l] == 0) {
        const palpate_pose second = pose_of_second(0, 0);
        Vector3d other;
        palpate_point_to_world(second.position, second.orientation, place.data(), other.data());
        apart_[l] = (in_world(0, place) - other).norm();
      }
      world_links_[l].rest_length = apart_[l] + (l == 0 ? -drawn(6) : 0.5e-3 - drawn(4));
    }
    palpate_world_set_links(world_.get(), world_links_.data(), 2, nullptr);
  }
}

// A slit between the support and all that others hold, from y = 0 on through the whole height.
void Stage::set_blade(int s) {
  for (int k = 0; of_.cut && k < organs(); ++k) {
    palpate_blade blade = palpate_default_blade();
    std::vector<double> edge;
    for (int i = 0; i < 5 && s >= kCutsFrom; ++i) {
      const Vector3d point =
          in_world(k, Vector3d(0.0205, 1e-3 * at(s, {{kCutsFrom, -2}, {kCutsFrom + 20, 18}}), 0.0125 * i - 0.005));
      edge.insert(edge.end(), point.begin(), point.end());
    }
    Eigen::Map<Vector3d>(blade.direction) = direction_in_world(k, kSide);
    blade.points = edge.data(), blade.point_count = static_cast<std::int32_t>(edge.size() / 3),
    blade.toughness = kToughness;
    palpate_scene_set_blade(scene(k), 0, &blade, nullptr);
  }
}

void Stage::step(int s) {
  move_tools(s);
  send_tools();
  move_organs(s);
  set_loads(s);
  set_plate(s);
  set_links(s);
  set_blade(s);
  const auto count = static_cast<std::int32_t>(tools_.size());
  flags = world_
              ? palpate_world_touch(world_.get(), sent_.data(), count, kStepTime, world_contacts_->get(),
                                    world_contacts_->bytes())
              : palpate_scene_touch(scene_.get(), sent_.data(), count, kStepTime, contacts_->get(), contacts_->bytes());
  // Where the pusher stands now.
  if (tool_of_pusher_ >= 0)
    Eigen::Map<Vector3d>(tools_[tool_of_pusher_].reference) +=
        direction_in_organ(palpate_scene_given_force_state(scene(0), kIdOfPusher)->displacement);
  if (of_.def.large.deformation < PALPATE_DEFORMATION_LARGE_BESIDE) return;
  for (int k = 0; k < organs(); ++k)
    for (int i = 0; i < 20 && palpate_scene_deform(scene(k)) > 0;) ++i;
}

}  // namespace palpate::tests
