// A HyperelasticBody without some of its tetrahedra.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "runtime/large/hyperelastic_body.h"

namespace palpate {

class RemainingBody {
 public:
  // The other arrays of body are borrowed. Nodes that all tetrahedra have left are held.
  RemainingBody(const HyperelasticBody& body, const std::vector<std::int32_t>& removed) : body_(body) {
    std::vector<bool> gone(static_cast<std::size_t>(body.tetrahedron_count)),
        left(static_cast<std::size_t>(body.node_count), true);
    for (const std::int32_t e : removed) gone[static_cast<std::size_t>(e)] = true;
    for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) {
      if (gone[static_cast<std::size_t>(e)]) continue;
      region_.push_back(body.region[e]);
      for (int a = 0; a < 4; ++a) {
        tetrahedra_.push_back(body.tetrahedra[4 * e + a]);
        left[static_cast<std::size_t>(tetrahedra_.back())] = false;
      }
    }
    fixed_.assign(body.fixed, body.fixed + 3 * body.node_count);
    for (std::size_t n = 0; n < left.size(); ++n)
      if (left[n]) std::fill_n(fixed_.begin() + static_cast<std::ptrdiff_t>(3 * n), 3, std::uint8_t{1});
    left_ = left;
    body_.tetrahedra = tetrahedra_.data(), body_.region = region_.data(), body_.fixed = fixed_.data();
    body_.tetrahedron_count = static_cast<std::int32_t>(region_.size());
  }
  RemainingBody(const RemainingBody&) = delete;
  RemainingBody& operator=(const RemainingBody&) = delete;
  const HyperelasticBody& get() const { return body_; }
  // Sets the displacements of the nodes that all tetrahedra have left to zero: nothing determines them.
  void clear_left(Eigen::VectorXd* u) const {
    for (std::size_t n = 0; n < left_.size(); ++n)
      if (left_[n]) u->segment<3>(static_cast<Eigen::Index>(3 * n)).setZero();
  }

 private:
  HyperelasticBody body_;
  std::vector<std::int32_t> tetrahedra_, region_;
  std::vector<std::uint8_t> fixed_;
  std::vector<bool> left_;
};

// The `count` tetrahedra nearest to a place, m, by their mean corner, none with a node in `kept`; fewer where the body has fewer.
inline std::vector<std::int32_t> nearest_tetrahedra(const HyperelasticBody& body, const Eigen::Vector3d& place,
                                                    std::size_t count, const std::vector<std::int32_t>& kept) {
  std::vector<std::pair<double, std::int32_t>> found;
  for (std::int32_t e = 0; e < body.tetrahedron_count; ++e) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    bool keeps = false;
    for (int a = 0; a < 4; ++a) {
      const std::int32_t n = body.tetrahedra[4 * e + a];
      mean += Eigen::Vector3d(body.nodes + 3 * n) / 4;
      keeps = keeps || std::find(kept.begin(), kept.end(), n) != kept.end();
    }
    if (!keeps) found.emplace_back((mean - place).norm(), e);
  }
  std::sort(found.begin(), found.end());
  std::vector<std::int32_t> nearest;
  for (std::size_t i = 0; i < std::min(count, found.size()); ++i) nearest.push_back(found[i].second);
  return nearest;
}

}  // namespace palpate
