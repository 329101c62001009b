#include <palpate/palpate.hpp>

#include "studies/paper/paper_measurements.h"

namespace palpate::studies {
namespace {

using Point = Eigen::Map<const Eigen::Vector3d>;

std::int32_t nearest_touchable(const Bundle& bundle, const Eigen::Vector3d& point) {
  const palpate_bundle_info info = bundle.describe();
  const auto distance = [&](std::int32_t n) { return (Point(bundle.nodes() + 3 * n) - point).norm(); };
  return *std::min_element(bundle.touchable(), bundle.touchable() + info.touchable_count,
                           [&](auto a, auto b) { return distance(a) < distance(b); });
}

// The surface's displacement with these grips held, [3 Ns] m.
Eigen::VectorXd held(Scene& scene, Contacts& contacts, const std::vector<palpate_grip>& grips, std::int32_t nodes) {
  scene.reset();
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips.data(), tool.grip_count = static_cast<std::int32_t>(grips.size());
  Eigen::VectorXf u(3 * nodes);
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = u.data(), out.node_capacity = nodes;
  scene.touch(&tool, 1, 1e-3, contacts);
  scene.shape(contacts, out);
  return u.cast<double>();
}

}  // namespace

Json measure_superposition(const std::string& file, const std::vector<Eigen::Vector3d>& points,
                           const Eigen::Vector3d& displacement) {
  const Bundle bundle(file.c_str());
  SceneDef def;
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE;
  Scene scene(bundle, def);
  Contacts contacts = scene.make_contacts();
  const std::int32_t nodes = bundle.describe().surface_node_count;
  std::vector<palpate_grip> grips(points.size());
  Eigen::VectorXd naive = Eigen::VectorXd::Zero(3 * nodes);
  for (std::size_t p = 0; p < points.size(); ++p) {
    grips[p] = palpate_default_grip();
    grips[p].kind = PALPATE_GRIP_NODE, grips[p].node = nearest_touchable(bundle, points[p]);
    Eigen::Map<Eigen::Vector3d>(grips[p].displacement) = displacement;
    naive += held(scene, contacts, {grips[p]}, nodes);
  }
  const Eigen::VectorXd modified = held(scene, contacts, grips, nodes);
  Json result = {{"imposed", {displacement.x(), displacement.y(), displacement.z()}}, {"contacts", Json::array()}};
  for (const auto& grip : grips) result["contacts"].push_back(grip.node);
  for (const auto& [name, u] : {std::pair<const char*, const Eigen::VectorXd&>("naive", naive), {"modified", modified}})
    result[name] = std::vector<double>(u.begin(), u.end());
  result["rest"] = std::vector<double>(bundle.nodes(), bundle.nodes() + 3 * nodes);
  return result;
}

}  // namespace palpate::studies
