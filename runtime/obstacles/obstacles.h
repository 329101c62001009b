// Rigid surfaces that the organ's surface does not enter, as a source of rows: each node that is near one has a row along the surface's normal n,
//     n . (u - (p - x)) >= 0,   x: the node at rest, p: the nearest place,
// and, with friction, two across it that hold the node at the place where it came to press or to which it has slid.
//
// A node is looked at when a bound on how far it and the obstacle have moved has grown by its distance, less a margin. An obstacle whose box is
// apart from that of the organ looks at none; while both stay where they are, its step compares their poses and nothing else.
#pragma once

#include <cstdint>

#include "runtime/contact/row_source.h"
#include "runtime/contact/touch.h"
#include "runtime/obstacles/obstacle_shape.h"
#include "runtime/pose/pose.h"

namespace palpate {

// index: the obstacle, point: the node.
constexpr ContactSource kObstacleSource{PALPATE_SOURCE_OBSTACLE};

class Obstacles final : public RowSource {
 public:
  struct Source {
    TouchState* touch;              // borrowed; its tree and field are there
    std::int32_t nodes, triangles;  // of the mesh's surface
    Pass pass;
  };
  // most: nodes that they may hold. Then read() for each.
  bool create(SceneMemory& memory, const Source& source, std::int32_t count, std::int32_t most);
  // The sentence of what is wrong; nullptr: nothing, unless the memory has failed.
  const char* read(SceneMemory& memory, std::int32_t i, const palpate_obstacle& from);

  std::int32_t begin(TouchStep& step) override;
  void request(TouchStep& step) override;
  void end(TouchStep& step) override;
  Pass pass() const override { return pass_; }
  void forget_rest() override;

  std::int32_t count() const { return count_; }
  OrganPose& pose(std::int32_t i) { return moved_[i].pose; }
  const palpate_obstacle_state* state(std::int32_t i) const { return i >= 0 && i < count_ ? &states_[i] : nullptr; }
  // What the search counts at most, where each query of the field takes `field`.
  double most_operations(double field) const;

 private:
  struct Obstacle {
    ObstacleShape shape;
    double friction = 0, depth = 0;  // as in palpate_obstacle
  };
  // From step to step.
  struct Moved {
    OrganPose pose;
    Pose before, organ_before;  // in the step before
    double way = 0;  // m: a bound on how far both poses have moved any node against the obstacle, summed over the steps
    std::int64_t begun = 0;  // 1: there was a step before
    double apart = -1;       // m: with these poses it is far until a node is farther from rest
  };
  // A node that is near an obstacle. In the obstacle's frame where nothing else is said.
  struct Held {
    std::int32_t obstacle = 0, node = 0;
    std::int32_t constraint = -1;
    std::int32_t rubs = 0;  // steps for which the node still has friction; above 0: it pressed in one of the last ten
    Vec3 place, normal, tangent;
    Vec3 anchor;         // m, where the node sticks
    double gap = 0;      // m, of the node from the place along the normal, before the step
    double overlap = 0;  // m, by which the node is inside without a force
    Vec3 reaction;       // N, along normal, tangent and the third direction
  };

  Vec3 to_obstacle(std::int32_t i, Vec3 point) const;
  Vec3 in_organ(std::int32_t i, Vec3 direction) const;
  Vec3 at_rest(std::int32_t node) const { return touch_->surface.place(node); }
  Vec3 displaced(std::int32_t node);
  Vec3 outward(std::int32_t node);
  double& due(std::int32_t i, std::int32_t node) {
    return due_[static_cast<std::size_t>(i) * static_cast<std::size_t>(tree_->surface_nodes()) +
                static_cast<std::size_t>(node)];
  }
  double moved(std::int32_t i, std::int32_t node) const;
  void measure_way(std::int32_t i);
  bool is_far(std::int32_t i);
  bool faces(std::int32_t i, std::int32_t node, Vec3 normal);
  bool look(std::int32_t i, std::int32_t node, const Held* before, Held* found);
  double overlap_of(std::int32_t i, std::int32_t node, double gap);
  void follow_surface();
  void search(std::int32_t i, std::int32_t* next_held);
  std::uint32_t keep_nearest();
  bool rubs(const Held& held) const { return obstacles_[held.obstacle].friction > 0 && held.rubs > 0; }
  void frame_of(const Held& held, Vec3 row[3]) const;
  Vec3 target(const Held& held, const Vec3 row[3]) const;
  void take(TouchStep& step, Held& held);

  TouchState* touch_ = nullptr;
  const SurfaceTree* tree_ = nullptr;  // of the mesh's own triangles
  SurfaceTree own_tree_;
  Pass pass_ = Pass::contact;
  std::int32_t count_ = 0, most_ = 0, capacity_ = 0;
  Obstacle obstacles_[PALPATE_MAX_OBSTACLES];
  Moved* moved_ = nullptr;                    // [count]
  palpate_obstacle_state* states_ = nullptr;  // [count]
  double* due_ = nullptr;                     // [count][nodes] m: of moved(), at which the node is looked at
  Held *held_ = nullptr, *found_ = nullptr;   // [capacity], ascending by obstacle and node
  double* nearness_ = nullptr;                // [capacity]
  std::int32_t held_count_ = 0, found_count_ = 0;
  std::int32_t seen_ = 0;                   // divided nodes that the held ones have followed
  std::uint32_t flags_ = 0, at_peace_ = 0;  // at_peace_: a bit for each obstacle that stays far in this step
  QueryWork work_;
};

}  // namespace palpate
