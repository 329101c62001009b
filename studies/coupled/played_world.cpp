#include "studies/coupled/played_world.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <cmath>

#include "formats/errors.h"

namespace palpate::studies {

Bundle open_bundle(const std::filesystem::path& file) {
  palpate_error error = {};
  Bundle bundle = Bundle::open_file(file.c_str(), &error);
  if (!bundle) throw InputError(fmt::format("{}: {}", file.string(), error.text));
  return bundle;
}

SceneDef free_scene() {
  SceneDef def;
  def.force_limit = def.force_slew = def.torque_limit = def.torque_slew = def.max_tool_speed = def.release_distance =
      INFINITY;
  def.max_operations = 100'000'000, def.max_points = 256, def.max_tools = 2;
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_POINT;
  return def;
}

SceneDef touching_scene() {
  SceneDef def = free_scene();
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_UNILATERAL;
  return def;
}

palpate_pose pose_at(const Eigen::Vector3d& position) {
  palpate_pose pose = palpate_default_pose();
  Eigen::Map<Eigen::Vector3d>(pose.position) = position;
  return pose;
}

PlayedWorld::PlayedWorld(const std::vector<OrganAt>& organs, const SceneDef& scene, int max_pairs, int max_links) {
  std::vector<palpate_world_organ> list(organs.size(), palpate_default_world_organ());
  for (std::size_t k = 0; k < organs.size(); ++k)
    list[k].bundle = organs[k].bundle, list[k].def = &scene, list[k].pose = &organs[k].pose;
  for (const OrganAt& organ : organs)
    surface_nodes_.push_back(palpate_bundle_describe(organ.bundle).surface_node_count);
  palpate_world_def def = palpate_default_world_def();
  def.organs = list.data(), def.organ_count = static_cast<int>(list.size());
  def.force_limit = def.force_slew = def.torque_limit = def.torque_slew = INFINITY;
  def.max_pairs = max_pairs, def.max_links = max_links;
  palpate_error error = {};
  world_ = World::create(def, &error);
  if (!world_) throw OperationError(error.text);
  contacts_ = world_.make_contacts();
}

palpate_step_flags PlayedWorld::touch(const std::vector<palpate_tool>& tools) {
  return world_.touch(tools.data(), static_cast<int>(tools.size()), 1e-3, contacts_);
}

void PlayedWorld::place(int organ, const palpate_pose& pose) {
  world_.set_pose(organ, pose);
}

void PlayedWorld::set_links(const std::vector<palpate_world_link>& links) {
  palpate_error error = {};
  if (world_.set_links(links.data(), static_cast<int>(links.size()), &error) != PALPATE_OK)
    throw OperationError(error.text);
}

Eigen::Vector3d PlayedWorld::on_tool(int tool) const {
  return Eigen::Vector3d(contacts_.tool(tool).force_raw);
}

Eigen::Vector3d PlayedWorld::torque_on_tool(int tool) const {
  return Eigen::Vector3d(contacts_.tool(tool).torque_raw);
}

std::vector<const palpate_world_pair*> PlayedWorld::pairs() const {
  std::vector<const palpate_world_pair*> pairs;
  for (int i = 0; i < contacts_->pair_count; ++i) pairs.push_back(&contacts_.pair(i));
  return pairs;
}

int PlayedWorld::pressing() const {
  int count = 0;
  for (const palpate_world_pair* pair : pairs()) count += pair->pressure > 0;
  return count;
}

Eigen::VectorXd PlayedWorld::shape(int organ) const {
  const int nodes = surface_nodes_[static_cast<std::size_t>(organ)];
  std::vector<float> u(3 * static_cast<std::size_t>(nodes));
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = u.data(), out.node_capacity = nodes;
  palpate_scene_shape(scene(organ), &contacts_.organ(organ), &out);
  return Eigen::Map<const Eigen::VectorXf>(u.data(), static_cast<Eigen::Index>(u.size())).cast<double>();
}

Eigen::Matrix3d turn_of(const palpate_pose& pose) {
  return Eigen::Quaterniond(pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3])
      .toRotationMatrix();
}

Row row_of_pair(const palpate_world_pair& pair, const std::array<std::int32_t, 3>& corners,
                const std::vector<palpate_pose>& poses, const std::vector<Eigen::VectorXd>& shapes) {
  const auto own = static_cast<std::size_t>(pair.organ[0]), other = static_cast<std::size_t>(pair.organ[1]);
  const Eigen::Vector3d normal(pair.normal), along = -turn_of(poses[other]).transpose() * normal;
  Row row;
  row.add(own, pair.node, turn_of(poses[own]).transpose() * normal);
  for (std::size_t v = 0; v < 3; ++v) row.add(other, corners[v], pair.barycentric[v] * along);
  row.target = -pair.gap, row.only_pushes = true;
  for (const Row::Term& term : row.terms) row.target += term.weight * shapes[term.body][term.dof];
  return row;
}

}  // namespace palpate::studies
