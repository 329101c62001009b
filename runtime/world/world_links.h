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
#include "runtime/world/joint_solver.h"

namespace palpate {

class WorldLinks final : public LinkList {
 public:
  // organs: [count], borrowed.
  bool create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t organ_count, std::int32_t capacity);
  bool is_on() const { return organ_count_ > 0; }

  // palpate_world_set_links states the contract.
  palpate_status set(const palpate_world_link* links, std::int32_t count, palpate_error* error);
  using LinkList::forget;

  // A step, in order, when all organs have begun theirs. The rows of the links that act. Returns step flags.
  std::uint32_t request();
  // Link i as the joint system takes it; a part of a thread is joined to the one before. False: it has no rows.
  bool joint(std::int32_t i, JointPair* pair) const;
  void take_reaction(std::int32_t i, Vec3 reaction);
  // solved: [organ] whether its contacts have a solution. Returns step flags.
  // Cost: for each node of a link 9 multiply-adds for each contact node of its organ.
  std::uint32_t end(const bool* solved, std::uint64_t step) { return read_reactions(solved, step); }

  // Numbers that a step keeps of one end of a link, for the work that is predicted.
  std::int32_t most_nodes_of_an_end() const { return most_nodes_; }

 private:
  bool add_rows(Link& link, const LinkWish& wish) override;

  LinkedOrgan organ_[PALPATE_MAX_ORGANS] = {};
  std::int32_t most_nodes_ = 3;
};

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_world_link> = offsetof(palpate_world_link, rest_length);

}  // namespace palpate
