// Bodies and scenes for the tests of large deformation through the C API.
#pragma once

#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {

inline std::function<void(BundleParts&)> with_large(bool nodal, double stiffening = 0) {
  return [=](BundleParts& parts) {
    add_large_deformation(parts, {stiffening});
    if (nodal) parts.provenance.replace(parts.provenance.find("\"p1\""), 4, "\"p1-anp\"");
  };
}

inline palpate_scene_def large_def(palpate_contact_model contact) {
  palpate_scene_def def = unlimited_def();
  def.deformation = PALPATE_DEFORMATION_LARGE, def.contact = contact, def.collision = PALPATE_COLLISION_OFF;
  return def;
}

// A body of one region, seen as a HyperelasticBody.
struct Seen {
  Seen(const TouchedBody& from, bool nodal, double stiffening, double poisson = 0.45) {
    for (const auto& n : from.body.mesh.nodes) nodes.insert(nodes.end(), n.begin(), n.end());
    for (const auto& t : from.body.mesh.tetrahedra) tetrahedra.insert(tetrahedra.end(), t.begin(), t.end());
    region.assign(from.body.mesh.tetrahedra.size(), 0);
    fixed = from.fixed;
    const double young = 5400;
    law = {young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson)), stiffening};
    body = {nodes.data(),
            tetrahedra.data(),
            region.data(),
            fixed.data(),
            &law,
            static_cast<std::int32_t>(nodes.size() / 3),
            static_cast<std::int32_t>(region.size()),
            1,
            nodal};
  }
  std::vector<double> nodes;
  std::vector<std::int32_t> tetrahedra, region;
  std::vector<std::uint8_t> fixed;
  TissueLaw law;
  HyperelasticBody body;
};

// The box of TouchedBox, whose tensors are those of the tangent at rest.
inline TouchedBody large_body(bool nodal, const std::function<void(BundleParts&)>& change = {}) {
  DenseBody dense = dense_box({});
  const TouchedBox plain;
  const Seen seen(plain, nodal, 0);
  const LargeReference reference(seen.body);
  dense.stiffness = Eigen::MatrixXd(reference.tangent(Eigen::VectorXd::Zero(reference.dofs())));
  return TouchedBody(dense, [&](BundleParts& parts) {
    with_large(nodal)(parts);
    if (change) change(parts);
  });
}

}  // namespace palpate::tests
