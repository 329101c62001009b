// An ElasticBody seen as a HyperelasticBody.
#pragma once

#include <vector>

#include "precompute/elements/discretisation.h"
#include "precompute/elements/linear_tetrahedra.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate {

class LargeBody {
 public:
  // forms: of the laws of the first regions, the others are neo-Hookean.
  // averaged_shear: of p1-ang, as HyperelasticBody has it.
  LargeBody(ElasticBody elastic, bool nodal_dilatation, std::vector<LawForm> forms = {}, double averaged_shear = 0)
      : elastic_(std::move(elastic)) {
    for (std::size_t r = 0; r < elastic_.materials.size(); ++r) {
      const Moduli moduli = moduli_of(elastic_.materials[r]);
      laws_.push_back({moduli.shear, moduli.bulk, r < forms.size() ? forms[r] : LawForm()});
    }
    body_.nodes = elastic_.nodes[0].data(), body_.tetrahedra = elastic_.tetrahedra[0].data();
    body_.region = elastic_.region.data(), body_.fixed = elastic_.fixed[0].data(), body_.laws = laws_.data();
    body_.node_count = static_cast<std::int32_t>(elastic_.nodes.size());
    body_.tetrahedron_count = static_cast<std::int32_t>(elastic_.tetrahedra.size());
    body_.region_count = static_cast<std::int32_t>(laws_.size());
    body_.nodal_dilatation = nodal_dilatation, body_.averaged_shear = averaged_shear;
    supports_ = support_stiffness(elastic_);
    body_.support_count = static_cast<std::int32_t>(supports_.nodes.size());
    if (body_.support_count > 0)
      body_.support_nodes = supports_.nodes[0].data(), body_.support_stiffness = supports_.block[0].data();
  }
  LargeBody(ElasticBody elastic, Element element, std::vector<LawForm> forms = {})
      : LargeBody(std::move(elastic), element != Element::p1, std::move(forms), averaged_shear_of(element)) {}
  LargeBody(const LargeBody&) = delete;
  LargeBody& operator=(const LargeBody&) = delete;
  const HyperelasticBody& get() const { return body_; }
  const ElasticBody& elastic() const { return elastic_; }

 private:
  ElasticBody elastic_;
  std::vector<TissueLaw> laws_;
  SupportStiffness supports_;
  HyperelasticBody body_;
};

}  // namespace palpate
