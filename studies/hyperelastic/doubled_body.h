// Two copies of a body as one, each with its own nodes: what a solution of two organs is made of.
#pragma once

#include <vector>

#include "runtime/large/hyperelastic_body.h"

namespace palpate {

class DoubledBody {
 public:
  explicit DoubledBody(const HyperelasticBody& one) : body_(one) {
    const auto nodes = 3 * static_cast<std::size_t>(one.node_count);
    twice(one.nodes, nodes, 0.0, &nodes_), twice(one.fixed, nodes, std::uint8_t{0}, &fixed_);
    twice(one.tetrahedra, 4 * static_cast<std::size_t>(one.tetrahedron_count), one.node_count, &tetrahedra_);
    twice(one.region, static_cast<std::size_t>(one.tetrahedron_count), 0, &region_);
    const auto supports = static_cast<std::size_t>(one.support_count);
    twice(one.support_nodes, 2 * supports, one.node_count, &support_nodes_);
    twice(one.support_stiffness, 9 * supports, 0.0, &support_stiffness_);
    body_.nodes = nodes_.data(), body_.fixed = fixed_.data(), body_.tetrahedra = tetrahedra_.data();
    body_.region = region_.data(), body_.support_nodes = support_nodes_.data();
    body_.support_stiffness = support_stiffness_.data();
    body_.node_count *= 2, body_.tetrahedron_count *= 2, body_.support_count *= 2;
  }
  DoubledBody(const DoubledBody&) = delete;
  DoubledBody& operator=(const DoubledBody&) = delete;
  const HyperelasticBody& get() const { return body_; }

 private:
  // The second copy's numbers are larger by `more`.
  template <class T>
  static void twice(const T* from, std::size_t count, T more, std::vector<T>* to) {
    for (const T add : {T{0}, more})
      for (std::size_t i = 0; i < count; ++i) to->push_back(static_cast<T>(from[i] + add));
  }

  std::vector<double> nodes_, support_stiffness_;
  std::vector<std::uint8_t> fixed_;
  std::vector<std::int32_t> tetrahedra_, region_, support_nodes_;
  HyperelasticBody body_;
};

}  // namespace palpate
