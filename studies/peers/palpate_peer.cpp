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
  bundle_ = Bundle::open_file(bundle.c_str(), &error);
  if (!bundle_) throw InputError(fmt::format("{}: {}", bundle.string(), error.text));
  const palpate_bundle_info info = bundle_.describe();
  if (info.node_count != static_cast<int>(push.body.nodes.size()) || info.surface_node_count != push.body.surface_count)
    throw InputError(
        fmt::format("{}: expected the bundle of this mesh, with {} nodes, found {}; precompute it with this mesh, "
                    "organ and boundary",
                    bundle.string(), push.body.nodes.size(), info.node_count));
  scene_ = Scene::create(bundle_, def, &error);
  if (!scene_) throw InputError(fmt::format("{}: {}", bundle.string(), error.text));
  contacts_ = scene_.make_contacts();
  surface_.resize(3 * static_cast<std::size_t>(info.surface_node_count));
}

double PalpatePeer::grip(std::int32_t node, const Eigen::Vector3d& displacement, Answer& out) {
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_NODE, grip.node = node;
  Eigen::Map<Eigen::Vector3d>(grip.displacement) = displacement;
  palpate_tool tool = palpate_default_tool();
  tool.grips = &grip, tool.grip_count = 1;
  const auto start = Clock::now();
  scene_.touch(&tool, 1, kTick, contacts_);
  shape();
  const double spent = seconds_since(start);
  out = answer();
  return spent;
}

void PalpatePeer::touch_point(const Eigen::Vector3d& point) {
  palpate_tool tool = palpate_default_tool();
  tool.points = point.data(), tool.point_count = 1;
  scene_.touch(&tool, 1, kTick, contacts_);
}

void PalpatePeer::shape() {
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = surface_.data(), out.node_capacity = push_.body.surface_count;
  scene_.shape(contacts_, out);
}

void PalpatePeer::check_held(const Eigen::Vector3d& displacement) {
  const palpate_contact_node& node = contacts_.node(0);
  const Eigen::Map<const Eigen::Vector3d> held(node.modified_displacement);
  if (contacts_->node_count != 1 || node.node != push_.node ||
      !((held - displacement).norm() < 1e-6 * displacement.norm()))
    throw VerificationError("palpate_scene_touch does not hold the pushed node at the push's displacement");
}

Answer PalpatePeer::answer() {
  return {Eigen::Map<const Eigen::VectorXf>(surface_.data(), static_cast<Eigen::Index>(surface_.size())).cast<double>(),
          -Eigen::Vector3d(contacts_.tool(0).force_raw)};
}

}  // namespace palpate::studies
