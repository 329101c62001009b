// Organs that touch: the pairs of a vertex and a place that the search finds (pair_search.h), as a source of rows.
#pragma once

#include <cstdint>

#include "runtime/include/palpate/palpate_world_pairs.h"
#include "runtime/world/pair_search.h"
#include "runtime/world/world_step.h"

namespace palpate {

class OrganPairs final : public WorldSource {
 public:
  // organs: [count], borrowed. Tells the bundles' logs where organs overlap. Without create() organs pass through one another.
  bool create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_pairs,
              double friction);

  std::int32_t begin(WorldStep& step) override;
  void request(WorldStep& step) override;
  void end(WorldStep& step) override;
  void tell(WorldStep& step, palpate_world_contacts& out) override;
  WorldPass pass() const override { return WorldPass::search; }
  std::size_t most_told_bytes() const override {
    return static_cast<std::size_t>(most_pairs_) * sizeof(palpate_world_pair);
  }
  void forget() override;

  // Vertices that the search looks through.
  std::int32_t vertices() const { return search_.vertices(); }

 private:
  void say_overlaps(palpate_scene* const* organs) const;
  ContactLaw law_of(const OrganPair& pair) const;
  std::int32_t request_side(const WorldStep& step, const OrganPair& pair, int side) const;
  void write(const WorldStep& step, std::int32_t i, palpate_world_pair* out);
  const JointConstraint& joint(const WorldStep& step, std::int32_t i) const { return step.joints[first_ + i]; }

  PairSearch search_;
  double friction_ = 0;
  std::int32_t most_pairs_ = 0;
  std::int32_t first_ = 0;  // of its joints in this step
};

}  // namespace palpate
