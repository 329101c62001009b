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

HeldRows held_rows(const DeformingBody& body, std::int32_t node_count) {
  const LargeContacts all = body.last_rows();
  std::vector<std::int32_t> held;
  for (std::int32_t r = 0; r < all.row_count; ++r)
    if (body.solver().holds(r)) held.push_back(r);
  const auto count = static_cast<Eigen::Index>(held.size());
  HeldRows rows{Eigen::MatrixXd::Zero(count, 3 * node_count), Eigen::MatrixXd::Zero(count, count),
                Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::int32_t r = held[static_cast<std::size_t>(i)];
    const LargeRow& row = all.rows[r];
    for (std::int32_t e = row.first; e < row.first + row.count; ++e)
      for (int d = 0; d < 3; ++d) rows.weights(i, 3 * all.nodes[e] + d) += all.weights[e] * row.direction[d];
    for (std::int32_t k = 0; k < all.join_count; ++k) {
      const LargeJoin& join = all.joins[k];
      for (std::int32_t e = join.first; e < join.first + join.count && join.row == r; ++e)
        for (int d = 0; d < 3; ++d) rows.weights(i, 3 * all.nodes[e] + d) += all.weights[e] * join.direction[d];
    }
    for (Eigen::Index j = 0; j < count; ++j) {
      const std::int32_t column = held[static_cast<std::size_t>(j)], other = column - row.group;
      if (all.rows[column].group == row.group) rows.compliance(i, j) = row.compliance[other];
      if (all.beside)
        rows.compliance(i, j) +=
            all.beside[static_cast<std::size_t>(r) * all.beside_stride + static_cast<std::size_t>(column)];
    }
    rows.place[i] = body.place(r), rows.carried[i] = body.row_forces()[r];
  }
  return rows;
}

}  // namespace palpate::tests
