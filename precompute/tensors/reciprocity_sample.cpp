#include "precompute/tensors/reciprocity_sample.h"

#include <algorithm>
#include <cmath>

namespace palpate {

ReciprocitySample::ReciprocitySample(const ElasticBody& body) : body_(body) {
  const std::size_t count = std::min<std::size_t>(48, body.touchable.size());
  for (std::size_t i = 0; i < count; ++i) nodes_.push_back(body.touchable[i * body.touchable.size() / count]);
  compliance_.assign(9 * count * count, 0.0);
}

int ReciprocitySample::index_of(std::int32_t node) const {
  const auto at = std::lower_bound(nodes_.begin(), nodes_.end(), node);
  return at != nodes_.end() && *at == node ? static_cast<int>(at - nodes_.begin()) : -1;
}

void ReciprocitySample::take(int k, std::span<const double> column) {
  std::copy(column.begin(), column.end(), compliance_.begin() + static_cast<std::ptrdiff_t>(9 * nodes_.size()) * k);
}

ReciprocitySample::Result ReciprocitySample::compare_far_pairs() const {
  Result result;
  double farthest = 0;
  for (std::size_t a = 0; a < nodes_.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) farthest = std::max(farthest, distance(a, b));
  for (std::size_t a = 0; a < nodes_.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (distance(a, b) < 0.5 * farthest) continue;
      const double* c_ab = &compliance_[9 * (b * nodes_.size() + a)];
      const double* c_ba = &compliance_[9 * (a * nodes_.size() + b)];
      double difference = 0, size = 0;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          // C_ab(i, j) = C_ba(j, i) where both dofs are free
          if (body_.fixed[nodes_[a]][i] || body_.fixed[nodes_[b]][j]) continue;
          const double ab = c_ab[3 * i + j], ba = c_ba[3 * j + i];
          difference += (ab - ba) * (ab - ba), size += ab * ab;
        }
      if (size > 0) result.error = std::max(result.error, std::sqrt(difference / size));
      ++result.pairs;
    }
  return result;
}

double ReciprocitySample::distance(std::size_t a, std::size_t b) const {
  const auto &p = body_.nodes[nodes_[a]], &q = body_.nodes[nodes_[b]];
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

}  // namespace palpate
