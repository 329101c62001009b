#include "studies/hyperelastic/held_rows.h"

#include <utility>

#include "runtime/large/effect.h"

namespace palpate {
namespace {

// weights: [3N], of row r, times `factor`.
template <class Weights>
void add_row(const LargeContacts& all, std::int32_t r, double factor, Weights weights) {
  const auto add = [&](std::int32_t first, std::int32_t count, const auto& direction) {
    for (std::int32_t e = first; e < first + count; ++e)
      for (int d = 0; d < 3; ++d) weights[3 * all.nodes[e] + d] += factor * all.weights[e] * direction[d];
  };
  add(all.rows[r].first, all.rows[r].count, all.rows[r].direction);
  for (std::int32_t k = 0; k < all.join_count; ++k)
    if (all.joins[k].row == r) add(all.joins[k].first, all.joins[k].count, all.joins[k].direction);
}

}  // namespace

HeldRows held_rows(const DeformingBody& body, std::int32_t node_count) {
  const LargeContacts all = body.last_rows();
  std::vector<std::int32_t> held;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * node_count);
  for (std::int32_t r = 0; r < all.row_count; ++r) {
    if (body.solver().holds(r))
      held.push_back(r);
    else if (const double force = body.row_forces()[r]; force != 0)
      add_row(all, r, force, load.head(load.size()));
  }
  const auto count = static_cast<Eigen::Index>(held.size());
  HeldRows rows{Eigen::MatrixXd::Zero(count, 3 * node_count), Eigen::MatrixXd::Zero(count, count),
                Eigen::VectorXd(count), Eigen::VectorXd(count), std::move(load)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::int32_t r = held[static_cast<std::size_t>(i)];
    const LargeRow& row = all.rows[r];
    add_row(all, r, 1, rows.weights.row(i));
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
