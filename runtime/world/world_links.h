// Links between organs of a world, or from an organ to a place of the world (runtime/links/link.h). Each organ that a link holds has a
// constraint for it, with its own ends, along the link's line as its pose turns it. Both constraints share their rows, as those of a pair
// of places do (joint_solver.h): so one reaction acts on both ends.
#pragma once

#include <cstdint>

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_links.h"
#include "runtime/include/palpate/palpate_world.h"
#include "runtime/include/palpate/palpate_world_links.h"
#include "runtime/links/link.h"
#include "runtime/scene/scene.h"
#include "runtime/world/joint_solver.h"

namespace palpate {

// A saved state holds all of it.
struct WorldLink {
  Link link;                   // all places and vectors are in the world
  std::int32_t organ[2] = {};  // of each end; of an end in the world the other end's
  Vec3 rest[2],
      moved[2];   // m, of each end in the frame of its organ: without contacts, and what those of the last step add
  Vec3 reaction;  // N, of the rows in the last step
  std::int32_t constraint[2] = {
      -1, -1};  // of this step, in each organ. Where both ends are on one organ it has the first one
};

class WorldLinks {
 public:
  // organs: [count], borrowed.
  bool create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t organ_count, std::int32_t capacity);
  bool is_on() const { return capacity_ > 0; }

  // palpate_world_set_links states the contract.
  palpate_status set(const palpate_world_link* links, std::int32_t count, palpate_error* error);
  // The links stay, and are as they were when they were given.
  void forget();

  // A step, in order, when all organs have begun theirs. The rows of the links that act. Returns step flags.
  std::uint32_t request();
  // Link i as the joint system takes it, without its target; a part of a thread is joined to the one before. False: it has no rows.
  bool joint(std::int32_t i, JointPair* pair) const;
  // Its target, as the motions of the organs leave it now.
  Vec3 target(std::int32_t i);
  void take_reaction(std::int32_t i, Vec3 reaction);
  // solved: [organ] whether its contacts have a solution. Returns step flags.
  // Cost: for each node of a link 9 multiply-adds for each contact node of its organ.
  std::uint32_t end(const bool* solved, std::uint64_t step);

  std::int32_t count() const { return count_; }
  const palpate_link_state* state(std::int32_t i) const {
    return i >= 0 && i < count_ ? &links_[i].link.state : nullptr;
  }
  // Numbers that a step keeps of one end of a link, for the work that is predicted.
  std::int32_t most_nodes_of_an_end() const { return most_nodes_; }

 private:
  TouchState& touch(const WorldLink& of, int e) const { return organs_[of.organ[e]]->touch; }
  static bool is_free(const WorldLink& of, int e) { return of.link.given.ends[e].kind == PALPATE_END_WORLD; }
  palpate_status read(const palpate_world_link* links, std::int32_t count, std::int32_t i, palpate_error* error);
  void find_ends(WorldLink& of);
  void place_ends(WorldLink& of) const;
  void end_link(WorldLink& of) const;
  void drive(WorldLink& of) const;
  template <class Each>
  void for_threads(const Each& each) const;
  bool request(std::int32_t i);
  void take_back(WorldLink& of);
  bool is_joined(std::int32_t i) const;
  LinkWish parts_without_nodes(std::int32_t i) const;
  void move_end(WorldLink& of, int e) const;
  Mat3 compliance_between(const WorldLink& one, const WorldLink& other) const;

  palpate_scene* const* organs_ = nullptr;
  std::int32_t organ_count_ = 0, capacity_ = 0, count_ = 0, most_nodes_ = 3;
  LinkSurface surface_[PALPATE_MAX_ORGANS] = {};
  WorldLink *links_ = nullptr, *coming_ = nullptr;  // [capacity]
};

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_world_link> = offsetof(palpate_world_link, rest_length);

}  // namespace palpate
