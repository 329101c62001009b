#include "runtime/world/organ_pairs.h"

#include <algorithm>

namespace palpate {
namespace {

// The pair of a fixed vertex gives way by this share of the compliance that the other organ has there. Without it the system would be
// singular where more fixed vertices lie on the other organ than it has nodes there. So a fixed vertex sinks in by this share of what its
// force presses.
constexpr double kGive = 0.05;
// In mean edges of the other organ: a pair that gives way by more is told.
constexpr double kTold = 0.1;

// Steps for which a pair that has ceased to press keeps its friction. So a pair that presses in every second step holds as firmly as a pair
// that presses in every step.
constexpr std::int16_t kRubs = 10;

}  // namespace

bool OrganPairs::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_pairs,
                        double friction) {
  if (!search_.create(memory, organs, count, most_pairs, friction)) return false;
  most_pairs_ = most_pairs, friction_ = friction;
  say_overlaps(organs);
  return true;
}

void OrganPairs::say_overlaps(palpate_scene* const* organs) const {
  for (std::int32_t g = 0; g < search_.group_count(); ++g) {
    const OrganGroup& group = search_.group_at(g);
    std::int32_t vertices = 0;
    const double largest = search_.largest_overlap(g, &vertices);
    if (vertices > 0)
      organs[group.a]->context.bundle.log.say(
          PALPATE_LOG_NOTE,
          "world: organs %d and %d overlap by up to %.3g mm at %d vertices as they stand; this counts as touching",
          static_cast<int>(group.a), static_cast<int>(group.b), 1e3 * largest, static_cast<int>(vertices));
  }
}

void OrganPairs::forget() {
  if (most_pairs_ > 0) search_.forget();
}

// ---- a step ----------------------------------------------------------------------------------------------------------

std::int32_t OrganPairs::begin(WorldStep& step) {
  if (most_pairs_ > 0) step.flags |= search_.search();
  return search_.count();
}

ContactLaw OrganPairs::law_of(const OrganPair& pair) const {
  return search_.rubs(pair) ? ContactLaw::coulomb : ContactLaw::unilateral;
}

// The constraint of one side; -1: it does not move.
std::int32_t OrganPairs::request_side(const WorldStep& step, const OrganPair& pair, int side) const {
  const OrganGroup& group = search_.group(pair);
  const std::int32_t organ = side == 0 ? group.a : group.b, other = side == 0 ? group.b : group.a;
  TouchState &own = step.touch(organ), &second = step.touch(group.b);
  std::int32_t node[3] = {pair.vertex}, count = side == 0 && own.surface.column_of_node[pair.vertex] >= 0;
  double weight[3] = {1};
  if (side == 1) {
    // A vertex without a column stands still: its weight is the support's.
    const std::int32_t* const corner = second.surface.triangles + 3 * static_cast<std::size_t>(pair.triangle);
    for (int v = 0; v < 3; ++v)
      if (second.surface.column_of_node[corner[v]] >= 0 && pair.barycentric[v] > 0)
        node[count] = corner[v], weight[count++] = pair.barycentric[v];
  }
  if (count == 0) return -1;
  // The first row is along the force that the other organ exerts.
  Vec3 row[3] = {pair.normal, pair.tangent, cross(pair.normal, pair.tangent)};
  for (Vec3& axis : row)
    axis = side == 1 ? -1 * axis : own.organ.pose().turned_to_body(second.organ.pose().turned_to_world(axis));
  RowWish wish({{kPairSource, other, (group.second ? 1 << 25 : 0) + pair.vertex}, 0});
  wish.node = node, wish.weight = weight, wish.count = count;
  wish.rows.law = law_of(pair), wish.rows.friction = friction_;
  wish.rows.axes = wish.rows.law == ContactLaw::coulomb ? 7 : 1;
  wish.set_frame(row);
  return own.rows.add_reserved(wish);
}

// Each organ gets its pairs in ascending order: the groups ascend, and so do the other organ's number and the vertices in them.
void OrganPairs::request(WorldStep& step) {
  first_ = step.joint_count;
  for (std::int32_t i = 0; i < search_.count(); ++i) {
    const OrganPair& pair = search_.pair(i);
    JointConstraint& joint = step.joints[step.joint_count++] = JointConstraint{};
    const OrganGroup& group = search_.group(pair);
    joint.organ[0] = group.a, joint.organ[1] = group.b;
    for (int side = 0; side < 2; ++side) joint.constraint[side] = request_side(step, pair, side);
    joint.law = law_of(pair), joint.friction = friction_;
    if (joint.constraint[0] < 0 && joint.constraint[1] >= 0) {
      // A place that is partly fixed gives way like one that is not: its own compliance is smaller by the square of what moves.
      const double moves = moving_share(step.touch(group.b), pair);
      joint.give = kGive / (moves * moves);
    }
    joint.target = search_.target(pair) - search_.moved_apart(pair);
    joint.reaction = pair.reaction;
  }
}

void OrganPairs::end(WorldStep& step) {
  for (std::int32_t i = 0; i < search_.count(); ++i) {
    const JointConstraint& joint = this->joint(step, i);
    OrganPair& pair = search_.pair(i);
    const Vec3 r = pair.reaction = is_finite(joint.reaction) ? joint.reaction : Vec3{};
    const GivesWay gone = gives_way(joint.law, friction_, 0, r);
    const double told = kTold * search_.mean_edge(joint.organ[1]);
    if (is_held(joint) || joint.gap < -told) step.flags |= PALPATE_STEP_NOT_TOUCHABLE;
    const bool presses = !gone.released, sticks = search_.rubs(pair) && presses && !gone.slips;
    if (presses && search_.rubs(pair) && search_.is_steep(pair)) step.flags |= PALPATE_STEP_FRICTION_JAMS;
    pair.slips = 0, pair.rubs = presses ? kRubs : std::max<std::int16_t>(1, pair.rubs) - 1;
    if (!sticks) search_.let_slip(i);
  }
}

// ---- what it tells ---------------------------------------------------------------------------------------------------

void OrganPairs::write(const WorldStep& step, std::int32_t i, palpate_world_pair* out) {
  const OrganPair& pair = search_.pair(i);
  const JointConstraint& joint = this->joint(step, i);
  const Pose& pose = step.touch(joint.organ[1]).organ.pose();
  *out = palpate_world_pair{};
  std::copy(joint.organ, joint.organ + 2, out->organ);
  out->node = pair.vertex, out->triangle = pair.triangle;
  std::copy(pair.barycentric, pair.barycentric + 3, out->barycentric);
  store3(pose.to_world(search_.place_at_rest(pair)), out->place);
  store3(pose.turned_to_world(pair.normal), out->normal);
  const Vec3 force = pair.reaction.x * pair.normal + pair.reaction.y * pair.tangent +
                     pair.reaction.z * cross(pair.normal, pair.tangent);
  store3(pose.turned_to_world(force), out->force);
  const double area = search_.area(pair);
  out->pressure = area > 0 ? pair.reaction.x / area : 0;
  out->gap = joint.gap;
  out->overlap = pair.overlap;
}

void OrganPairs::tell(WorldStep& step, palpate_world_contacts& out) {
  out.pairs_offset = out.used_bytes, out.pair_bytes = sizeof(palpate_world_pair);
  if (most_pairs_ > 0) out.pair_count = search_.count(), out.pair_sweeps = step.sweeps;
  for (std::int32_t i = 0; i < out.pair_count; ++i) {
    auto* const pair = const_cast<palpate_world_pair*>(palpate_world_contacts_pair(&out, i));
    write(step, i, pair);
    for (int side = 0; side < 2; ++side) {
      const auto* const organ = palpate_world_contacts_state(&out, pair->organ[side]);
      for (int d = 0; d < 3; ++d)
        const_cast<palpate_world_organ_state*>(organ)->pressed[d] += (side == 0 ? 1 : -1) * pair->force[d];
    }
  }
  out.used_bytes += static_cast<std::size_t>(out.pair_count) * sizeof(palpate_world_pair);
}

}  // namespace palpate
