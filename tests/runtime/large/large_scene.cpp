#include "tests/runtime/large/large_scene.h"

#include <fmt/format.h>

namespace palpate::tests {

std::function<void(BundleParts&)> with_large(bool nodal, const LawForm& form) {
  return [=](BundleParts& parts) {
    add_large_deformation(parts, {form.constant[0]});
    if (const int law = form.kind == LawForm::Kind::yeoh ? 1 : form.kind == LawForm::Kind::ogden ? 2 : 0; law > 0) {
      const double* const c = form.constant;
      parts.set(formats::SectionId::large_stiffening, {1}, std::vector<double>{formats::kNoStiffening});
      parts.set(formats::SectionId::large_law, {1, 4}, std::vector<double>{double(law), c[0], c[1], c[2]});
    }
    if (nodal) parts.provenance.replace(parts.provenance.find("\"p1\""), 4, "\"p1-anp\"");
  };
}

std::string words_of(const LawForm& form) {
  const double* const c = form.constant;
  if (form.kind == LawForm::Kind::yeoh) return fmt::format("Yeoh {:g} {:g}", c[0], c[1]);
  if (form.kind == LawForm::Kind::ogden) return fmt::format("Ogden {:g} {:g} {:g}", c[0], c[1], c[2]);
  return fmt::format("b {:g}", c[0]);
}

SceneDef large_def(palpate_contact_model contact) {
  SceneDef def = unlimited_def();
  def.large.deformation = PALPATE_DEFORMATION_LARGE, def.contact = contact, def.collision = PALPATE_COLLISION_OFF;
  return def;
}

Seen::Seen(const TouchedBody& from, bool nodal, const LawForm& form, double poisson) {
  for (const auto& n : from.body.mesh.nodes) nodes.insert(nodes.end(), n.begin(), n.end());
  for (const auto& t : from.body.mesh.tetrahedra) tetrahedra.insert(tetrahedra.end(), t.begin(), t.end());
  region.assign(from.body.mesh.tetrahedra.size(), 0);
  fixed = from.fixed;
  const double young = 5400;
  law = {young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson)), form};
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
