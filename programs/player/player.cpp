#include "programs/player/player.h"

#include "programs/player/scene_bundle.h"

namespace palpate {
namespace {

SceneConfig checked(SceneConfig scene) {
  expect_one_organ(scene);
  check_touch_count(scene);
  return scene;
}

}  // namespace

Player::Player(SceneConfig scene, const std::filesystem::path& bundle, Half half, const RenderMesh* render_mesh)
    : organ_(checked(std::move(scene)), bundle, half, render_mesh) {
  const SceneDef def = organ_.definition(organ_.points_and_grips());
  palpate_scene* created = nullptr;
  palpate_error error{};
  if (palpate_scene_create(organ_.bundle(), &def, &created, &error) != PALPATE_OK) organ_.refuse(error);
  runtime_scene_.reset(created);
  organ_.play_on(created);
  tools_ = std::make_unique<PlayedTools>(organ_.scene(), std::vector{&organ_});
}

std::uint64_t Player::shape_count() const {
  return scene().def.shape == PALPATE_SHAPE_OFF ? 0 : frames_of(scene());
}

void Player::move_tools(double time) {
  organ_.move(time);
  tools_->move(time);
}

Timing Player::play(const std::function<void(const TouchRecord&)>& on_touch,
                    const std::function<void(const ShapeRecord&)>& on_shape, const std::function<void()>& before,
                    const std::function<void()>& on_deform) {
  palpate_scene_reset(runtime_scene());
  const bool solves_beside = palpate_scene_deform(runtime_scene()) >= 0;
  const bool shaped = scene().def.shape != PALPATE_SHAPE_OFF;
  const int node_count = shape_node_count();
  std::vector<float> displacements(3 * static_cast<std::size_t>(node_count)), positions(displacements.size());
  std::vector<float> skin_positions(render_mesh() ? render_mesh()->positions.size() : 0), skin_normals(skin_positions);
  // 8-byte aligned, as the API asks.
  std::vector<std::uint64_t> memory((palpate_contacts_bytes(runtime_scene()) + 7) / 8);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());

  const std::uint64_t steps = touch_count();
  Timing timing;
  timing.touch_us.reserve(steps);
  std::uint64_t frame = 0, solve = 0;
  for (std::uint64_t step = 0; step < steps; ++step) {
    const double time = static_cast<double>(step) / scene().touch_hz;
    move_tools(time);
    if (before) before();
    const auto touch_flags =
        timed(timing.touch_us, [&] { return touch(1 / scene().touch_hz, contacts, memory.size() * sizeof memory[0]); });
    if (on_touch) on_touch({time, touch_flags, this->positions(), *contacts});
    if (solves_beside && step >= step_of(solve, scene().deform_hz, scene())) {
      ++solve;
      if (before) before();
      timed(timing.deform_us, [&] { return static_cast<palpate_step_flags>(palpate_scene_deform(runtime_scene())); });
      if (on_deform) on_deform();
    }
    if (!shaped || step < step_of(frame, scene().shape_hz, scene())) continue;
    ++frame;
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = displacements.data(), out.positions = positions.data(), out.node_capacity = node_count;
    if (before) before();
    auto shape_flags = timed(timing.shape_us, [&] { return palpate_scene_shape(runtime_scene(), contacts, &out); });
    if (organ_.is_cut()) place_new_nodes(runtime_scene(), palpate_bundle_nodes(organ_.bundle()), out);
    if (render_mesh()) {
      palpate_skin_out skin = palpate_default_skin_out();
      skin.positions = skin_positions.data(), skin.normals = skin_normals.data(),
      skin.vertex_capacity = static_cast<std::int32_t>(skin_positions.size() / 3);
      skin.report = palpate_scene_report(runtime_scene());  // NULL where no dent is drawn
      shape_flags |= timed(timing.skin_us, [&] { return palpate_scene_skin(runtime_scene(), &out, &skin); });
    }
    if (organ_.crossings()) shape_flags |= timed(timing.crossings_us, [&] { return organ_.crossings()->follow(out); });
    if (organ_.inside()) shape_flags |= timed(timing.inside_us, [&] { return organ_.inside()->follow(out); });
    if (on_shape)
      on_shape({time, shape_flags, points(), *contacts, out.node_count, displacements.data(), positions.data(),
                render_mesh() ? skin_positions.data() : nullptr, render_mesh() ? skin_normals.data() : nullptr,
                organ_.crossings(), organ_.inside()});
  }
  return timing;
}

}  // namespace palpate
