#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {

std::function<void(BundleParts&)> with_large(bool nodal, double stiffening) {
  return [=](BundleParts& parts) {
    add_large_deformation(parts, {stiffening});
    if (nodal) parts.provenance.replace(parts.provenance.find("\"p1\""), 4, "\"p1-anp\"");
  };
}

palpate_scene_def large_def(palpate_contact_model contact) {
  palpate_scene_def def = unlimited_def();
  def.deformation = PALPATE_DEFORMATION_LARGE, def.contact = contact, def.collision = PALPATE_COLLISION_OFF;
  return def;
}

Seen::Seen(const TouchedBody& from, bool nodal, double stiffening, double poisson) {
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

}  // namespace palpate::tests
