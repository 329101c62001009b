// Bodies and scenes for the tests of large deformation through the C API.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "studies/hyperelastic/held_rows.h"
#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {

std::function<void(BundleParts&)> with_large(bool nodal, const LawForm& form = {});

// "b 3", "Yeoh -300 400", "Ogden 4.5 0 2".
std::string words_of(const LawForm& form);

SceneDef large_def(palpate_contact_model contact);

// A body of one region, seen as a HyperelasticBody.
struct Seen {
  Seen(const TouchedBody& from, bool nodal, const LawForm& form, double poisson = 0.45);
  std::vector<double> nodes;
  std::vector<std::int32_t> tetrahedra, region;
  std::vector<std::uint8_t> fixed;
  TissueLaw law;
  HyperelasticBody body;
};

// A scene whose thread solves each step to its end before the next one. The shape has all nodes.
struct SolvedScene : TouchedScene {
  using TouchedScene::TouchedScene;
  palpate_step_flags step(const std::vector<palpate_tool>& tools = {}) {
    const palpate_step_flags raised = touch(tools);
    for (int i = 0; i < 20 && palpate_scene_deform(get()) > 0;) ++i;
    return raised;
  }
  Eigen::VectorXd field() {
    const std::vector<float> u = shape();
    return Eigen::Map<const Eigen::VectorXf>(u.data(), static_cast<Eigen::Index>(u.size())).cast<double>();
  }
};

// The rows that hold a node along x, y and z, for Newton's method: [3][3N].
inline Eigen::MatrixXd rows_of_node(const TouchedBody& on, std::int32_t node) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, on.dofs());
  for (int i = 0; i < 3; ++i) rows(i, 3 * node + i) = 1;
  return rows;
}

// The box of TouchedBox, or another one, whose tensors are those of the tangent at rest.
inline TouchedBody large_body(bool nodal, const std::function<void(BundleParts&)>& change = {},
                              const TinyBox& form = {}) {
  DenseBody dense = dense_box(form);
  const TouchedBox plain(form);
  const Seen seen(plain, nodal, 0);
  const LargeReference reference(seen.body);
  dense.stiffness = Eigen::MatrixXd(reference.tangent(Eigen::VectorXd::Zero(reference.dofs())));
  return TouchedBody(dense, [&](BundleParts& parts) {
    with_large(nodal)(parts);
    if (change) change(parts);
  });
}

}  // namespace palpate::tests
