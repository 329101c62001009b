#include "tests/precompute/support.h"
#include "tests/support/texts.h"

namespace palpate::tests {

BlockMatrix assemble_stiffness(const ElasticBody& body, Element element) {
  return discretise(body, element).stiffness;
}

Eigen::MatrixXd dense(const BlockMatrix& k) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * k.rows, 3 * k.rows);
  for (std::int32_t row = 0; row < k.rows; ++row)
    for (auto at = k.first[row]; at < k.first[row + 1]; ++at)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) result(3 * row + i, 3 * k.column[at] + j) = k.block[at][3 * i + j];
  return result;
}

std::vector<Eigen::Index> free_dofs(const ElasticBody& body) {
  std::vector<Eigen::Index> result;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (!body.fixed[n][d]) result.push_back(static_cast<Eigen::Index>(3 * n) + d);
  return result;
}

std::string refusal(const ElasticBody& body) {
  return input_error([&] { check_support(body, "bc.toml"); });
}

}  // namespace palpate::tests
