#include "programs/player/world_player.h"

#include <algorithm>
#include <cstdio>

#include "formats/errors.h"

namespace palpate {
namespace {

palpate_pose pose_of(const SceneConfig::Organ& organ) {
  palpate_pose pose = palpate_default_pose();
  std::copy(organ.position.begin(), organ.position.end(), pose.position);
  const std::array<double, 4> orientation = quaternion_of(turn_at({{0, organ.turn}}, 0));
  std::copy(orientation.begin(), orientation.end(), pose.orientation);
  return pose;
}

// What the shapes of an organ are written to.
struct ShapeBuffers {
  std::vector<float> displacements, positions;
  palpate_shape_out out = palpate_default_shape_out();

  explicit ShapeBuffers(int node_count)
      : displacements(3 * static_cast<std::size_t>(node_count)), positions(displacements.size()) {
    out.displacements = displacements.data(), out.positions = positions.data(), out.node_capacity = node_count;
  }
  ShapeBuffers(ShapeBuffers&&) = default;
};

}  // namespace

WorldPlayer::WorldPlayer(SceneConfig scene, const std::vector<std::filesystem::path>& bundles)
    : scene_(std::move(scene)) {
  check_touch_count(scene_);
  for (std::size_t k = 0; k < scene_.organs.size(); ++k) {
    organs_.push_back(
        std::make_unique<PlayedOrgan>(organ_scene(scene_, k), bundles[k], Half::both, nullptr, scene_.organs[k].name));
    poses_.push_back(pose_of(scene_.organs[k]));
  }
  put_placed_tools_into_the_world();
  links_ = std::make_unique<OrganLinks>(scene_, organs_, poses_);
  create();
  std::vector<PlayedOrgan*> organs;
  for (const auto& organ : organs_) organs.push_back(organ.get());
  tools_ = std::make_unique<PlayedTools>(scene_, organs, poses_);
}

void WorldPlayer::put_placed_tools_into_the_world() {
  for (std::size_t t = 0; t < scene_.tools.size(); ++t) {
    SceneConfig::Tool& tool = scene_.tools[t];
    if (!tool.place) continue;
    tool.path = organs_[tool.organ]->scene().tools[t].path;
    const palpate_pose& pose = poses_[tool.organ];
    for (SceneConfig::KeyFrame& frame : tool.path)
      palpate_point_to_world(pose.position, pose.orientation, frame.position.data(), frame.position.data());
  }
}

void WorldPlayer::create() {
  int max_points = 0;
  for (const auto& organ : organs_) max_points = std::max(max_points, organ->points_and_grips());
  std::vector<SceneDef> scenes;
  std::vector<palpate_world_organ> all(organs_.size(), palpate_default_world_organ());
  for (const auto& organ : organs_) scenes.push_back(organ->definition(max_points));
  for (std::size_t k = 0; k < organs_.size(); ++k)
    all[k].bundle = organs_[k]->bundle(), all[k].def = &scenes[k], all[k].pose = &poses_[k];
  palpate_world_def def = palpate_default_world_def();
  def.organs = all.data(), def.organ_count = static_cast<std::int32_t>(all.size());
  def.force_limit = scene_.def.force_limit, def.force_slew = scene_.def.force_slew;
  def.max_pairs = scene_.pairs, def.friction = scene_.organ_friction;
  def.max_links = static_cast<std::int32_t>(links_->links().size());
  palpate_world* created = nullptr;
  palpate_error error{};
  if (palpate_world_create(&def, &created, &error) != PALPATE_OK) {
    std::size_t organ = 0;  // that the sentence names
    if (std::sscanf(error.text, "organ %zu:", &organ) != 1 || organ >= organs_.size()) organ = 0;
    organs_[organ]->refuse(error);
  }
  world_.reset(created);
  for (std::size_t k = 0; k < organs_.size(); ++k)
    organs_[k]->play_on(palpate_world_scene(created, static_cast<std::int32_t>(k)));
}

std::uint64_t WorldPlayer::shape_count() const {
  for (const auto& organ : organs_)
    if (organ->scene().def.shape != PALPATE_SHAPE_OFF) return frames_of(scene_);
  return 0;
}

bool WorldPlayer::solves_beside() const {
  return std::any_of(organs_.begin(), organs_.end(),
                     [](const auto& organ) { return palpate_scene_deform(organ->runtime_scene()) >= 0; });
}

Timing WorldPlayer::play(const std::function<void(const WorldTouchRecord&)>& on_touch,
                         const std::function<void(const WorldShapeRecord&)>& on_shape,
                         const std::function<void()>& before, const std::function<void()>& on_deform) {
  palpate_world_reset(world_.get());
  std::vector<ShapeBuffers> buffers;
  for (const auto& organ : organs_) buffers.emplace_back(organ->shape_node_count());
  std::vector<std::uint64_t> memory((palpate_world_contacts_bytes(world_.get()) + 7) / 8);
  auto* contacts = reinterpret_cast<palpate_world_contacts*>(memory.data());
  const std::uint64_t steps = touch_count(), frames = shape_count();
  const bool beside = solves_beside();
  Timing timing;
  std::uint64_t frame = 0, solve = 0;
  for (std::uint64_t step = 0; step < steps; ++step) {
    const double time = static_cast<double>(step) / scene_.touch_hz;
    for (const auto& organ : organs_) organ->move(time);
    links_->hold(world_.get(), time);
    tools_->move(time);
    if (before) before();
    const palpate_step_flags flags = timed(timing.touch_us, [&] {
      return palpate_world_touch(world_.get(), tools_->tools().data(),
                                 static_cast<std::int32_t>(tools_->tools().size()), 1 / scene_.touch_hz, contacts,
                                 memory.size() * sizeof memory[0]);
    });
    tools_->follow();
    on_touch({time, flags, tools_->positions(), *contacts});
    if (beside && step >= step_of(solve, scene_.deform_hz, scene_)) {
      ++solve;
      if (before) before();
      timed(timing.deform_us, [&] {
        for (const auto& organ : organs_) palpate_scene_deform(organ->runtime_scene());  // -1 where it has no such body
        return 0;
      });
      if (on_deform) on_deform();
    }
    if (frame >= frames || step < step_of(frame, scene_.shape_hz, scene_)) continue;
    ++frame;
    std::vector<palpate_step_flags> shape_flags(organs_.size());
    if (before) before();
    timed(timing.shape_us, [&] {
      for (std::size_t k = 0; k < organs_.size(); ++k)
        if (buffers[k].out.node_capacity > 0)
          shape_flags[k] = palpate_scene_shape(organs_[k]->runtime_scene(),
                                               palpate_world_contacts_organ(contacts, static_cast<std::int32_t>(k)),
                                               &buffers[k].out);
      return 0;
    });
    for (std::size_t k = 0; k < organs_.size(); ++k)
      if (organs_[k]->is_cut() && buffers[k].out.node_capacity > 0)
        place_new_nodes(organs_[k]->runtime_scene(), palpate_bundle_nodes(organs_[k]->bundle()), buffers[k].out);
    if (std::any_of(organs_.begin(), organs_.end(), [](const auto& organ) { return organ->inside() != nullptr; }))
      timed(timing.inside_us, [&] {
        for (std::size_t k = 0; k < organs_.size(); ++k)
          if (organs_[k]->inside()) shape_flags[k] |= organs_[k]->inside()->follow(buffers[k].out);
        return 0;
      });
    if (std::any_of(organs_.begin(), organs_.end(), [](const auto& organ) { return organ->crossings() != nullptr; }))
      timed(timing.crossings_us, [&] {
        for (std::size_t k = 0; k < organs_.size(); ++k)
          if (organs_[k]->crossings()) shape_flags[k] |= organs_[k]->crossings()->follow(buffers[k].out);
        return 0;
      });
    std::vector<ShapeRecord> shapes;
    for (std::size_t k = 0; k < organs_.size(); ++k)
      shapes.push_back({time, shape_flags[k], tools_->points(),
                        *palpate_world_contacts_organ(contacts, static_cast<std::int32_t>(k)),
                        buffers[k].out.node_count, buffers[k].displacements.data(), buffers[k].positions.data(),
                        nullptr, nullptr, organs_[k]->crossings(), organs_[k]->inside()});
    on_shape({*contacts, shapes});
  }
  return timing;
}

}  // namespace palpate
