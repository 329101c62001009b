#include "precompute/elements/pressure_form.h"

#include <algorithm>

#include "precompute/elements/linear_tetrahedra.h"
#include "precompute/elements/supports.h"

namespace palpate {
namespace {

// The terms of B^T B: those that have a pressure, and those that are added to A.
struct Parts {
  std::vector<std::int32_t> with_pressure;  // [rows of K]: a term
  Dilatations in_a;                         // their nodes without held ones
};

Parts divide(const Dilatations& terms, const HeldStiffness& held) {
  Parts parts;
  parts.with_pressure.assign(held.node_of_row.size(), -1);
  for (std::size_t t = 0; t < terms.nodes.size(); ++t) {
    const auto row = held.row_of_node[terms.centre[t]];
    if (row < 0) continue;
    auto& chosen = parts.with_pressure[row];
    if (chosen < 0 || terms.nodes[t].size() > terms.nodes[chosen].size()) chosen = static_cast<std::int32_t>(t);
  }
  std::vector<std::int32_t> nodes;
  for (std::size_t t = 0; t < terms.nodes.size(); ++t) {
    const auto row = held.row_of_node[terms.centre[t]];
    if (row >= 0 && parts.with_pressure[row] == static_cast<std::int32_t>(t)) continue;
    nodes.clear();
    for (auto at = terms.nodes.first[t]; at < terms.nodes.first[t + 1]; ++at)
      if (held.row_of_node[terms.nodes.item[at]] >= 0) {
        nodes.push_back(terms.nodes.item[at]);
        parts.in_a.factor.push_back(terms.factor[at]);
      }
    if (nodes.empty()) continue;
    parts.in_a.nodes.append(nodes);
    parts.in_a.centre.push_back(terms.centre[t]);
  }
  return parts;
}

// A over all nodes, nothing held.
BlockMatrix stiffness_without_pressure(const ElasticBody& body, const Dilatations& in_a) {
  Lists coupled = in_a.nodes;
  for (const auto& t : body.tetrahedra) coupled.append(t);
  BlockMatrix a = coupled_blocks(coupled, static_cast<std::int32_t>(body.nodes.size()));
  add_deviatoric_stiffness(body, a);
  add_dilatations(in_a, a);
  add_supports(body, a);
  return a;
}

}  // namespace

PressureForm pressure_form(const ElasticBody& body, const HeldStiffness& held) {
  const Dilatations terms = nodal_dilatations(body);
  const Parts parts = divide(terms, held);
  const HeldStiffness a = remove_held_dofs(stiffness_without_pressure(body, parts.in_a), body.fixed);
  PressureForm form;
  form.rows = a.matrix.rows;
  form.first = a.matrix.first;
  form.column = a.matrix.column;
  form.block.assign(form.column.size(), {});
  for (std::int32_t row = 0; row < form.rows; ++row)
    for (auto at = form.first[row]; at < form.first[row + 1]; ++at)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) form.block[at][4 * i + j] = a.matrix.block[at][3 * i + j];
  for (std::int32_t row = 0; row < form.rows; ++row) {
    const auto node = a.node_of_row[row];
    const auto own = index_of_block(held.matrix, row, row), diagonal = index_of_block(form, row, row);
    for (int d = 0; d < 3; ++d)  // a held dof: the row of K
      if (body.fixed[node][d]) form.block[diagonal][5 * d] = held.matrix.block[own][4 * d];
    form.block[diagonal][15] = -1;
    const auto term = parts.with_pressure[row];
    for (auto at = terms.nodes.first[term]; at < terms.nodes.first[term + 1]; ++at) {
      const auto other = a.row_of_node[terms.nodes.item[at]];
      if (other < 0) continue;
      auto& below = form.block[index_of_block(form, row, other)];
      auto& right = form.block[index_of_block(form, other, row)];
      for (int d = 0; d < 3; ++d)
        if (!body.fixed[terms.nodes.item[at]][d]) below[12 + d] = right[4 * d + 3] = terms.factor[at][d];
    }
  }
  return form;
}

}  // namespace palpate
