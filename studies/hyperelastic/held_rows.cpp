#include "studies/hyperelastic/held_rows.h"

#include "runtime/large/effect.h"

namespace palpate {

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

HeldRows held_rows(const palpate_scene& scene, std::int32_t node_count) {
  return held_rows(deforming_body_of(scene), node_count);
}

}  // namespace palpate
