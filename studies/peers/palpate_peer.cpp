#include "studies/peers/palpate_peer.h"

#include <fmt/format.h>

namespace palpate::studies {

SceneDef node_contact_scene() {
  SceneDef def;
  def.contact = PALPATE_CONTACT_NODE;
  def.force_limit = def.force_slew = 1e300;
  return def;
}

PalpatePeer::PalpatePeer(const std::filesystem::path& bundle, const Push& push, const SceneDef& def) : push_(push) {
  palpate_error error = {};
  palpate_bundle* opened = nullptr;
  if (palpate_bundle_open_file(bundle.c_str(), nullptr, &opened, &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: {}", bundle.string(), error.text));
  bundle_.reset(opened);
  const palpate_bundle_info info = palpate_bundle_describe(opened);
  if (info.node_count != static_cast<int>(push.body.nodes.size()) || info.surface_node_count != push.body.surface_count)
    throw InputError(
        fmt::format("{}: expected the bundle of this mesh, with {} nodes, found {}; precompute it with this mesh, "
                    "organ and boundary",
                    bundle.string(), push.body.nodes.size(), info.node_count));
  palpate_scene* created = nullptr;
  if (palpate_scene_create(opened, &def, &created, &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: {}", bundle.string(), error.text));
  scene_.reset(created);
  memory_.resize(palpate_contacts_bytes(created) / 8 + 1);
  surface_.resize(3 * static_cast<std::size_t>(info.surface_node_count));
}

double PalpatePeer::grip(std::int32_t node, const Eigen::Vector3d& displacement, Answer& out) {
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_NODE, grip.node = node;
  Eigen::Map<Eigen::Vector3d>(grip.displacement) = displacement;
  palpate_tool tool = palpate_default_tool();
  tool.grips = &grip, tool.grip_count = 1;
  const auto start = Clock::now();
  palpate_scene_touch(scene_.get(), &tool, 1, kTick, contacts(), memory_.size() * sizeof memory_[0]);
  shape();
  const double spent = seconds_since(start);
  out = answer();
  return spent;
}

void PalpatePeer::touch_point(const Eigen::Vector3d& point) {
  palpate_tool tool = palpate_default_tool();
  tool.points = point.data(), tool.point_count = 1;
  palpate_scene_touch(scene_.get(), &tool, 1, kTick, contacts(), memory_.size() * sizeof memory_[0]);
}

void PalpatePeer::shape() {
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = surface_.data(), out.node_capacity = push_.body.surface_count;
  palpate_scene_shape(scene_.get(), contacts(), &out);
}

void PalpatePeer::check_held(const Eigen::Vector3d& displacement) {
  const palpate_contact_node* node = palpate_contacts_node(contacts(), 0);
  const Eigen::Map<const Eigen::Vector3d> held(node->modified_displacement);
  if (contacts()->node_count != 1 || node->node != push_.node ||
      !((held - displacement).norm() < 1e-6 * displacement.norm()))
    throw VerificationError("palpate_scene_touch does not hold the pushed node at the push's displacement");
}

Answer PalpatePeer::answer() {
  return {Eigen::Map<const Eigen::VectorXf>(surface_.data(), static_cast<Eigen::Index>(surface_.size())).cast<double>(),
          -Eigen::Vector3d(palpate_contacts_tool(contacts(), 0)->force_raw)};
}

}  // namespace palpate::studies
