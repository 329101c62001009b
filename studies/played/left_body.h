// The body of a scene that is cut, for Newton's method: the bundle's nodes, with the tetrahedra that are left. A node in reserve that is a new node
// lies where it comes from; nodes in no tetrahedron are held.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/include/palpate/palpate.h"
#include "runtime/large/hyperelastic_body.h"

namespace palpate::played {

class LeftBody {
 public:
  // uncut: the bundle's body, whose nodes and laws are borrowed; its soft supports are not those of a cut body, so it must have none.
  LeftBody(const HyperelasticBody& uncut, const palpate_scene& scene);
  const HyperelasticBody& get() const { return body_; }
  // Whether a tetrahedron has the node.
  bool has(std::ptrdiff_t node) const { return is_left_[static_cast<std::size_t>(node)] != 0; }

 private:
  HyperelasticBody body_;
  std::vector<double> nodes_;
  std::vector<std::int32_t> tetrahedra_, region_;
  std::vector<std::uint8_t> fixed_, is_left_;
};

}  // namespace palpate::played
