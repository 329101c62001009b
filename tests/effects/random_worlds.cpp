#include "tests/effects/random_worlds.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/support/box_motions.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

const Vector3d kUp(0, 0, 1), kSide(0, 1, 0);
// Of the second and third organ in the frame of the first one: opposite of its free face, and above it.
const Vector3d kOrgans[] = {{0, 0, 0}, {0.1215, 0.054, 0.003}, {0.002, 0.055, 0.083}};
const Quaterniond kTurns[] = {Quaterniond::Identity(),
                              Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitZ())),
                              Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()))};
const Vector3d kGrasp(0.038, 0.03, 0), kEntry(0.033, 0, 0.022);

// What no force of a tool and no displacement exceeds. The box has 60 mm and, at 5.4 kPa, about 270 N/m; targets go up to 60 mm beyond its
// surface, and jaws and clips that contradict one another raise a force by up to 1,024 times (docs/method.md, section 5).
constexpr double kMostForce = 2e4, kMostWay = 1;  // N, m
// What a world may have left of its displacements after it was let go, m: where the steps of a hyperelastic body end, as in LargeOrgan's tests.
constexpr double kLeft = 1e-4;
constexpr int kRestSteps = 400;

constexpr palpate_contact_law kLaws[] = {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL,
                                         PALPATE_LAW_COULOMB};
constexpr const char* kWordsOfLaw[] = {"sticking", "sliding", "unilateral", "coulomb"};
constexpr const char* kWordsOfBody[] = {"linear", "large", "large-beside", "large-renewed"};

template <class Place>
void put(const TouchedBody& body, const Vector3d& outward, const Vector3d& p, Place& place) {
  const PlaceOnFace on = place_at(body, outward, p);
  place.triangle = on.triangle;
  Eigen::Map<Vector3d>(place.barycentric) = on.weights;
}

bool is_finite(const double* numbers, int count) {
  return std::all_of(numbers, numbers + count, [](double x) { return std::isfinite(x); });
}

}  // namespace

RandomWorld::RandomWorld(std::uint64_t seed, WorldCounts* counts, Tell tell)
    : random_(seed), seed_(seed), counts_(*counts), tell_(std::move(tell)) {
  make_organs();
  make_links();
  finger_way_ = any_way(0.012), grip_way_ = any_way(0.01), jaws_way_ = any_way(0.012), needle_way_ = any_way(0.012);
  pushed_way_ = any_way(0.15), near_way_ = any_way(0.006), force_way_ = any_way(0.1), traction_way_ = any_way(40);
  amount_way_ = {any_wander(2), any_wander(2), any_wander(2), any_wander(2)};
  volume_way_ = any_wander(2e-6), rest_length_way_ = any_wander(0.004);
  for (std::int32_t& organ : of_tool_) organ = draw(static_cast<int>(organs_.size()));
  on_top_ = {between(0.02, 0.055), between(0.008, 0.042), 0.04};
  grip_ = palpate_default_grip();
  grip_.kind = PALPATE_GRIP_SURFACE_POINT;
  put(body(), kSide, Vector3d(between(0.02, 0.055), 0.05, between(0.005, 0.035)), grip_);
  grasp_ = palpate_default_grasp();
  put(body(), -kUp, kGrasp, grasp_);
  grasp_.id = 1, grasp_.radius = between(0.004, 0.009), grasp_.friction = between(0.3, 1.2);
  grasp_.clamp_force = between(1, 30);
  needle_ = palpate_default_needle();
  put(body(), -kSide, kEntry, needle_);
  needle_.id = 1, needle_.radius = 0.0005, needle_.friction = between(0, 10), needle_.spacing = 0.006;
  needle_.cutting_force = between(0, 0.3), needle_.puncture_force = between(0, 0.4);
  given_ = palpate_default_given_force();
}

RandomWorld::Wander RandomWorld::any_wander(double size) {
  Wander wander;
  for (int w = 0; w < 2; ++w)
    wander.size[w] = size * between(0, 1), wander.rate[w] = between(1, 25), wander.phase[w] = between(0, 6);
  return wander;
}

double RandomWorld::at(Wander& wander) {
  if (happens(0.001)) wander.jumped = between(-1, 1) * wander.size[0];
  double sum = wander.jumped;
  for (int w = 0; w < 2; ++w) sum += wander.size[w] * std::sin(wander.rate[w] * dt_ * at_ + wander.phase[w]);
  return sum;
}
Vector3d RandomWorld::at(std::array<Wander, 3>& wander) {
  const double x = at(wander[0]), y = at(wander[1]);
  return {x, y, at(wander[2])};
}

SceneDef RandomWorld::any_def() {
  SceneDef def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_PATCH, def.law = kLaws[draw(4)];
  def.shape = PALPATE_SHAPE_VOLUME;
  def.large.deformation = static_cast<palpate_deformation_model>(draw(4));
  if (happens(0.5)) def.max_operations = 300'000;
  if (happens(0.5)) def.max_tool_speed = 1;
  if (happens(0.3)) {
    def.relaxation.terms = 1;
    def.relaxation.share[0] = 0.4, def.relaxation.time[0] = 0.1;
  }
  if (happens(0.3)) def.preload = PALPATE_PRELOAD_ON;
  def.report.report = PALPATE_REPORT_CONTACTS, def.inside.inside = PALPATE_INSIDE_ON;
  def.crossings.crossings = PALPATE_CROSSINGS_ON;
  def.motions.motions = def.grasps.grasps = def.needles.needles = def.force_control.force_control = 1;
  def.needles.needle_places = 12, def.links.max_links = 4, def.loads.count = 2;
  std::copy_n(kPointOfForce, 3, def.loads.centre[0]), def.loads.radius[0] = 0.01;
  std::copy_n(kFaceOfTraction, 3, def.loads.centre[1]), def.loads.radius[1] = 0.05;
  def.max_tools = def.max_points = 5;
  return def;
}

void RandomWorld::make_organs() {
  const int count = 1 + draw(3);
  for (int k = 0; k < count; ++k) {
    Organ organ;
    organ.def = any_def();
    organ.base = pose_at(kOrgans[k], kTurns[k]);
    organ.holds_volume = happens(0.5);
    let_be_cut(organ, std::mt19937_64(3 * seed_ + static_cast<std::uint64_t>(k)));
    organs_.push_back(organ);
    poses_.push_back(organ.base);
  }
  std::vector<palpate_world_organ> list;
  for (Organ& organ : organs_) list.push_back(organ_of(body(organ).bundle(), &organ.def, &organ.base));
  palpate_world_def def = palpate_default_world_def();
  def.organs = list.data(), def.organ_count = count;
  def.force_limit = def.force_slew = def.torque_limit = def.torque_slew = INFINITY;
  friction_ = happens(0.5) ? between(0.05, 0.5) : 0;
  def.max_pairs = 60, def.friction = friction_, def.max_links = 4;
  palpate_world* world = nullptr;
  palpate_error error = {};
  palpate_world_create(&def, &world, &error);
  world_.reset(world);
  if (!world) return find(fmt::format("refused: {}", error.text));
  contacts_ = std::make_unique<WorldContacts>(world);
  for (const Organ& organ : organs_) displacements_.emplace_back(3 * body(organ).body.mesh.nodes.size());
  positions_ = displacements_;
}

const TouchedBody& RandomWorld::body(const Organ& organ) const {
  SceneOfEffects scene;
  scene.cut = organ.is_cut;
  return body_of(scene).touched;
}

// Two of three. Draws from numbers of its own, so that the rest of the world is what the seed has always drawn.
void RandomWorld::let_be_cut(Organ& organ, std::mt19937_64 random) {
  const auto any = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto any_vector = [&](double size) {
    const double x = any(-size, size), y = any(-size, size);
    return Vector3d(x, y, any(-size, size));
  };
  organ.is_cut = any(0, 3) > 1;
  if (!organ.is_cut) return;
  organ.holds_volume = false;
  SceneDef& def = organ.def;
  def.shape = PALPATE_SHAPE_SURFACE;
  def.inside.inside = PALPATE_INSIDE_OFF, def.crossings.crossings = PALPATE_CROSSINGS_OFF, def.needles.needles = 0;
  def.preload = PALPATE_PRELOAD_OFF;  // it would open the cut, also when all is let go
  def.cut.cut = PALPATE_CUT_ON, def.cut.cut_operations = any(0, 2) > 1 ? 20'000 : 1'000'000;
  if (def.large.deformation == PALPATE_DEFORMATION_LINEAR && seed_ % 2 > 0) def.cut.cut_rebase = 12;
  organ.blade.place = Vector3d(0.03, 0.025, 0.03) + any_vector(0.02);
  organ.blade.edge = 0.02 * (Vector3d(0, 0, 1) + any_vector(0.4)), organ.blade.ahead = any_vector(1).normalized();
  for (Wander& wander : organ.blade.way)
    for (int w = 0; w < 2; ++w) wander.size[w] = any(0, 0.03), wander.rate[w] = any(1, 12), wander.phase[w] = any(0, 6);
  organ.blade.toughness = any(0, 2) > 1 ? any(0.5, 30) : 0;
}

palpate_link_end RandomWorld::any_end() {
  palpate_link_end end = {};
  if (happens(0.7)) {
    end.kind = PALPATE_END_SURFACE_POINT;
    put(body(), kSide, Vector3d(between(0.015, 0.055), 0.05, between(0.005, 0.035)), end);
  } else {
    end.kind = PALPATE_END_WORLD;
    Eigen::Map<Vector3d>(end.point) = Vector3d(between(0, 0.06), between(0.05, 0.08), between(0, 0.04));
  }
  return end;
}

void RandomWorld::make_links() {
  const auto any_link = [&](auto link) {
    link.kind = static_cast<palpate_link_kind>(1 + draw(3));
    if (link.kind == PALPATE_LINK_SPRING || happens(0.5)) link.stiffness = std::pow(10, between(0, 4));
    if (happens(0.3)) link.breaking_force = between(0.5, 5);
    return link;
  };
  for (Organ& organ : organs_)
    for (int count = draw(4); count > 0; --count) {
      palpate_link link = any_link(palpate_default_link());
      link.ends[0] = any_end(), link.ends[1] = any_end();
      if (link.ends[0].kind != PALPATE_END_SURFACE_POINT) std::swap(link.ends[0], link.ends[1]);
      while (link.ends[0].kind != PALPATE_END_SURFACE_POINT) link.ends[0] = any_end();
      organ.links.push_back(link);
    }
  for (int count = organs_.size() > 1 ? draw(4) : 0; count > 0; --count) {
    palpate_world_link link = any_link(palpate_default_world_link());
    link.organ[0] = 0, link.organ[1] = 1 + draw(static_cast<int>(organs_.size()) - 1);
    for (palpate_link_end& end : link.ends) do
        end = any_end();
      while (end.kind != PALPATE_END_SURFACE_POINT);
    links_.push_back(link);
  }
}

palpate_pose RandomWorld::pose_of(std::size_t organ, const Vector3d& moved) const {
  return pose_at(kOrgans[organ] + moved, kTurns[organ]);
}
Vector3d RandomWorld::in_world(std::size_t organ, const Vector3d& p) const {
  Vector3d world;
  palpate_point_to_world(poses_[organ].position, poses_[organ].orientation, p.data(), world.data());
  return world;
}
Vector3d RandomWorld::turned(std::size_t organ, const Vector3d& v) const {
  Vector3d world;
  palpate_vector_to_world(poses_[organ].orientation, v.data(), world.data());
  return world;
}

void RandomWorld::set_tools() {
  for (bool& away : is_away_)
    if (happens(0.004)) away = !away;
  palpate_tool tool[5];
  for (int t = 0; t < 5; ++t) tool[t] = palpate_default_tool(), tool[t].id = t, tool[t].organ = of_tool_[t];
  const auto organ_of_tool = [&](int t) { return static_cast<std::size_t>(of_tool_[t]); };
  finger_ = in_world(organ_of_tool(0), on_top_ + at(finger_way_));
  tool[0].points = finger_.data(), tool[0].point_count = 1, tool[0].disc_radius = 0.004, tool[0].friction = 0.4;
  Eigen::Map<Vector3d>(grip_.displacement) = at(grip_way_);
  tool[1].grips = &grip_, tool[1].grip_count = 1;
  const Vector3d pulled = at(jaws_way_);
  Eigen::Map<Vector3d>(grasp_.position) = in_world(organ_of_tool(2), kGrasp + pulled);
  const Quaterniond turn = [&] {
    const double* const q = poses_[organ_of_tool(2)].orientation;
    return Quaterniond(q[0], q[1], q[2], q[3]) * Quaterniond(Eigen::AngleAxisd(30 * pulled[0], kUp));
  }();
  grasp_.orientation[0] = turn.w(), grasp_.orientation[1] = turn.x(), grasp_.orientation[2] = turn.y(),
  grasp_.orientation[3] = turn.z();
  if (is_away_[2] && happens(0.05)) ++grasp_.id;
  tool[2].parts = is_away_[2] ? nullptr : &grasp_.part;
  const Vector3d stuck = at(needle_way_);
  Eigen::Map<Vector3d>(needle_.tip) =
      in_world(organ_of_tool(3), kEntry + (0.01 + 1.5 * stuck[1]) * kSide + 0.1 * stuck);
  Eigen::Map<Vector3d>(needle_.direction) =
      turned(organ_of_tool(3), (kSide + 3 * Vector3d(stuck[2], 0, stuck[0])).normalized());
  if (is_away_[3] && happens(0.05)) ++needle_.id;
  tool[3].parts = is_away_[3] || organs_[organ_of_tool(3)].is_cut ? nullptr : &needle_.part;
  pusher_ = in_world(organ_of_tool(4), Vector3d(0.048, 0.014, -0.0005));
  tool[4].points = pusher_.data(), tool[4].point_count = 1, tool[4].disc_radius = 0.004, tool[4].friction = 0.4;
  const Vector3d pushed = at(pushed_way_);
  Eigen::Map<Vector3d>(given_.force) = turned(organ_of_tool(4), Vector3d(0.1 * pushed[0], 0.1 * pushed[1], pushed[2]));
  tool[4].parts = &given_.part;
  tools_.clear();
  for (int t = 0; t < 5; ++t)
    if (!is_away_[t] || t == 2 || t == 3) tools_.push_back(tool[t]);
}

void RandomWorld::set_organs() {
  // Each amount alone moves the box by about a millimetre.
  static const Eigen::Vector4d unit = [] {
    Eigen::Vector4d u;
    for (int m = 0; m < 4; ++m) u[m] = 1e-3 / body_of(Store::f32).motions.col(m).cwiseAbs().maxCoeff();
    return u;
  }();
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    palpate_scene* const scene = palpate_world_scene(world_.get(), static_cast<std::int32_t>(k));
    if (k > 0) {
      poses_[k] = pose_of(k, at(near_way_));
      palpate_scene_set_pose(scene, &poses_[k], nullptr);
    }
    Eigen::Vector4d amounts;
    for (int m = 0; m < 4; ++m) amounts[m] = at(amount_way_[m]) * unit[m];
    palpate_scene_set_motions(scene, amounts.data(), 4, nullptr);
    if (organs_[k].holds_volume) palpate_scene_hold_volume(scene, kFilling, at_ / 150 % 2, at(volume_way_), nullptr);
    const Vector3d force = at(force_way_), traction = at(traction_way_);
    palpate_scene_set_load(scene, 0, PALPATE_LOAD_FORCE_IN_WORLD, force.data(), nullptr);
    palpate_scene_set_load(scene, 1, PALPATE_LOAD_TRACTION, traction.data(), nullptr);
    std::vector<palpate_link> sent = organs_[k].links;
    for (palpate_link& link : sent) {
      if (link.kind != PALPATE_LINK_CLIP) link.rest_length = std::max(0.0, 0.02 + at(rest_length_way_));
      for (palpate_link_end& end : link.ends)
        if (end.kind == PALPATE_END_WORLD) Eigen::Map<Vector3d>(end.point) = in_world(k, Vector3d(end.point));
    }
    palpate_scene_set_links(scene, sent.data(), static_cast<std::int32_t>(sent.size()), nullptr);
    if (organs_[k].is_cut) set_blade(k);
  }
  std::vector<palpate_world_link> sent = links_;
  for (palpate_world_link& link : sent)
    if (link.kind != PALPATE_LINK_CLIP) link.rest_length = std::max(0.0, 0.05 + at(rest_length_way_));
  palpate_world_set_links(world_.get(), sent.data(), static_cast<std::int32_t>(sent.size()), nullptr);
}

// Away for a third of the time.
void RandomWorld::set_blade(std::size_t organ) {
  auto& of = organs_[organ].blade;
  palpate_blade blade = palpate_default_blade();
  Vector3d at = of.place;
  for (int d = 0; d < 3; ++d)
    for (int w = 0; w < 2; ++w)
      at[d] += of.way[d].size[w] * std::sin(of.way[d].rate[w] * dt_ * at_ + of.way[d].phase[w]);
  const Vector3d points[] = {in_world(organ, at - of.edge), in_world(organ, at + of.edge)};
  if (at_ / 40 % 3 > 0) blade.points = points[0].data(), blade.point_count = 2;
  blade.toughness = of.toughness;
  Eigen::Map<Vector3d>(blade.direction) = turned(organ, of.ahead);
  palpate_scene* const scene = palpate_world_scene(world_.get(), static_cast<std::int32_t>(organ));
  palpate_scene_set_blade(scene, 0, &blade, nullptr);
}

void RandomWorld::step(const std::vector<palpate_tool>& tools) {
  flags_ = palpate_world_touch(world_.get(), tools.data(), static_cast<std::int32_t>(tools.size()), dt_,
                               contacts_->get(), contacts_->bytes());
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    palpate_scene* const scene = palpate_world_scene(world_.get(), static_cast<std::int32_t>(k));
    // The thread beside the touch comes to its end in some ticks and is late in others.
    const bool beside = organs_[k].def.large.deformation >= PALPATE_DEFORMATION_LARGE_BESIDE;
    if (beside && (at_ % 3 == 0 || tools.empty())) palpate_scene_deform(scene);
    palpate_shape_out out = shape_out(displacements_[k].data(), positions_[k].data(),
                                      static_cast<std::int32_t>(displacements_[k].size() / 3));
    flags_ |= palpate_scene_shape(scene, &contacts_->organ(static_cast<std::int32_t>(k)), &out);
    if (organs_[k].is_cut) continue;
    flags_ |= palpate_scene_inside(scene, &out, nullptr) & PALPATE_STEP_BAD_INPUT;
    flags_ |= palpate_scene_crossings(scene, &out, nullptr) & PALPATE_STEP_BAD_INPUT;
  }
}

void RandomWorld::find(const std::string& what) {
  ++counts_.found;
  tell_(fmt::format("seed {}, step {}: {}, flags {:#x} ({})", seed_, at_, what, flags_, text()));
}

std::string RandomWorld::text() const {
  std::string text;
  for (const Organ& organ : organs_)
    text += fmt::format("{}{} {}{}{}{}{}", text.empty() ? "" : "; ", kWordsOfBody[organ.def.large.deformation],
                        kWordsOfLaw[organ.def.law], organ.holds_volume ? ", volume held" : "",
                        organ.def.preload == PALPATE_PRELOAD_ON ? ", preload" : "", organ.is_cut ? ", cut" : "",
                        fmt::format(", {} links", organ.links.size()));
  return text + fmt::format("; {} between, friction {:.2g}", links_.size(), friction_);
}

void RandomWorld::look() {
  ++counts_.steps;
  counts_.flagged += flags_ != 0;
  counts_.touching += contacts_->get()->pair_count > 0;
  if (flags_ & PALPATE_STEP_BAD_INPUT) find("an input, or a shape, is refused");
  if (flags_ & PALPATE_STEP_UNSOLVED) find("a number is not finite");
  double force = 0, way = 0;
  bool finite = true;
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    const palpate_world_tool_state& state = contacts_->tool(static_cast<std::int32_t>(t));
    finite = finite && is_finite(state.force, 3) && is_finite(state.torque, 3);
    force = std::max(force, Vector3d(state.force).norm());
  }
  bool large = false;
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    const palpate_contacts& contacts = contacts_->organ(static_cast<std::int32_t>(k));
    large = large || organs_[k].def.large.deformation != PALPATE_DEFORMATION_LINEAR;
    for (std::int32_t n = 0; n < contacts.node_count; ++n)
      finite = finite && is_finite(palpate_contacts_node(&contacts, n)->modified_displacement, 3);
    for (const float u : displacements_[k])
      finite = finite && std::isfinite(u), way = std::max<double>(way, std::fabs(u));
  }
  counts_.large += large;
  counts_.force = std::max(counts_.force, force), counts_.displacement = std::max(counts_.displacement, way);
  if (!finite) find("a number is not finite, and nothing says so");
  if (force > kMostForce) find(fmt::format("a tool has a force of {:.3g} N", force));
  if (way > kMostWay) find(fmt::format("a node has moved by {:.3g} m", way));
}

// No tool, no link, no load, no amount, and organs far from one another.
void RandomWorld::let_go() {
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    palpate_scene* const scene = palpate_world_scene(world_.get(), static_cast<std::int32_t>(k));
    poses_[k] = pose_of(k, Vector3d(0.3 * static_cast<double>(k), 0, 0));
    palpate_scene_set_pose(scene, &poses_[k], nullptr);
    const Eigen::Vector4d amounts = Eigen::Vector4d::Zero();
    palpate_scene_hold_volume(scene, kFilling, 0, 0, nullptr);
    palpate_scene_set_motions(scene, amounts.data(), 4, nullptr);
    for (int l = 0; l < 2; ++l) palpate_scene_set_load(scene, l, PALPATE_LOAD_FORCE, amounts.data(), nullptr);
    palpate_scene_set_links(scene, nullptr, 0, nullptr);
    const palpate_blade none = palpate_default_blade();
    if (organs_[k].is_cut) palpate_scene_set_blade(scene, 0, &none, nullptr);
  }
  palpate_world_set_links(world_.get(), nullptr, 0, nullptr);
  tools_.clear();
}

// m. A new node's displacement is told from where it was in reserve.
double RandomWorld::displacement_left(std::size_t organ) const {
  std::vector<float> u = displacements_[organ];
  const palpate_scene* const scene = palpate_world_scene(world_.get(), static_cast<std::int32_t>(organ));
  const TouchedBody& of = body(organs_[organ]);
  std::vector<std::array<std::int32_t, 2>> made(static_cast<std::size_t>(palpate_scene_cut_nodes(scene, nullptr, 0)));
  if (!made.empty()) palpate_scene_cut_nodes(scene, made[0].data(), static_cast<std::int32_t>(made.size()));
  for (const auto& [node, from] : made)
    for (int d = 0; d < 3; ++d) u[3 * node + d] += static_cast<float>((of.node(node) - of.node(from))[d]);
  double left = 0;
  for (const float x : u) left = std::max<double>(left, std::fabs(x));
  return left;
}

void RandomWorld::look_at_rest() {
  double left = 0;
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    left = std::max(left, displacement_left(k));
    const palpate_scene* const scene = palpate_world_scene(world_.get(), static_cast<std::int32_t>(k));
    if (const palpate_cut_state* const cut = palpate_scene_cut_state(scene)) counts_.cut += cut->faces;
  }
  counts_.left = std::max(counts_.left, left);
  if (left > kLeft || flags_ != 0) find(fmt::format("let go, it has {:.3g} mm left", 1e3 * left));
}

void RandomWorld::play(int steps) {
  if (!world_) return;
  for (at_ = 0; at_ < steps; ++at_) {
    set_organs();
    set_tools();
    step(tools_);
    look();
  }
  let_go();
  for (; at_ < steps + kRestSteps; ++at_) step({}), look();
  look_at_rest();
}

}  // namespace palpate::tests
