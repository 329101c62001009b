// A body whose mesh has become another one than that of the tensors: what it adds to the compliance between contact nodes, and to the
// displacement by the rows of the offset. The defaults are those of a body that has not changed: none is pure, as in body.h.
#pragma once

#include <cstdint>

#include "runtime/base/vec3.h"
#include "runtime/contact/added_field.h"

namespace palpate {

class Offset;

class ChangedBody {
 public:
  // Goes up by one with each change: W is another one.
  virtual std::int32_t version() const { return 0; }
  // The node whose columns and rows the bundle has for this one: the node itself, or the one that it came from.
  virtual std::int32_t at_rest(std::int32_t node) const { return node; }
  // m/N, what is added to W: find_response() of a node, then displacement of another node per unit force on it. Both are surface nodes.
  virtual void find_response(std::int32_t /*node*/) {}
  virtual Mat3 between(std::int32_t /*other*/) const { return {}; }
  // A step begins with these amounts of the offset's rows: brings moved() up to date.
  virtual void begin_step(const Offset&) {}
  // m, of the surface nodes: what the changed body adds to o. Without nodes where it adds nothing.
  const AddedField& moved() const { return moved_; }
  void keep_moved() { moved_.keep(); }

 protected:
  ~ChangedBody() = default;
  AddedField moved_;
};

}  // namespace palpate
