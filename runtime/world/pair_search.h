// Which places of two organs are so near that they may touch: pairs of a vertex of one organ and a place on the other one.
//
// The vertices of both organs have pairs. A vertex is looked at
// again when a bound on how far it and the other organ have moved has grown by its distance, less a margin. Vertices that are held fixed
// carry pairs too: such a pair presses the other organ alone.
#pragma once

#include <cstdint>

#include "runtime/include/palpate/palpate_world.h"
#include "runtime/scene/scene.h"
#include "runtime/world/organ_surface.h"

namespace palpate {

// How a place or a normal follows what the surfaces ask for: by a share of the way, which falls where the way turns back.
struct Follow {
  Vec3 way;           // the last one that was gone
  double share = 1;   // and the share that this was of the whole way
  double onward = 0;  // times that it has gone on since it turned back
};

// One pair, from step to step. In the frame of the second organ where nothing else is said.
struct OrganPair {
  std::int32_t group = 0, vertex = 0, triangle = -1;
  std::int8_t slips = 0;  // 1: in the last step it slipped or had no force; its place may then move
  std::int8_t over_edge =
      0;  // 1: the place is on an edge of the second organ, and the normal the way from there to the vertex
  std::int16_t rubs = 0;  // steps for which the pair still has friction; above 0: it pressed in one of the last ten
  double barycentric[3] = {};
  Vec3 normal, tangent;  // unit: outward from the second organ; across it
  double bulge = 0;      // m, OrganSurface::Smooth
  double overlap = 0;    // m, by which the organs overlap there where they rest; it counts as touching
  // m, from the place to the vertex, or to where the last step left it, when it was last looked at; below 0 inside
  double near = 0;
  Follow moves;       // m, of the place
  Follow turns;       // of the normal
  Vec3 seen_apart;    // m, from the place to the vertex when the pair was last looked for
  Vec3 seen_outward;  // unit: of the place's triangle when its normal was last asked for
  Vec3 reaction;      // N, on the first organ along normal, tangent and the third direction
};

// The weights of the corners of the pair's place that contacts can move, as a sum. second: the organ of the place.
double moving_share(const TouchState& second, const OrganPair& pair);

// The vertices of one organ that are near the surface of another one or may come so. Two organs have two groups, one after the other.
struct OrganGroup {
  std::int32_t a = 0, b = 0;  // the pairs are of vertices of a and places of b
  bool second = false;        // a has the longer edges of the two
  double margin = 0;          // m, within which a vertex counts as near
  double reach = 0;           // m, within which it is looked for
  // When a vertex of a was last looked at, and by how much it and the other organ may move until it is looked at again.
  struct Look {
    double room = 0;                // m
    double path_a = 0, path_b = 0;  // sqrt(J), of the fields then
    double way = 0;                 // m, of the poses then
    double per_path = 0;            // m / sqrt(J): by how much the second organ's field may bring its surface nearer
    std::int64_t deep = 0;          // 1: it is inside of b, by more than it was at rest and kDeep, and no pair holds it
  };
  Look* look = nullptr;       // [nodes of a]
  double* overlap = nullptr;  // [nodes of a] m
  double* overlap_at_rest = nullptr;
  double* inside_at_rest = nullptr;  // [nodes of a] m, of vertices that do not face b where they are in it
  // From step to step.
  struct Motion {
    double way = 0;  // m, a bound on how far the poses have moved any vertex of a against b, summed over the steps
    double path_a = 0, path_b = 0;  // sqrt(J), of the fields in the last step
    std::uint64_t changes = 0;      // of the triangles of both, then
    Pose pose_a, pose_b;
  };
  Motion* motion = nullptr;
  Pose pose_a_before, pose_b_before;  // in the step before the present one
  bool moves = false;                 // since then a pose has changed, or motions have moved one of them
};

class PairSearch {
 public:
  // organs: [count], with collision DEFORMED; borrowed. Finds where they overlap, as they stand.
  bool create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_pairs,
              double friction);

  // The pairs of a step, from the organs as the last step has left them and the poses of this one. Returns step flags.
  std::uint32_t search();
  std::int32_t count() const { return count_; }
  OrganPair& pair(std::int32_t i) { return pairs_[i]; }
  const OrganGroup& group(const OrganPair& pair) const { return groups_[pair.group]; }

  // m, of a pair at rest: by how much the second organ must give way, along normal, tangent and the third direction.
  Vec3 target(const OrganPair& pair) const;
  // m, along the same: by how much the motions of both organs have moved the vertex from the place.
  Vec3 moved_apart(const OrganPair& pair) const;
  // m, in the frame of the second organ: the vertex; the place on the second organ; both at rest.
  Vec3 vertex_at_rest(const OrganPair& pair) const;
  Vec3 place_at_rest(const OrganPair& pair) const;
  double area(const OrganPair& pair) const { return surface_[group(pair).a].area(pair.vertex); }
  // Whether the second organ has turned so steeply at the pair that friction carries its tissue along in front of the first one.
  bool is_steep(const OrganPair& pair) const;
  // The pair has slipped, or has no force: its place may move in the next step.
  void let_slip(std::int32_t i);
  // Whether the pair has friction. A pair that has not pressed lately has none: where organs come near one another most pairs never press, and
  // friction takes three rows in place of one and a search in each step. So friction begins a step after the pair has begun to press.
  bool rubs(const OrganPair& pair) const { return has_friction_ && pair.rubs > 0; }

  // The largest overlap of two organs where they rest, m, and how many vertices overlap.
  double largest_overlap(std::int32_t g, std::int32_t* vertices) const;
  std::int32_t group_count() const { return group_count_; }
  std::int32_t vertices() const { return capacity_; }  // of the first organs of all groups
  const OrganGroup& group_at(std::int32_t g) const { return groups_[g]; }
  double mean_edge(std::int32_t organ) const { return surface_[organ].tree().mean_edge(); }  // m

  void forget();

 private:
  TouchState& touch(std::int32_t organ) const { return organs_[organ]->touch; }
  // A point, or a direction, of the first organ's frame in the second one's.
  Vec3 to_second(const OrganGroup& group, Vec3 point) const {
    return touch(group.b).organ.pose().to_body(touch(group.a).organ.pose().to_world(point));
  }
  Vec3 turned_to_second(const OrganGroup& group, Vec3 direction) const {
    return touch(group.b).organ.pose().turned_to_body(touch(group.a).organ.pose().turned_to_world(direction));
  }
  void measure_motion(OrganGroup& group) const;
  void look_after(OrganGroup& group, std::int32_t vertex, double room, double per_path) const;
  bool is_due(const OrganGroup& group, std::int32_t vertex) const;
  bool is_apart(const OrganGroup& group) const;
  bool search_group(std::int32_t g, std::int32_t* next_held);
  Vec3 left_by_last_step(const OrganGroup& group, const OrganPair& pair, Vec3 vertex) const;
  // A point of the first organ under the poses of the step before.
  Vec3 to_second_before(const OrganGroup& group, Vec3 point) const {
    return group.pose_b_before.to_body(group.pose_a_before.to_world(point));
  }
  void face(const OrganGroup& group, Vec3 off, Vec3 facing, NearestPoint* nearest) const;
  Vec3 anchor_under(const OrganGroup& group, NearestPoint nearest, Vec3 at, Vec3 facing, OrganPair* pair);
  Vec3 place_now(const OrganGroup& group, const OrganPair& pair, Vec3* outward) const;
  Vec3 normal_at(const OrganGroup& group, const OrganPair& pair, Vec3 outward);
  bool stands(const OrganGroup& group, Vec3 at, OrganPair* pair, double* moved);
  bool keeps_place(const OrganGroup& group, const OrganPair& pair, Vec3 at, bool outside) const;
  void note_where(const OrganGroup& group, Vec3 at, OrganPair* pair) const;
  void follow(const OrganGroup& group, const OrganPair& before, Vec3 was, Vec3 at, Vec3 facing, OrganPair* found,
              Vec3* place);
  void keep_place(const OrganGroup& group, const OrganPair& before, OrganPair* found);
  bool is_far(OrganGroup& group, std::int32_t vertex, bool held, const NearestPoint& nearest) const;
  bool faces_away(OrganGroup& group, std::int32_t vertex, bool held, Vec3 p, const NearestPoint& nearest,
                  OrganPair* pair) const;
  bool follow_last(OrganGroup& group, const OrganPair& last, Vec3 at, Vec3 facing, OrganPair* found, Vec3* place);
  bool look(std::int32_t g, std::int32_t vertex, bool held, OrganPair* pair);
  void anchor(const OrganGroup& group, const NearestPoint& nearest, Vec3 off, OrganPair* pair);
  void find_overlaps(OrganGroup& group);
  std::uint32_t keep_nearest();

  palpate_scene* const* organs_ = nullptr;
  std::int32_t organ_count_ = 0, group_count_ = 0;
  OrganSurface surface_[PALPATE_MAX_ORGANS];
  OrganGroup* groups_ = nullptr;                                                        // [group_count]
  OrganGroup::Motion* motions_ = nullptr;                                               // [group_count]
  OrganGroup::Look* looks_ = nullptr;                                                   // [capacity], of all groups
  double *overlap_ = nullptr, *overlap_at_rest_ = nullptr, *inside_at_rest_ = nullptr;  // the same
  bool has_friction_ = false;
  std::int32_t most_ = 0, capacity_ = 0;
  OrganPair *pairs_ = nullptr, *found_ = nullptr;  // [capacity], ascending by group and vertex
  double* nearness_ = nullptr;                     // [capacity]
  std::int32_t count_ = 0, found_count_ = 0;
  QueryWork work_;
};

}  // namespace palpate
