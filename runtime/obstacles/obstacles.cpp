#include "runtime/obstacles/obstacles.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/contact/contact_patch.h"
#include "runtime/contact/divided_nodes.h"
#include "runtime/contact/nearest_few.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// In mean edges of the organ: within which a node counts as near; by how much it must go farther to count as far again; after which motion a node
// that does not face the obstacle is looked at again.
constexpr double kMargin = 0.25, kStays = 1.5, kAgain = 0.02;
// A node faces the surface where their normals differ by more than about 100 degrees (cosine).
constexpr double kFaces = -0.2;
// Radians, by which the surface turns before a row's normal follows, so that rows at rest stay as they are.
constexpr double kTurned = 9e-4;
// Steps for which a node that has ceased to press keeps its friction.
constexpr std::int32_t kRubs = 10;

}  // namespace

const char* Obstacles::read(SceneMemory& memory, std::int32_t i, const palpate_obstacle& from) {
  obstacles_[i].friction = from.friction, obstacles_[i].depth = from.depth;
  return obstacles_[i].shape.create(memory, from);
}

bool Obstacles::create(SceneMemory& memory, const Source& source, std::int32_t count, std::int32_t most) {
  touch_ = source.touch, tree_ = &touch_->tree, pass_ = source.pass, count_ = count, most_ = most;
  if (const TouchedSurface& mesh = touch_->surface; mesh.bound) {
    tree_ = &own_tree_;
    if (!own_tree_.build(memory, mesh.rest, source.nodes, mesh.triangles, source.triangles)) return false;
  }
  const auto nodes = static_cast<std::size_t>(tree_->surface_nodes()), obstacles = static_cast<std::size_t>(count);
  capacity_ = count * tree_->surface_nodes();
  moved_ = memory.array<Moved>(obstacles);
  states_ = memory.array<palpate_obstacle_state>(obstacles);
  due_ = memory.array<double>(obstacles * nodes);
  held_ = memory.array<Held>(obstacles * nodes);
  found_ = memory.array<Held>(obstacles * nodes);
  nearness_ = memory.array<double>(obstacles * nodes);
  if (memory.failed()) return false;
  for (std::int32_t i = 0; i < count; ++i) moved_[i] = Moved{};
  memory.keep_array(moved_, obstacles);
  memory.keep_array(states_, obstacles);
  memory.keep_array(due_, obstacles * nodes);
  memory.keep(held_count_), memory.keep(seen_);
  memory.keep_array(held_, obstacles * nodes, held_count_);
  forget_rest();
  return !memory.failed();
}

void Obstacles::forget_rest() {
  held_count_ = seen_ = 0;
  for (std::int32_t i = 0; i < count_; ++i) {
    moved_[i].way = 0, moved_[i].begun = 0, moved_[i].apart = -1;
    states_[i] = palpate_obstacle_state{};
  }
  std::fill(due_, due_ + capacity_, -HUGE_VAL);
}

double Obstacles::most_operations(double field) const {
  double triangles = 0;
  for (std::int32_t i = 0; i < count_; ++i) triangles += obstacles_[i].shape.triangles();
  const double corners = 1 + 2.0 * tree_->largest_fan(), nodes = tree_->surface_nodes();
  return nodes * count_ * (3 + 2 * corners) * (100 + field) + 2 * nodes * 200 * triangles;
}

// ---- places ----------------------------------------------------------------------------------------------------------

Vec3 Obstacles::to_obstacle(std::int32_t i, Vec3 point) const {
  return moved_[i].pose.pose().to_body(touch_->organ.pose().to_world(point));
}

Vec3 Obstacles::in_organ(std::int32_t i, Vec3 direction) const {
  return touch_->organ.pose().turned_to_body(moved_[i].pose.pose().turned_to_world(direction));
}

Vec3 Obstacles::displaced(std::int32_t node) {
  SurfaceField& field = *touch_->field;
  return at_rest(node) + (field.empty() ? Vec3{} : field.at_node(node, &work_));
}

// Of the node on the deformed surface; its length has no meaning.
Vec3 Obstacles::outward(std::int32_t node) {
  Vec3 sum;
  tree_->around(node, [&](std::int32_t triangle) {
    const std::int32_t* const corner = tree_->corners(triangle);
    const Vec3 a = displaced(corner[0]);
    sum += cross(displaced(corner[1]) - a, displaced(corner[2]) - a);
  });
  return sum;
}

// m: grows by no less than the node has moved against the obstacle.
double Obstacles::moved(std::int32_t i, std::int32_t node) const {
  return moved_[i].way + touch_->surface.node_reach[node] * touch_->deformed.path();
}

void Obstacles::measure_way(std::int32_t i) {
  Moved& of = moved_[i];
  const Pose &organ = touch_->organ.pose(), &now = of.pose.pose();
  if (!of.begun) of.before = now, of.organ_before = organ;
  if (same_pose(organ, of.organ_before) && same_pose(now, of.before)) return;
  of.apart = -1;
  const double far = touch_->deformed.farthest_from_rest();
  const Vec3 room = {far, far, far};
  of.way += longest_way(of.organ_before, of.before, {organ, tree_->low() - room, tree_->high() + room}, now);
}

bool Obstacles::is_far(std::int32_t i) {
  moved_[i].apart = -1;
  const ObstacleShape& shape = obstacles_[i].shape;
  const PosedBox organ = {touch_->organ.pose(), tree_->low(), tree_->high()},
                 own = {moved_[i].pose.pose(), shape.low(), shape.high()};
  const double near = kStays * kMargin * tree_->mean_edge(), from_rest = touch_->deformed.farthest_from_rest();
  for (const double most : {2 * from_rest + tree_->mean_edge(), from_rest}) {
    if (!are_apart(organ, own, most + near)) continue;
    moved_[i].apart = most;
    return true;
  }
  return false;
}

// ---- the search ------------------------------------------------------------------------------------------------------

// m: how much of what a node is inside counts as touching, when the node is found there. What has come through the surface since the last step
// began is pushed out; what was inside before, or beside an edge, is not: that would do work that nobody has done.
double Obstacles::overlap_of(std::int32_t i, std::int32_t node, double gap) {
  if (!(gap < 0)) return 0;
  const Moved& of = moved_[i];
  ObstaclePlace before;
  const Vec3 left = of.before.to_body(of.organ_before.to_world(displaced(node) - touch_->offset.step_of(node)));
  if (!of.begun || !obstacles_[i].shape.nearest(left, obstacles_[i].depth, &work_, &before)) return -gap;
  const double moved_in = touch_->surface.node_reach[node] * touch_->field->last_change();
  return std::clamp(-before.gap - moved_in, 0.0, -gap);
}

bool Obstacles::faces(std::int32_t i, std::int32_t node, Vec3 normal) {
  const Vec3 out = outward(node);
  return dot(in_organ(i, normal), out) <= kFaces * length(out);
}

// Looks at a node. True where it is near: *found is then up to date. before: the last step's; nullptr: the node was not near.
bool Obstacles::look(std::int32_t i, std::int32_t node, const Held* before, Held* found) {
  Obstacle& obstacle = obstacles_[i];
  const double margin = kMargin * tree_->mean_edge(), most = (before ? kStays : 1) * margin,
               within = std::max(kStays * margin, obstacle.depth), depth = (before ? 2 : 1) * obstacle.depth;
  const Vec3 p = to_obstacle(i, displaced(node));
  ObstaclePlace place;
  const bool is_near = obstacle.shape.nearest(p, before ? HUGE_VAL : within, &work_, &place);
  double room = is_near ? place.gap - margin : before ? 0 : within - margin;
  bool holds = is_near && place.gap <= most && -place.gap <= depth;
  if (is_near && -place.gap > depth && before) flags_ |= PALPATE_STEP_TRACKING_LOST;
  if (holds && !before) holds = faces(i, node, place.normal);
  if (is_near && place.gap <= most) room = kAgain * tree_->mean_edge();
  due(i, node) = moved(i, node) + room;
  if (!holds) return false;
  *found = before ? *before : Held{};
  found->obstacle = i, found->node = node, found->place = place.at, found->gap = place.gap;
  if (!before || length(place.normal - found->normal) > kTurned) found->normal = place.normal;
  found->tangent = across(found->normal, found->tangent);
  const double gap = dot(found->normal, p - place.at);
  found->overlap = before ? std::min(found->overlap, std::max(0.0, -gap)) : overlap_of(i, node, gap);
  return true;
}

void Obstacles::search(std::int32_t i, std::int32_t* next_held) {
  const std::int32_t first = *next_held;
  while (*next_held < held_count_ && held_[*next_held].obstacle == i) ++*next_held;
  if (first == *next_held && is_far(i)) return;
  for (std::int32_t node = 0, held = first; node < tree_->surface_nodes(); ++node) {
    const Held* const before = held < *next_held && held_[held].node == node ? &held_[held++] : nullptr;
    const TouchedSurface& surface = touch_->surface;
    if (surface.column_of_node[node] < 0 || !surface.has_triangles(node)) continue;
    if (!before && moved(i, node) < due(i, node)) continue;
    found_count_ += look(i, node, before, &found_[found_count_]);
  }
}

// Where a cut divides a node that an obstacle holds, both parts go on as it was.
void Obstacles::follow_surface() {
  const DividedNodes* const divided = touch_->surface.divided;
  for (; divided && seen_ < divided->made(); ++seen_) {
    const DividedNodes::Pair pair = divided->pair(seen_);
    for (std::int32_t k = 0; k < held_count_; ++k) {
      if (held_[k].node != pair.from) continue;
      std::int32_t at = held_count_++;
      for (; held_[at - 1].obstacle > held_[k].obstacle ||
             (held_[at - 1].obstacle == held_[k].obstacle && held_[at - 1].node > pair.node);
           --at)
        held_[at] = held_[at - 1];
      held_[at] = held_[k], held_[at].node = pair.node;
    }
  }
}

// Where there are more nodes than the scene has room for, those that press stay, and of the others the nearest.
std::uint32_t Obstacles::keep_nearest() {
  if (found_count_ <= most_) return 0;
  std::int32_t kept = 0;
  visit_nearest(
      found_count_, most_, [&](std::int32_t k) { return found_[k].reaction.x > 0 ? -HUGE_VAL : found_[k].gap; },
      nearness_,
      [&](std::int32_t k, bool stays) {
        if (stays)
          found_[kept++] = found_[k];
        else
          due(found_[k].obstacle, found_[k].node) = -HUGE_VAL;
      });
  found_count_ = kept;
  return PALPATE_STEP_CONTACTS_DROPPED;
}

std::int32_t Obstacles::begin(TouchStep& step) {
  work_ = {}, flags_ = at_peace_ = 0, found_count_ = 0;
  follow_surface();
  std::int32_t next_held = 0;
  // All obstacles have the organ's pose of the same step.
  const bool organ_stands = moved_[0].begun && same_pose(touch_->organ.pose(), moved_[0].organ_before);
  const double from_rest = touch_->deformed.farthest_from_rest();
  for (std::int32_t i = 0; i < count_; ++i) {
    Moved& of = moved_[i];
    const bool holds = next_held < held_count_ && held_[next_held].obstacle == i,
               stands = organ_stands && of.pose.stands();
    if (stands && of.apart >= from_rest && !holds) {
      at_peace_ |= 1u << i;
      continue;
    }
    of.pose.begin_step(touch_->input.dt());
    measure_way(i);
    search(i, &next_held);
    of.before = of.pose.pose(), of.organ_before = touch_->organ.pose(), of.begun = 1;
  }
  step.flags |= flags_ | keep_nearest();
  std::swap(held_, found_);
  held_count_ = found_count_;
  return held_count_;
}

// ---- rows ------------------------------------------------------------------------------------------------------------

// In the organ's frame: the first row is along the force that the obstacle exerts.
void Obstacles::frame_of(const Held& held, Vec3 row[3]) const {
  row[0] = in_organ(held.obstacle, held.normal), row[1] = in_organ(held.obstacle, held.tangent);
  row[2] = cross(row[0], row[1]);
}

Vec3 Obstacles::target(const Held& held, const Vec3 row[3]) const {
  const auto from_rest = [&](Vec3 place) {
    return touch_->organ.pose().to_body(moved_[held.obstacle].pose.pose().to_world(place)) - at_rest(held.node);
  };
  const Vec3 along = from_rest(held.place), across = from_rest(held.anchor);
  return {dot(row[0], along) - held.overlap, dot(row[1], across), dot(row[2], across)};
}

void Obstacles::request(TouchStep& step) {
  const double weight = 1;
  for (std::int32_t k = 0; k < held_count_; ++k) {
    Held& held = held_[k];
    Vec3 row[3];
    frame_of(held, row);
    RowWish wish({{kObstacleSource, held.obstacle, held.node}, 0});
    wish.node = &held.node, wish.weight = &weight, wish.count = 1;
    wish.rows.law = rubs(held) ? ContactLaw::coulomb : ContactLaw::unilateral;
    wish.rows.axes = rubs(held) ? 7 : 1, wish.rows.friction = obstacles_[held.obstacle].friction;
    wish.set_frame(row);
    wish.target = target(held, row);
    held.constraint = touch_->rows.add(&wish, 1);
    bool deferred = false;
    if (held.constraint < 0)
      step.flags |= PALPATE_STEP_CONTACTS_DROPPED;
    else if (!touch_->admission.admit(held.constraint, false, &deferred))
      held.constraint = -1;
    if (deferred) step.flags |= PALPATE_STEP_WORK_DEFERRED;
  }
}

// The reaction of a node, and where the step leaves it.
void Obstacles::take(TouchStep& step, Held& held) {
  const Vec3 r = held.constraint >= 0 && step.is_solved ? step.reaction(held.constraint) : Vec3{};
  held.reaction = is_finite(r) ? r : Vec3{};
  const double friction = obstacles_[held.obstacle].friction;
  const GivesWay gone =
      gives_way(rubs(held) ? ContactLaw::coulomb : ContactLaw::unilateral, friction, 0, held.reaction);
  const bool presses = !gone.released, sticks = rubs(held) && presses && !gone.slips;
  const Vec3 now = displaced(held.node), at = to_obstacle(held.obstacle, now);
  if (!sticks) held.anchor = at;
  palpate_obstacle_state& state = states_[held.obstacle];
  if (presses) {
    Vec3 row[3];
    frame_of(held, row);
    const OrganPose& organ = touch_->organ;
    const Vec3 force =
        organ.vector_to_world(-held.reaction.x * row[0] - held.reaction.y * row[1] - held.reaction.z * row[2]);
    store3(load3(state.force) + force, state.force);
    store3(load3(state.torque) + cross(organ.point_to_world(now) - load3(state.position), force), state.torque);
    state.deepest = std::max(state.deepest, -dot(held.normal, at - held.place) - held.overlap);
    ++state.nodes, state.slips += gone.slips;
  }
  held.rubs = presses ? kRubs : std::max(1, held.rubs) - 1;
}

void Obstacles::end(TouchStep& step) {
  for (std::int32_t i = 0; i < count_; ++i) {
    if (at_peace_ >> i & 1) continue;  // its state is that of the step before
    const Pose& pose = moved_[i].pose.pose();
    palpate_obstacle_state& state = states_[i] = palpate_obstacle_state{};
    store3(pose.position, state.position);
    const Quaternion& q = pose.orientation;
    state.orientation[0] = q.w, state.orientation[1] = q.x, state.orientation[2] = q.y, state.orientation[3] = q.z;
  }
  for (std::int32_t k = 0; k < held_count_; ++k) take(step, held_[k]);
  step.unasked += work_.done();
}

}  // namespace palpate
