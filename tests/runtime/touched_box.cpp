#include "tests/runtime/touched_box.h"

#include <unistd.h>

#include "tests/support/test_files.h"

namespace palpate::tests {

std::filesystem::path scratch_file(const std::string& name) {
  if (testing::UnitTest::GetInstance()->current_test_info()) return scratch(name);
  // Of a program, which may run twice at a time.
  return std::filesystem::path(testing::TempDir()) / (std::to_string(::getpid()) + "." + name);
}

std::string bundle_bytes(const BundleParts& parts) {
  const auto file = scratch_file("bundle.h5");
  write_bundle(file, parts);
  const std::string bytes = file_bytes(file);
  std::filesystem::remove(file);
  return bytes;
}

TouchedBody::TouchedBody(DenseBody dense, const std::function<void(BundleParts&)>& change)
    : body(std::move(dense.body)), young_(dense.young), poisson_(dense.poisson) {
  dense.body = body;
  BundleParts parts = dense_bundle(dense);
  if (change) change(parts);
  fixed = parts.get<std::uint8_t>(formats::SectionId::fixed);
  touchable = parts.get<std::int32_t>(formats::SectionId::touchable);
  bytes_ = std::make_unique<AlignedBytes>(bundle_bytes(parts));
  palpate_bundle* opened = nullptr;
  palpate_error error = {};
  const palpate_status status = palpate_bundle_open(bytes_->data(), bytes_->size(), nullptr, &opened, &error);
  if (status != PALPATE_OK) throw std::runtime_error(error.text);
  bundle_.reset(opened);
}

ScenePointer TouchedBody::scene(const palpate_scene_def& def) const {
  palpate_scene* created = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(bundle_.get(), &def, &created, &error) != PALPATE_OK) throw std::runtime_error(error.text);
  return ScenePointer(created);
}

Eigen::Vector3d TouchedBody::place(std::int32_t triangle, Eigen::Vector3d k) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int v = 0; v < 3; ++v) sum += k[v] * node(body.triangles[triangle][v]);
  return sum;
}

Eigen::Vector3d TouchedBody::outward(std::int32_t triangle) const {
  const auto& t = body.triangles[triangle];
  return (node(t[1]) - node(t[0])).cross(node(t[2]) - node(t[0])).normalized();
}

std::int32_t TouchedBody::far_triangle(int which) const {
  for (std::size_t t = 0; t < body.triangles.size(); ++t)
    if (outward(static_cast<std::int32_t>(t))[0] > 0.99 && which-- == 0) return static_cast<std::int32_t>(t);
  throw std::logic_error("no such triangle");
}

const TouchedBox& tiny_box() {
  static const TouchedBox shared;
  return shared;
}

PlaceOnFace place_at(const TouchedBody& of, Eigen::Vector3d outward, Eigen::Vector3d p) {
  for (std::size_t t = 0; t < of.body.triangles.size(); ++t) {
    const auto triangle = static_cast<std::int32_t>(t);
    if (of.outward(triangle).dot(outward) < 0.99) continue;
    // The last row makes the weights one for a face through the origin, too.
    Eigen::Matrix<double, 4, 3> corners = Eigen::Matrix<double, 4, 3>::Ones();
    for (int v = 0; v < 3; ++v) corners.col(v).head<3>() = of.node(of.body.triangles[t][v]);
    Eigen::Vector3d k = corners.colPivHouseholderQr().solve(Eigen::Vector4d(p[0], p[1], p[2], 1));
    if (k.minCoeff() < -1e-9) continue;
    k = k.cwiseMax(0);
    return {triangle, k / k.sum()};
  }
  throw std::logic_error("no such place");
}

std::vector<palpate_plan_pass> plan_of(const palpate_scene* scene) {
  std::vector<palpate_plan_pass> plan;
  while (const palpate_plan_pass* pass = palpate_scene_plan(scene, static_cast<std::int32_t>(plan.size())))
    plan.push_back(*pass);
  return plan;
}

palpate_grip grip_at_node(std::int32_t node, Eigen::Vector3d displacement, std::uint32_t axes) {
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_NODE, grip.node = node, grip.axes = axes;
  Eigen::Map<Eigen::Vector3d>(grip.displacement) = displacement;
  return grip;
}

palpate_grip grip_at_place(std::int32_t triangle, Eigen::Vector3d k, Eigen::Vector3d displacement, std::uint32_t axes) {
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = triangle, grip.axes = axes;
  Eigen::Map<Eigen::Vector3d>(grip.barycentric) = k;
  Eigen::Map<Eigen::Vector3d>(grip.displacement) = displacement;
  return grip;
}

palpate_tool tool_of(const std::vector<palpate_grip>& grips) {
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips.data(), tool.grip_count = static_cast<std::int32_t>(grips.size());
  return tool;
}

std::vector<palpate_tool> tools_of(std::span<const Eigen::Vector3d> points, double disc_radius, double friction) {
  std::vector<palpate_tool> tools;
  for (const Eigen::Vector3d& p : points) tools.push_back(point_tool(p.data(), 1, disc_radius, friction));
  return tools;
}

SceneDef unlimited_def() {
  SceneDef def;
  def.force_limit = def.force_slew = def.max_tool_speed = def.release_distance = INFINITY;
  def.max_operations = INT64_MAX;  // more than a step of any test takes
  return def;
}

SceneDef with_operations(SceneDef def, std::int64_t most) {
  def.max_operations = most;
  return def;
}

std::vector<float> displacements(palpate_scene* scene, const palpate_contacts* contacts, std::int32_t nodes,
                                 palpate_step_flags* flags) {
  std::vector<float> u(3 * nodes, NAN);
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = u.data(), out.node_capacity = nodes;
  const palpate_step_flags raised = palpate_scene_shape(scene, contacts, &out);
  if (flags) *flags = raised;
  EXPECT_EQ(out.node_count, nodes);
  return u;
}

TouchedScene::TouchedScene(const TouchedBody& body, const palpate_scene_def& def)
    : scene(body.scene(def)),
      contacts(scene.get()),
      shape_nodes_(def.shape == PALPATE_SHAPE_VOLUME ? static_cast<std::int32_t>(body.dofs() / 3)
                                                     : body.body.surface_nodes) {}

palpate_step_flags TouchedScene::touch(const palpate_tool* tools, std::int32_t count, double dt) {
  return flags = palpate_scene_touch(scene.get(), tools, count, dt, contacts.get(), contacts.bytes());
}

palpate_step_flags TouchedScene::hold(const std::vector<palpate_grip>& grips, double disc_radius) {
  palpate_tool tool = tool_of(grips);
  tool.disc_radius = disc_radius;
  return touch(&tool, 1);
}

const palpate_tool_state& TouchedScene::tool(std::int32_t index) const {
  return *palpate_contacts_tool(contacts, index);
}

bool TouchedScene::has_bytes_of(const TouchedScene& other) const {
  return contacts->used_bytes == other.contacts->used_bytes &&
         std::memcmp(contacts.get(), other.contacts.get(), contacts->used_bytes) == 0;
}

}  // namespace palpate::tests
