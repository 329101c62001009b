#include "tests/support/hostile_play.h"

namespace palpate::tests {

std::string broken_by_error(palpate_status status, const palpate_error& error, std::uint64_t file_bytes) {
  if (error.status != status) return "the error's status is not the one that was returned";
  if (!std::memchr(error.text, 0, sizeof error.text)) return "the error's sentence has no end";
  if ((status == PALPATE_OK) != (error.text[0] == '\0'))
    return "a status without a sentence, or a sentence without one";
  if (error.byte_offset > file_bytes) return "the error's place lies beyond the file";
  return "";
}

bool all_finite(const double* x, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(x[i])) return false;
  return true;
}

HeldPlay::HeldPlay(palpate_scene* scene, const SceneDef& def, std::int32_t nodes)
    : scene_(scene), def_(def), memory_(palpate_contacts_bytes(scene) / 8 + 1) {
  const std::size_t floats = def.shape == PALPATE_SHAPE_OFF ? 0 : 3 * static_cast<std::size_t>(nodes);
  displacements_.resize(floats), positions_.resize(floats);
  if (def.render_mesh.positions) skin_.resize(3 * static_cast<std::size_t>(def.render_mesh.vertex_count));
}

std::string HeldPlay::touch(const palpate_tool* tools, std::int32_t tool_count, double dt) {
  flags_ = palpate_scene_touch(scene_, tools, tool_count, dt, contacts(), memory_.size() * sizeof memory_[0]);
  const palpate_contacts& c = *contacts();
  if (c.flags != flags_) return "touch returned other flags than it wrote";
  if (def_.max_contact_nodes > 0 && c.node_capacity != def_.max_contact_nodes)
    return "another limit of nodes than asked";
  if (c.node_count < 0 || c.node_count > c.node_capacity) return "more contact nodes than the scene has";
  if (c.used_bytes != c.nodes_offset + static_cast<std::size_t>(c.node_count) * sizeof(palpate_contact_node))
    return "used_bytes is not what the contacts take";
  const palpate_contact_node* node = palpate_contacts_node(&c, 0);
  for (std::int32_t n = 0; n < c.node_count; ++n)
    if (!all_finite(node[n].force, 3) || !all_finite(node[n].modified_displacement, 3))
      return "a contact node that is not finite";
  if (!std::isfinite(c.residual_displacement) || !std::isfinite(c.residual_force))
    return "a residual that is not finite";
  // The force may change by the slew limit times dt, where dt counts as at most 20 ms. A tool that was not sent had none.
  std::map<std::int32_t, std::array<double, 3>> forces;
  for (int t = 0; t < c.tool_count; ++t) {
    const palpate_tool_state& tool = *palpate_contacts_tool(&c, t);
    if (!all_finite(tool.force, 3) || !all_finite(tool.direction, 3)) return "a force that is not finite";
    if (!all_finite(tool.force_raw, 3) && !(flags_ & PALPATE_STEP_UNSOLVED))
      return "a raw force that is not finite, and no flag";
    const std::array<double, 3> last = last_[tool.id];
    double size = 0, change = 0;
    for (std::size_t i = 0; i < 3; ++i)
      size = std::hypot(size, tool.force[i]), change = std::hypot(change, tool.force[i] - last[i]);
    if (size > def_.force_limit * (1 + 1e-9)) return "a force above its limit";
    // Below 1e-150 N the squares underflow, and the length is zero.
    if (change > def_.force_slew * 0.02 * (1 + 1e-9) + 1e-9 * size + 1e-150) return "a force faster than its slew";
    if (!forces.insert({tool.id, {tool.force[0], tool.force[1], tool.force[2]}}).second) return "two tools with one id";
  }
  last_ = forces;
  return "";
}

std::string HeldPlay::shape(const palpate_contacts* of) {
  if (def_.shape == PALPATE_SHAPE_OFF) return "";
  palpate_shape_out out =
      shape_out(displacements_.data(), positions_.data(), static_cast<std::int32_t>(displacements_.size() / 3));
  const palpate_step_flags flags = palpate_scene_shape(scene_, of, &out);
  flags_ |= flags;
  if (out.node_count < 0 || out.node_count > out.node_capacity) return "more nodes than there is room for";
  for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(out.node_count); ++i)
    if (!std::isfinite(displacements_[i]) || !std::isfinite(positions_[i])) return "a node that is not finite";
  if (def_.inside.inside != PALPATE_INSIDE_OFF)
    if (const std::string broken = look_inside(out); !broken.empty()) return broken;
  if (skin_.empty()) return "";
  palpate_skin_out skin = skin_out(skin_.data(), nullptr, static_cast<std::int32_t>(skin_.size() / 3));
  flags_ |= palpate_scene_skin(scene_, &out, &skin);
  if (skin.vertex_count < 0 || skin.vertex_count > skin.vertex_capacity) return "more vertices than there is room for";
  for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(skin.vertex_count); ++i)
    if (!std::isfinite(skin_[i])) return "a vertex that is not finite";
  return "";
}

void HeldPlay::reset() {
  palpate_scene_reset(scene_);
  last_.clear();
}

std::string HeldPlay::look_inside(const palpate_shape_out& shape) {
  stresses_.resize(2 * displacements_.size()), principal_.resize(displacements_.size());
  palpate_inside_out field = palpate_default_inside_out();
  field.capacity = static_cast<std::int32_t>(displacements_.size() / 3);
  field.stresses = stresses_.data(), field.principal = principal_.data();
  flags_ |= palpate_scene_inside(scene_, &shape, &field);
  if (field.count != shape.node_count) return "not a stress for each node";
  for (std::size_t i = 0; i < 6 * static_cast<std::size_t>(field.count); ++i)
    if (!std::isfinite(stresses_[i]) || !std::isfinite(principal_[i / 2])) return "a stress that is not finite";
  const double point[3] = {0.02, 0.02, 0.02};
  palpate_inside_place place;
  palpate_scene_locate(scene_, point, 1, INFINITY, &place);
  if (place.tetrahedron >= 0 && !all_finite(place.weight, 4)) return "a weight that is not finite";
  float moved[3];
  flags_ |= palpate_scene_carry(scene_, &shape, &place, 1, moved);
  for (const float x : moved)
    if (!std::isfinite(x)) return "a carried point that is not finite";
  return "";
}

Played play_bytes(AlignedBytes& bytes, const SceneDef& def, int steps) {
  Played played;
  palpate_error error = {};
  palpate_bundle* opened = nullptr;
  played.opened = palpate_bundle_open(bytes.data(), bytes.size(), nullptr, &opened, &error);
  const BundlePointer bundle(opened);
  played.broken = broken_by_error(played.opened, error, bytes.size());
  played.byte_offset = error.byte_offset;
  if ((opened == nullptr) != (played.opened != PALPATE_OK))
    played.broken = "a bundle in spite of an error, or none without one";
  if (!played.broken.empty() || !bundle) return played;

  palpate_scene* created = nullptr;
  played.created = palpate_scene_create(bundle.get(), &def, &created, &error);
  const ScenePointer scene(created);
  played.broken = broken_by_error(played.created, error, bytes.size());
  played.byte_offset = error.byte_offset;
  if ((created == nullptr) != (played.created != PALPATE_OK))
    played.broken = "a scene in spite of an error, or none without one";
  if (!played.broken.empty() || !scene) return played;

  const palpate_bundle_info info = palpate_bundle_describe(bundle.get());
  HeldPlay play(scene.get(), def, info.node_count);
  const double* node = palpate_bundle_nodes(bundle.get());
  const std::int32_t* touchable = palpate_bundle_touchable(bundle.get());
  for (int s = 0; s < steps && played.broken.empty(); ++s) {
    const std::int32_t n = (s / 3 * 7) % info.surface_node_count;
    // Outside, at the node, and inside, on a line through the middle of the box.
    double point[3];
    for (int i = 0; i < 3; ++i)
      point[i] = (s % 3 == 0 ? 1.3 : s % 3 == 1 ? 0.99 : 0.9) * (node[3 * n + i] - 0.025) + 0.025;
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_NODE, grip.node = touchable[s % info.touchable_count];
    grip.displacement[s % 3] = 1e-3;
    const palpate_tool tools[2] = {point_tool(point, 1, 0.004, 0.3), grip_tool(&grip)};
    played.broken = play.touch(tools, s % 5 == 4 ? 1 : 2, 1e-3);
    if (played.broken.empty()) played.broken = play.shape(play.contacts());
    played.flags |= play.flags();
  }
  return played;
}

}  // namespace palpate::tests
