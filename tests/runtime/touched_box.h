// The box bundle of tests/support in memory, open, with the dense stiffness it was solved from as the reference.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <memory>

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
  operator const palpate_contacts*() { return get(); }
  std::size_t bytes() const { return memory.size() * sizeof memory[0]; }
  const palpate_contact_node* nodes() { return palpate_contacts_node(get(), 0); }
  std::vector<std::uint64_t> memory;
};

std::vector<palpate_plan_pass> plan_of(const palpate_scene* scene);

palpate_grip grip_at_node(std::int32_t node, Eigen::Vector3d displacement, std::uint32_t axes = 7);
palpate_grip grip_at_place(std::int32_t triangle, Eigen::Vector3d k, Eigen::Vector3d displacement,
                           std::uint32_t axes = 7);
palpate_tool tool_of(const std::vector<palpate_grip>& grips);

SceneDef unlimited_def();

std::vector<float> displacements(palpate_scene* scene, const palpate_contacts* contacts, std::int32_t nodes,
                                 palpate_step_flags* flags = nullptr);

}  // namespace palpate::tests
