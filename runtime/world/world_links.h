// Links between organs of a world, or from an organ to a place of the world (runtime/links/link.h). Each organ that a link holds has a
// constraint for it, with its own ends, along the link's line as its pose turns it. Both constraints share their rows, as those of a pair
// of places do (joint_solver.h): so one reaction acts on both ends.
#pragma once

#include <cstdint>

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_links.h"
#include "runtime/include/palpate/palpate_world.h"
#include "runtime/include/palpate/palpate_world_links.h"
#include "runtime/links/link_list.h"
#include "runtime/scene/scene.h"
#include "runtime/world/world_step.h"

namespace palpate {

class WorldLinks final : public WorldSource, public LinkList {
 public:
  // organs: [count], borrowed.
  bool create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t organ_count, std::int32_t capacity);

  // palpate_world_set_links states the contract.
  palpate_status set(const palpate_world_link* links, std::int32_t count, palpate_error* error);

  std::int32_t begin(WorldStep& step) override;
  void request(WorldStep& step) override;
  // Cost: for each node of a link 9 multiply-adds for each contact node of its organ.
  void end(WorldStep& step) override;
  WorldPass pass() const override { return WorldPass::links; }
  void forget() override { LinkList::forget(); }

  // Numbers that a step keeps of one end of a link, for the work that is predicted.
  std::int32_t most_nodes_of_an_end() const { return most_nodes_; }

 private:
  bool add_rows(Link& link, const LinkWish& wish) override;
  static bool is_missed(const WorldStep& step, std::int32_t j);

  LinkedOrgan organ_[PALPATE_MAX_ORGANS] = {};
  std::int32_t most_nodes_ = 3;
  std::int32_t first_ = 0;  // of its joints in this step
};

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_world_link> = offsetof(palpate_world_link, rest_length);

}  // namespace palpate
