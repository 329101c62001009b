// (stands in until the body is there)
#pragma once

#include "runtime/contact/body.h"
#include "runtime/cut/cut_compliance.h"
#include "runtime/scene/scene.h"

namespace palpate {

class CutOrgan final : public Body {
 public:
  struct Source {
    const HyperelasticBody* body;
    const void* pairs;
    std::int32_t nodes, new_nodes, rank;
  };
  bool create(SceneMemory&, const Source&) { return true; }
  bool build(SceneMemory&, palpate_scene&) { return true; }
  void add_node(std::int32_t, std::int32_t) {}
  CutOutcome hold(std::int32_t, double) { return CutOutcome::made; }
  CutOutcome split(const CutChange&, std::int32_t) { return CutOutcome::made; }
  CutOutcome remove(const CutChange&, std::int32_t) { return CutOutcome::made; }
  std::int32_t rank() const { return 0; }
  double most_operations() const { return 0; }
  void forget_cut() {}
};

}  // namespace palpate
