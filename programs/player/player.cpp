#include "programs/player/player.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "formats/errors.h"
#include "programs/player/tool_places.h"
#include "programs/player/tool_points.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;
using Clock = std::chrono::steady_clock;

constexpr double kMostSteps = 1e8;

// The config's words and the API's enums are in the same order.
static_assert(static_cast<int>(SceneConfig::Collision::deformed) == PALPATE_COLLISION_DEFORMED);
static_assert(static_cast<int>(SceneConfig::Contact::patch) == PALPATE_CONTACT_PATCH);
static_assert(static_cast<int>(SceneConfig::Law::coulomb) == PALPATE_LAW_COULOMB);
static_assert(static_cast<int>(SceneConfig::Force::response) == PALPATE_FORCE_RESPONSE);
static_assert(static_cast<int>(SceneConfig::Shape::volume) == PALPATE_SHAPE_VOLUME);
static_assert(static_cast<int>(SceneConfig::Radial::response) == PALPATE_RADIAL_RESPONSE);

[[noreturn]] void refuse(const SceneConfig& scene, const std::filesystem::path& bundle, const palpate_error& error) {
  const std::string at = error.byte_offset ? fmt::format("byte {}: ", error.byte_offset) : "";
  const bool of_surface = scene.surface && std::string_view(error.text).starts_with("palpate_fine_surface");
  const auto& file = of_surface ? scene.surface->file : error.status == PALPATE_ERROR_ARGUMENT ? scene.file : bundle;
  const std::string text = fmt::format("{}: {}{}", file.string(), at, error.text);
  if (error.status == PALPATE_ERROR_MEMORY) throw OperationError(text);
  throw InputError(text);
}

Vector node_position(const palpate_bundle* bundle, std::int32_t node) {
  const double* p = palpate_bundle_nodes(bundle) + 3 * static_cast<std::size_t>(node);
  return {p[0], p[1], p[2]};
}

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

bool inside(const Vector& p, const Vector& low, const Vector& high) {
  for (int d = 0; d < 3; ++d)
    if (p[d] < low[d] || p[d] > high[d]) return false;
  return true;
}

std::vector<palpate_grip> resolve_grips(const SceneConfig::Tool& tool, const palpate_bundle* bundle,
                                        const std::filesystem::path& file) {
  std::vector<palpate_grip> grips;
  for (const auto& grip : tool.grips)
    for (const std::int32_t node : gripped_nodes(grip, bundle, file)) {
      palpate_grip resolved = palpate_default_grip();
      resolved.kind = PALPATE_GRIP_NODE;
      resolved.node = node;
      resolved.axes = grip.axes;
      grips.push_back(resolved);
    }
  return grips;
}

// points and grips are borrowed.
palpate_tool tool_of(const SceneConfig::Tool& from, const std::vector<SceneConfig::Vector>& points,
                     const std::vector<palpate_grip>& grips) {
  palpate_tool tool = palpate_default_tool();
  tool.points = points.empty() ? nullptr : points[0].data();
  tool.point_count = static_cast<std::int32_t>(points.size());
  tool.grips = grips.data();
  tool.grip_count = static_cast<std::int32_t>(grips.size());
  tool.disc_radius = from.disc_radius, tool.friction = from.friction, tool.hold = from.hold ? 1 : 0;
  tool.has_torque = from.grasp ? 1 : 0;
  return tool;
}

palpate_scene_def scene_def(const SceneConfig& scene, int points_and_grips, const HeldTissue& held) {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = static_cast<palpate_collision>(scene.collision);
  def.contact = static_cast<palpate_contact_model>(scene.contact);
  def.law = static_cast<palpate_contact_law>(scene.law);
  def.force = static_cast<palpate_force_model>(scene.force);
  def.shape = static_cast<palpate_shape_model>(scene.shape);
  def.radial = static_cast<palpate_radial_model>(scene.radial);
  def.deformation = static_cast<palpate_deformation_model>(scene.deformation);
  def.preload = scene.preload ? PALPATE_PRELOAD_ON : PALPATE_PRELOAD_OFF;
  if (scene.relaxation) {
    def.relaxation.model = PALPATE_RELAXATION_PRONY;
    for (const auto& [share, time] : scene.relaxation->terms) {
      def.relaxation.share[def.relaxation.terms] = share;
      def.relaxation.time[def.relaxation.terms++] = time;
    }
  }
  def.max_tools = static_cast<int>(scene.tools.size());
  def.max_points = scene.limits.points.value_or(std::max(1, points_and_grips));
  // A disc covers a dozen nodes of a coarse mesh, and a hundred of a fine one.
  const int nodes_per_point = scene.contact == SceneConfig::Contact::patch ? 100 : 3, most = 3000;  // of palpate.h
  def.max_contact_nodes = scene.limits.contact_nodes.value_or(std::min(
      most, std::max(3 * def.max_points, std::min(1000, nodes_per_point * def.max_points)) + held.most_nodes()));
  def.max_links = static_cast<std::int32_t>(held.links().size()), def.grasps = held.has_grasps();
  def.motions = !scene.motions.empty();
  def.force_limit = scene.limits.force;
  def.force_slew = scene.limits.force_slew;
  def.max_tool_speed = scene.limits.tool_speed, def.max_operations = scene.limits.operations;
  if (scene.limits.release_distance) def.release_distance = *scene.limits.release_distance;
  return def;
}

// The limits are those of the whole scene, so that the contacts of one half fit the other half.
palpate_scene_def half_of(palpate_scene_def def, Half half) {
  // Under large deformation the touch half solves for the nodes of the shape.
  if (half == Half::touch && def.deformation == PALPATE_DEFORMATION_LINEAR)
    def.shape = PALPATE_SHAPE_OFF, def.radial = PALPATE_RADIAL_OFF;
  if (half == Half::shape) {
    def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE, def.law = PALPATE_LAW_STICKING;
    def.force = PALPATE_FORCE_OFF, def.relaxation.model = PALPATE_RELAXATION_OFF;
    def.max_links = def.grasps = 0;
  }
  return def;
}

// The touch step at which number `index` of what happens `rate` times a second is due.
std::uint64_t step_of(std::uint64_t index, double rate, const SceneConfig& scene) {
  constexpr double rounding = 1e-9;  // so that 3 * 1000 / 50 is 60, not 61
  return static_cast<std::uint64_t>(std::ceil(static_cast<double>(index) * scene.touch_hz / rate - rounding));
}
std::uint64_t step_of_frame(std::uint64_t frame, const SceneConfig& scene) {
  return step_of(frame, scene.shape_hz, scene);
}

template <typename Call>
palpate_step_flags timed(std::vector<double>& microseconds, const Call& call) {
  const auto start = Clock::now();
  const palpate_step_flags flags = call();
  microseconds.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  return flags;
}

}  // namespace

std::vector<std::int32_t> gripped_nodes(const SceneConfig::Grip& grip, const palpate_bundle* bundle,
                                        const std::filesystem::path& file) {
  const std::int32_t* touchable = palpate_bundle_touchable(bundle);
  const std::vector<std::int32_t> candidates(touchable, touchable + palpate_bundle_describe(bundle).touchable_count);
  std::vector<std::int32_t> nodes;
  if (grip.nearest && !candidates.empty()) {
    const auto nearer = [&](std::int32_t a, std::int32_t b) {
      return distance(node_position(bundle, a), *grip.nearest) < distance(node_position(bundle, b), *grip.nearest);
    };
    nodes.push_back(*std::min_element(candidates.begin(), candidates.end(), nearer));
  } else if (!grip.nearest) {
    for (const std::int32_t node : candidates)
      if (inside(node_position(bundle, node), grip.box_min, grip.box_max)) nodes.push_back(node);
  }
  if (nodes.empty())
    throw InputError(
        fmt::format("{}:{}: [[tool.grip]]: expected touchable nodes of the bundle there, found none; "
                    "compare with \"palpate-bundle info\"",
                    file.string(), grip.line));
  return nodes;
}

Player::Player(SceneConfig scene, const std::filesystem::path& bundle, Half half, const RenderMesh* render_mesh)
    : scene_(std::move(scene)), render_mesh_(render_mesh) {
  if (duration() * scene_.touch_hz > kMostSteps)
    throw InputError(fmt::format("{}: rate.touch: expected at most {} steps, found {} s at {} Hz", scene_.file.string(),
                                 kMostSteps, duration(), scene_.touch_hz));
  palpate_error error{};
  palpate_bundle* opened = nullptr;
  palpate_bundle_options options = palpate_default_bundle_options();
  // A bundle may be computed anew while the player reads it. These programs have no handler of SIGBUS of their own, and a flag in
  // the summary tells more than a process that ends.
  options.file_access = PALPATE_FILE_MAP_GUARDED;
  if (palpate_bundle_open_file(bundle.c_str(), &options, &opened, &error) != PALPATE_OK) refuse(scene_, bundle, error);
  bundle_.reset(opened);
  resolve_places(scene_, bundle_.get());

  std::size_t total = 0;
  for (const auto& tool : scene_.tools) {
    local_points_.push_back(tool_points(tool));
    grips_.push_back(resolve_grips(tool, bundle_.get(), scene_.file));
    total += local_points_.back().size() + grips_.back().size();
  }
  held_ = std::make_unique<HeldTissue>(scene_, bundle_.get());
  motions_ = std::make_unique<OrganMotions>(scene_, bundle_.get());
  palpate_scene_def def =
      half_of(scene_def(scene_, static_cast<int>(std::min<std::size_t>(total, 1 << 20)), *held_), half);
  scene_.shape = static_cast<SceneConfig::Shape>(def.shape);
  contact_node_limit_ = def.max_contact_nodes;
  palpate_render_mesh skin = palpate_default_render_mesh();
  if (render_mesh_) {
    skin.positions = render_mesh_->positions.data(), skin.normals = render_mesh_->normals.data();
    skin.vertex_count = static_cast<std::int32_t>(render_mesh_->positions.size() / 3);
    def.render_mesh = &skin;
    if (scene_.dent == SceneConfig::Dent::discs && half == Half::both)
      def.dent = PALPATE_DENT_DISCS, def.report = PALPATE_REPORT_CONTACTS;
  }
  if (scene_.surface && def.collision != PALPATE_COLLISION_OFF) {
    RenderMesh met = read_render_mesh(scene_.surface->file, scene_.surface->metres_per_unit);
    met_positions_ = std::move(met.positions);
    met_triangles_.assign(met.indices.begin(), met.indices.end());
    met_surface_.positions = met_positions_.data(), met_surface_.triangles = met_triangles_.data();
    met_surface_.vertex_count = static_cast<std::int32_t>(met_positions_.size() / 3);
    met_surface_.triangle_count = static_cast<std::int32_t>(met_triangles_.size() / 3);
    def.fine_surface = met_surface();
  }
  palpate_scene* created = nullptr;
  if (palpate_scene_create(bundle_.get(), &def, &created, &error) != PALPATE_OK) refuse(scene_, bundle, error);
  runtime_scene_.reset(created);

  points_ = local_points_;
  positions_.resize(scene_.tools.size());
  for (std::size_t t = 0; t < scene_.tools.size(); ++t)
    tools_.push_back(tool_of(scene_.tools[t], points_[t], grips_[t]));
  holds_ = def.max_links > 0 || def.grasps;
  if (holds_) held_->hold_links(runtime_scene_.get(), 0);
  moves_ = motions_->any() && half != Half::shape;
}

double Player::duration() const {
  double last = 0;
  for (const auto& tool : scene_.tools) {
    last = std::max(last, tool.path.back().time);
    if (!tool.turn.empty()) last = std::max(last, tool.turn.back().time);
    if (tool.grasp && !tool.grasp->closing.empty()) last = std::max(last, tool.grasp->closing.back()[0]);
  }
  for (const auto& link : scene_.links)
    for (const auto* rows : {&link.rest_length, &link.stiffness})
      if (!rows->empty()) last = std::max(last, rows->back()[0]);
  for (const auto& motion : scene_.motions)
    if (!motion.amounts.empty()) last = std::max(last, motion.amounts.back()[0]);
  return last;
}

std::uint64_t Player::touch_count() const {
  constexpr double rounding = 1e-9;  // relative: 0.3 s at 1000 Hz is 300 steps and one at the start
  return static_cast<std::uint64_t>(std::floor(duration() * scene_.touch_hz * (1 + rounding))) + 1;
}

std::uint64_t Player::shape_count() const {
  if (scene_.shape == SceneConfig::Shape::off) return 0;
  std::uint64_t count = 1;
  while (step_of_frame(count, scene_) < touch_count()) ++count;
  return count;
}

int Player::shape_node_count() const {
  if (scene_.shape == SceneConfig::Shape::off) return 0;
  const palpate_bundle_info info = palpate_bundle_describe(bundle_.get());
  return scene_.shape == SceneConfig::Shape::surface ? info.surface_node_count : info.node_count;
}

void Player::move_tools(double time) {
  if (holds_) held_->close_grasps(time), held_->hold_links(runtime_scene_.get(), time);
  if (moves_) motions_->set(runtime_scene_.get(), time);
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    place_tool(t, position_at(scene_.tools[t].path, time), turn_at(scene_.tools[t].turn, time));
    if (is_away(scene_.tools[t], time)) withdraw_tool(t);
  }
}

void Player::place_tool(std::size_t tool, const Vector& position, const Rotation& turn) {
  positions_[tool] = position;
  for (std::size_t p = 0; p < points_[tool].size(); ++p) {
    const Vector& local = local_points_[tool][p];
    for (int d = 0; d < 3; ++d)
      points_[tool][p][d] = position[d] + (turn[d][0] * local[0] + turn[d][1] * local[1] + turn[d][2] * local[2]);
  }
  const Vector& start = scene_.tools[tool].path.front().position;
  for (palpate_grip& grip : grips_[tool])
    for (int d = 0; d < 3; ++d) grip.displacement[d] = position[d] - start[d];
  tools_[tool].point_count = static_cast<std::int32_t>(points_[tool].size());
  tools_[tool].grip_count = static_cast<std::int32_t>(grips_[tool].size());
  if (!holds_) return;
  tools_[tool].grasp = held_->place_grasp(tool, position, turn);
  std::copy(position.begin(), position.end(), tools_[tool].reference);
}

void Player::withdraw_tool(std::size_t tool) {
  tools_[tool].point_count = tools_[tool].grip_count = 0;
  tools_[tool].grasp = nullptr;
}

Timing Player::play(const std::function<void(const TouchRecord&)>& on_touch,
                    const std::function<void(const ShapeRecord&)>& on_shape, const std::function<void()>& before,
                    const std::function<void()>& on_deform) {
  palpate_scene_reset(runtime_scene_.get());
  const bool solves_beside = scene_.deformation >= SceneConfig::Deformation::large_beside;
  const bool shaped = scene_.shape != SceneConfig::Shape::off;
  const int node_count = shape_node_count();
  std::vector<float> displacements(3 * static_cast<std::size_t>(node_count)), positions(displacements.size());
  std::vector<float> skin_positions(render_mesh_ ? render_mesh_->positions.size() : 0), skin_normals(skin_positions);
  // 8-byte aligned, as the API asks.
  std::vector<std::uint64_t> memory((palpate_contacts_bytes(runtime_scene_.get()) + 7) / 8);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());

  const std::uint64_t steps = touch_count();
  Timing timing;
  timing.touch_us.reserve(steps);
  std::uint64_t frame = 0, solve = 0;
  for (std::uint64_t step = 0; step < steps; ++step) {
    const double time = static_cast<double>(step) / scene_.touch_hz;
    move_tools(time);
    if (before) before();
    const auto touch_flags =
        timed(timing.touch_us, [&] { return touch(1 / scene_.touch_hz, contacts, memory.size() * sizeof memory[0]); });
    if (on_touch) on_touch({time, touch_flags, positions_, *contacts});
    if (solves_beside && step >= step_of(solve, scene_.deform_hz, scene_)) {
      ++solve;
      if (before) before();
      timed(timing.deform_us,
            [&] { return static_cast<palpate_step_flags>(palpate_scene_deform(runtime_scene_.get())); });
      if (on_deform) on_deform();
    }
    if (!shaped || step < step_of_frame(frame, scene_)) continue;
    ++frame;
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = displacements.data(), out.positions = positions.data(), out.node_capacity = node_count;
    if (before) before();
    auto shape_flags =
        timed(timing.shape_us, [&] { return palpate_scene_shape(runtime_scene_.get(), contacts, &out); });
    if (render_mesh_) {
      palpate_skin_out skin = palpate_default_skin_out();
      skin.positions = skin_positions.data(), skin.normals = skin_normals.data(),
      skin.vertex_capacity = static_cast<std::int32_t>(skin_positions.size() / 3);
      skin.report = palpate_scene_report(runtime_scene_.get());  // NULL where no dent is drawn
      shape_flags |= timed(timing.skin_us, [&] { return palpate_scene_skin(runtime_scene_.get(), &out, &skin); });
    }
    if (on_shape)
      on_shape({time, shape_flags, points_, *contacts, out.node_count, displacements.data(), positions.data(),
                render_mesh_ ? skin_positions.data() : nullptr, render_mesh_ ? skin_normals.data() : nullptr});
  }
  return timing;
}

}  // namespace palpate
