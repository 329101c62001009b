// The box bundle of tests/support in memory, open, with the dense stiffness it was solved from as the reference.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <span>

#include "tests/support/file_bytes.h"
#include "tests/support/open_bundle.h"
#include "tests/support/tiny_bundle.h"
#include "tests/support/tools.h"

namespace palpate::tests {

// A file name of this test alone, so that tests can run side by side.
std::filesystem::path scratch_file(const std::string& name);

std::string bundle_bytes(const BundleParts& parts);

// A body that was solved densely, its bundle open.
class TouchedBody {
 public:
  explicit TouchedBody(DenseBody dense, const std::function<void(BundleParts&)>& change = {});

  palpate_bundle* bundle() const { return bundle_.get(); }
  ScenePointer scene(const palpate_scene_def& def) const;

  Eigen::MatrixXd stiffness() const { return dense_stiffness(body.mesh, young_, poisson_); }
  Eigen::Index dofs() const { return 3 * static_cast<Eigen::Index>(body.mesh.nodes.size()); }
  Eigen::Vector3d node(std::int32_t n) const { return Eigen::Vector3d(body.mesh.nodes[n].data()); }
  Eigen::Vector3d place(std::int32_t triangle, Eigen::Vector3d k) const;
  Eigen::Vector3d outward(std::int32_t triangle) const;
  // A triangle that looks along +x, as those of the far face of a box, none of whose nodes is fixed.
  std::int32_t far_triangle(int which = 0) const;

  SurfaceFirst body;
  std::vector<std::uint8_t> fixed;
  std::vector<std::int32_t> touchable;

 private:
  double young_, poisson_;
  std::unique_ptr<AlignedBytes> bytes_;
  BundlePointer bundle_;
};

class TouchedBox : public TouchedBody {
 public:
  explicit TouchedBox(const TinyBox& form = {}, const std::function<void(BundleParts&)>& change = {})
      : TouchedBody(dense_box(form), change) {}
};

// That of the default form, for all tests of a program.
const TouchedBox& tiny_box();

// The place on a face of a box that looks along `outward` that is nearest to p: triangle and weights.
struct PlaceOnFace {
  std::int32_t triangle = -1;
  Eigen::Vector3d weights;
};
PlaceOnFace place_at(const TouchedBody& of, Eigen::Vector3d outward, Eigen::Vector3d p);

// Contacts and shape of a scene in memory of their own.
struct Contacts {
  explicit Contacts(const palpate_scene* scene) : memory(palpate_contacts_bytes(scene) / 8 + 1) {}
  palpate_contacts* get() { return reinterpret_cast<palpate_contacts*>(memory.data()); }
  palpate_contacts* operator->() { return get(); }
  const palpate_contacts* get() const { return reinterpret_cast<const palpate_contacts*>(memory.data()); }
  const palpate_contacts* operator->() const { return get(); }
  operator const palpate_contacts*() const { return get(); }
  std::size_t bytes() const { return memory.size() * sizeof memory[0]; }
  const palpate_contact_node* nodes() const { return palpate_contacts_node(get(), 0); }
  std::vector<std::uint64_t> memory;
};

std::vector<palpate_plan_pass> plan_of(const palpate_scene* scene);

palpate_grip grip_at_node(std::int32_t node, Eigen::Vector3d displacement, std::uint32_t axes = 7);
palpate_grip grip_at_place(std::int32_t triangle, Eigen::Vector3d k, Eigen::Vector3d displacement,
                           std::uint32_t axes = 7);
palpate_tool tool_of(const std::vector<palpate_grip>& grips);
// A tool for each point. The points are borrowed.
std::vector<palpate_tool> tools_of(std::span<const Eigen::Vector3d> points, double disc_radius = 0,
                                   double friction = 0);

inline constexpr palpate_contact_law kEveryLaw[] = {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL,
                                                    PALPATE_LAW_COULOMB};
inline constexpr palpate_contact_model kEveryContact[] = {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE,
                                                          PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH};

// Limits that no test reaches.
SceneDef unlimited_def();

// The type of a choice says which field it is of.
struct ChosenDef : SceneDef {
  void choose(palpate_collision value) { collision = value; }
  void choose(palpate_contact_model value) { contact = value; }
  void choose(palpate_contact_law value) { law = value; }
  void choose(palpate_force_model value) { force = value; }
  void choose(palpate_shape_model value) { shape = value; }
  void choose(palpate_radial_model value) { radial = value; }
  void choose(palpate_preload_model value) { preload = value; }
  void choose(palpate_report_model value) { report.report = value; }
  void choose(palpate_query_model value) { queries.queries = value; }
  void choose(palpate_dent_model value) { dent.dent = value; }
  void choose(palpate_inside_model value) { inside.inside = value; }
  void choose(palpate_deformation_model value) { large.deformation = value; }
  void choose(const palpate_relaxation_def& value) { relaxation = value; }
  void choose(const palpate_fine_surface& value) { fine_surface = value; }
  void choose(const palpate_render_mesh& value) { render_mesh = value; }
};
// A definition with choices of its own: with(SceneDef(), PALPATE_LAW_COULOMB, PALPATE_SHAPE_VOLUME).
template <class... Choices>
SceneDef with(const SceneDef& def, Choices... choices) {
  ChosenDef chosen{def};
  (chosen.choose(choices), ...);
  return chosen;
}
template <class... Choices>
SceneDef unlimited_def(Choices... choices) {
  return with(unlimited_def(), choices...);
}

// A definition with another limit of the work in a step.
SceneDef with_operations(SceneDef def, std::int64_t most);

std::vector<float> displacements(palpate_scene* scene, const palpate_contacts* contacts, std::int32_t nodes,
                                 palpate_step_flags* flags = nullptr);

// A scene of a body with memory for its contacts.
class TouchedScene {
 public:
  explicit TouchedScene(const TouchedBody& body, const palpate_scene_def& def = unlimited_def());

  // A step of 1 ms, if nothing else is said.
  palpate_step_flags touch(const std::vector<palpate_tool>& tools = {}, double dt = 1e-3) {
    return touch(tools.data(), static_cast<std::int32_t>(tools.size()), dt);
  }
  template <std::size_t count>
  palpate_step_flags touch(const palpate_tool (&tools)[count], double dt = 1e-3) {
    return touch(tools, static_cast<std::int32_t>(count), dt);
  }
  palpate_step_flags touch(const palpate_tool* tools, std::int32_t count, double dt = 1e-3);
  // A tool of one point.
  palpate_step_flags press(const Eigen::Vector3d& p, double disc_radius = 0, double friction = 0, double dt = 1e-3) {
    return touch({point_tool(p.data(), 1, disc_radius, friction)}, dt);
  }
  // One tool holds the grips.
  palpate_step_flags hold(const std::vector<palpate_grip>& grips, double disc_radius = 0);
  void reset() { palpate_scene_reset(scene.get()); }

  const palpate_tool_state& tool(std::int32_t index = 0) const;
  bool touches(std::int32_t index = 0) const { return tool(index).contact_count > 0; }
  // On a tool, before it is limited: N, N m.
  Eigen::Vector3d force(std::int32_t index = 0) const { return Eigen::Vector3d(tool(index).force_raw); }
  Eigen::Vector3d torque(std::int32_t index = 0) const { return Eigen::Vector3d(tool(index).torque_raw); }
  // The displacements of all nodes of the scene's shape.
  std::vector<float> shape(palpate_step_flags* into = nullptr) {
    return displacements(scene.get(), contacts, shape_nodes_, into);
  }
  // Whether the last step of another scene has left the same bytes.
  bool has_bytes_of(const TouchedScene& other) const;
  palpate_scene* get() const { return scene.get(); }

  ScenePointer scene;
  Contacts contacts;
  palpate_step_flags flags = 0;  // of the last step

 private:
  std::int32_t shape_nodes_;
};

}  // namespace palpate::tests
