#include "runtime/cut/blades.h"

#include <algorithm>

#include "runtime/contact/contact_patch.h"
#include "runtime/contact/contact_rows.h"

namespace palpate {
namespace {

// A walk from one tetrahedron to the next one towards a point ends behind so many, where the mesh has been turned over.
constexpr int kMostWalked = 200;
// A point belongs to a tetrahedron if none of its weights is below this.
constexpr double kInside = -1e-9;
// What the mesh does not resolve of the field around a line of forces, times G L: a third of that around a thin shaft, ln(R / r) = 1 (runtime/needles).
// Chosen, not fitted.
constexpr double kUnresolved = 0.05;
// Of a reaction at its limit.
constexpr double kRounding = 1e-9;

// Six times the signed volume.
double volume(const Vec3 x[4]) {
  return dot(cross(x[1] - x[0], x[2] - x[0]), x[3] - x[0]);
}

}  // namespace

void Blades::create(SceneMemory& memory, const std::uint8_t* can_hold, const HyperelasticBody* body,
                    std::int32_t points) {
  can_hold_ = can_hold, body_ = body, points_ = std::clamp(points, 2, PALPATE_MAX_BLADE_POINTS);
  memory.keep(blades_), memory.keep(turn_);
  forget();
}

void Blades::forget() {
  std::fill(blades_, blades_ + PALPATE_MAX_BLADES, Blade{});
  turn_ = 0;
}

void Blades::set(std::int32_t blade, const palpate_blade& now) {
  Blade& of = blades_[blade];
  const bool is_held = now.toughness > 0 && now.point_count > 0;
  const std::int32_t count = is_held ? points_ : now.point_count;
  if (count != of.count || now.point_count != of.given) {
    of = {};
    of.is_new = 1;
  }
  of.count = count, of.given = now.point_count;
  of.toughness = now.toughness, of.friction = now.friction, of.width = now.width;
  std::copy_n(now.direction, 3, of.sent_direction);
  if (is_held)
    divide_line(now, of);
  else
    for (std::int32_t i = 0; i < of.count; ++i) std::copy_n(now.points + 3 * i, 3, of.points[i].sent);
}

// Points at equal distances along the line.
void Blades::divide_line(const palpate_blade& given, Blade& blade) {
  const auto at = [&](std::int32_t i) { return load3(given.points + 3 * i); };
  double whole = 0;
  for (std::int32_t i = 0; i + 1 < given.point_count; ++i) whole += length(at(i + 1) - at(i));
  std::int32_t segment = 0;
  double before = 0;  // m, to the segment's begin
  for (std::int32_t i = 0; i < blade.count; ++i) {
    const double wanted = whole * i / (blade.count - 1);
    double own = length(at(segment + 1) - at(segment));
    while (segment + 2 < given.point_count && before + own < wanted) {
      before += own, ++segment;
      own = length(at(segment + 1) - at(segment));
    }
    const double share = own > 0 ? std::clamp((wanted - before) / own, 0.0, 1.0) : 0;
    store3((1 - share) * at(segment) + share * at(segment + 1), blade.points[i].sent);
  }
}

bool Blades::are_there() const {
  return std::any_of(blades_, blades_ + PALPATE_MAX_BLADES, [](const Blade& blade) { return blade.count > 0; });
}

// ---- places ----------------------------------------------------------------------------------------------------------

Vec3 Blades::position(const Place& place, const PlacedMesh& mesh) {
  if (place.tetrahedron < 0) return load3(place.at);
  Vec3 sum;
  for (int c = 0; c < 4; ++c) sum += place.weight[c] * mesh.corner(4 * place.tetrahedron + c);
  return sum;
}

// At the node that is nearest. Cost: a pass over the nodes.
std::int32_t Blades::nearest_tetrahedron(Vec3 p, const PlacedMesh& mesh) {
  std::int32_t nearest = 0;
  double least = INFINITY;
  for (std::int32_t n = 0; n < mesh.rest->body().node_count; ++n) {
    const Vec3 away = load3(mesh.position + 3 * static_cast<std::size_t>(n)) - p;
    if (!(dot(away, away) < least)) continue;
    const RestMesh::Star star = mesh.rest->star(n);
    if (star.first != star.last) least = dot(away, away), nearest = *star.first / 4;
  }
  return nearest;
}

// Walks across the face that the point is farthest behind. A walk that leaves the mesh ends outside: a point in a hollow between two parts may be
// taken for one outside, which then does not go along with the tissue.
Blades::Place Blades::locate(Vec3 p, std::int32_t begin, const PlacedMesh& mesh) {
  Place place = {-1, 0, {}, {p.x, p.y, p.z}};
  std::int32_t at = begin >= 0 ? begin : nearest_tetrahedron(p, mesh);
  for (int walked = 0; at >= 0 && walked < kMostWalked; ++walked) {
    Vec3 x[4];
    for (int c = 0; c < 4; ++c) x[c] = mesh.corner(4 * at + c);
    const double whole = volume(x);
    if (!(whole != 0)) return place;
    int worst = 0;
    for (int c = 0; c < 4; ++c) {
      const Vec3 corner = x[c];
      x[c] = p;
      place.weight[c] = volume(x) / whole;
      x[c] = corner;
      if (place.weight[c] < place.weight[worst]) worst = c;
    }
    if (place.weight[worst] >= kInside) {
      place.tetrahedron = at;
      return place;
    }
    at = mesh.rest->neighbour(4 * at + worst);
  }
  return place;
}

bool Blades::can_hold(const Place& place, const PlacedMesh& mesh) const {
  if (place.tetrahedron < 0) return false;
  const std::int32_t* const corner = mesh.rest->nodes_of(place.tetrahedron);
  return std::all_of(corner, corner + 4, [&](std::int32_t n) { return can_hold_[n] != 0; });
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// The direction, the edge and the normal of the blade's plane at a point: orthogonal.
Blades::Frame Blades::frame_of(const Blade& blade, std::int32_t i) {
  const Vec3 edge = now(blade.points[std::min(i + 1, blade.count - 1)]) - now(blade.points[std::max(i - 1, 0)]);
  Frame frame;
  frame.direction = unit_or_zero(load3(blade.direction));
  frame.across = unit_or_zero(cross(frame.direction, edge));
  if (is_zero(frame.across)) frame.across = palpate::across(frame.direction, {});
  frame.along = cross(frame.across, frame.direction);
  return frame;
}

// Of the last step: what its rows missed beyond their limits; where there is no friction, what the edge has gone back, and all of it along itself.
void Blades::go_on(Blade& blade, std::int32_t i, const PlacedMesh& mesh) {
  Point& point = blade.points[i];
  if (point.edge.tetrahedron < 0) return;
  const Frame frame = frame_of(blade, i);
  const Vec3 at = position(point.edge, mesh), way = now(point) - at;
  const double friction = point.friction, cutting = blade.toughness * point.length;
  const auto is_at = [](double force, double limit) { return force >= limit * (1 - kRounding); };
  const auto missed = [&](const Row& row, Vec3 axis) { return dot(way, axis) - row.gives_way; };
  const double ahead = missed(point.cuts, frame.direction),
               back = friction > 0 ? missed(point.rubs, frame.direction) : ahead,
               aside = missed(point.holds, frame.along);
  const bool cuts = ahead > 0 && is_at(point.cuts.force, cutting) && is_at(point.rubs.force, friction),
             returns = back < 0 && is_at(-point.rubs.force, friction),
             slides = friction == 0 || is_at(aside > 0 ? point.holds.force : -point.holds.force, friction);
  const double on = cuts ? ahead : returns ? back : 0, along = slides ? aside : 0;
  if (cuts) {
    blade.state.work += cutting * on, blade.state.area += point.length * on;
    ++blade.state.cuts;
  }
  blade.state.friction_work += friction * (std::fabs(on) + std::fabs(along));
  point.depth = std::max(0.0, point.depth + on);
  point.edge = locate(at + along * frame.along + on * frame.direction, point.edge.tetrahedron, mesh);
}

// m: half of the way to the next point on either side.
void Blades::measure(Blade& blade) {
  for (std::int32_t i = 0; i < blade.count; ++i) blade.points[i].length = 0;
  for (std::int32_t i = 0; i + 1 < blade.count; ++i) {
    const double half = 0.5 * length(now(blade.points[i + 1]) - now(blade.points[i]));
    blade.points[i].length += half, blade.points[i + 1].length += half;
  }
}

void Blades::begin_step(const PlacedMesh& mesh, const OrganPose& organ) {
  asked_ = 0;
  for (Blade& blade : blades_) {
    if (blade.count == 0) continue;
    blade.state.cuts = 0;
    for (std::int32_t i = 0; i < blade.count && is_felt(blade) && !blade.is_new; ++i) go_on(blade, i, mesh);
    for (std::int32_t i = 0; i < blade.count; ++i)
      store3(organ.point_to_organ(load3(blade.points[i].sent)), blade.points[i].now);
    store3(organ.vector_to_organ(load3(blade.sent_direction)), blade.direction);
    measure(blade);
    for (std::int32_t i = 0; i < blade.count; ++i) {
      Point& point = blade.points[i];
      const std::int32_t begin = blade.is_new ? -1 : point.edge.tetrahedron;
      if (begin < 0) point.depth = 0;
      if (!is_felt(blade) || begin < 0) point.edge = locate(now(point), begin, mesh);
      if (blade.is_new) point.cut = point.edge;
    }
    blade.is_new = 0;
  }
}

std::int32_t Blades::next() {
  for (; asked_ < PALPATE_MAX_BLADES; ++asked_) {
    const std::int32_t blade = turn_;
    turn_ = (turn_ + 1) % PALPATE_MAX_BLADES;
    if (blades_[blade].count == 0) continue;
    ++asked_;
    return blade;
  }
  return -1;
}

BladeSweep Blades::sweep(std::int32_t blade, const PlacedMesh& mesh) {
  const Blade& of = blades_[blade];
  for (std::int32_t i = 0; i < of.count; ++i) {
    store3(position(of.points[i].cut, mesh), line_[0][i]);
    store3(position(of.points[i].edge, mesh), line_[1][i]);
  }
  return {line_[0][0], line_[1][0], of.count};
}

void Blades::followed(std::int32_t blade) {
  Blade& of = blades_[blade];
  for (std::int32_t i = 0; i < of.count; ++i) of.points[i].cut = of.points[i].edge;
}

// ---- rows ------------------------------------------------------------------------------------------------------------

std::int32_t Blades::constraints() const {
  std::int32_t count = 0;
  for (const Blade& blade : blades_)
    for (std::int32_t i = 0; i < blade.count && is_felt(blade); ++i)
      count += (blade.friction > 0 ? kRowsOfPoint : kRowsOfPoint - 1) * (blade.points[i].edge.tetrahedron >= 0);
  return count;
}

void Blades::request(TouchStep& step, const PlacedMesh& mesh) {
  TouchState& touch = *step.state;
  for (std::int32_t b = 0; b < PALPATE_MAX_BLADES; ++b) {
    Blade& blade = blades_[b];
    for (std::int32_t i = 0; i < blade.count; ++i) {
      Point& point = blade.points[i];
      for (Row* row : {&point.cuts, &point.rubs, &point.holds}) row->constraint = -1;
      point.friction = 0;
      if (!is_felt(blade) || !can_hold(point.edge, mesh)) continue;
      // A node that is held moves nowhere: the rows are of the others.
      std::int32_t node[4];
      double weight[4];
      Vec3 rest;
      RowWish wish({{kBladeSource, b, i}, 0});
      wish.node = node, wish.weight = weight;
      for (int c = 0; c < 4; ++c) {
        const std::int32_t n = mesh.scene_node[mesh.nodes[4 * point.edge.tetrahedron + c]];
        rest += point.edge.weight[c] * touch.surface.place(n);
        if (touch.surface.column_of_node[n] >= 0) node[wish.count] = n, weight[wish.count++] = point.edge.weight[c];
      }
      if (wish.count == 0) continue;
      add_rows(step, blade, i, body_->laws[body_->region[point.edge.tetrahedron]].shear, now(point) - rest, &wish);
    }
  }
}

// wish: with its nodes, for each row in turn. way: from where the edge is at rest.
void Blades::add_rows(TouchStep& step, Blade& blade, std::int32_t i, double shear, Vec3 way, RowWish* wish) {
  TouchState& touch = *step.state;
  Point& point = blade.points[i];
  const Frame frame = frame_of(blade, i);
  const double cutting = blade.toughness * point.length,
               friction = 2 * blade.friction * point.length * std::min(blade.width, point.depth);
  const auto add = [&](Row* row, std::uint32_t axes, ContactLaw law, double limit, double share) {
    const Vec3 ahead[3] = {frame.direction, frame.across, frame.along},
               aside[3] = {frame.along, frame.across, frame.direction};
    const Vec3* const axis = row == &point.holds ? aside : ahead;
    wish->set_frame(axis);
    for (int d = 0; d < 3; ++d) wish->target[d] = dot(way, axis[d]);
    for (int d = 0; d < 3; ++d) wish->rows.local.m[d][d] = kUnresolved / (shear * point.length) * share;
    wish->rows.axes = axes, wish->rows.law = law, wish->rows.limit = limit;
    row->constraint = touch.rows.add(wish, 1);
    ++wish->rows.id.part;
    if (row->constraint >= 0 && !touch.solver.matrix().holds(touch.rows.set(), row->constraint)) touch.admission.pay();
    return row->constraint >= 0;
  };
  const bool are_made =
      add(&point.holds, friction > 0 ? 3 : 2, ContactLaw::sticking, friction, 1) &&
      add(&point.cuts, 1, ContactLaw::unilateral, cutting, (cutting + friction) / cutting) &&
      (friction == 0 || add(&point.rubs, 1, ContactLaw::sticking, friction, (cutting + friction) / friction));
  if (are_made)
    point.friction = friction;
  else
    step.flags |= PALPATE_STEP_CONTACTS_DROPPED;
}

void Blades::take_reactions(const TouchStep& step, bool solved) {
  const OrganPose& organ = step.state->organ;
  for (Blade& blade : blades_) {
    Vec3 force, torque;
    blade.state.in_tissue = 0;
    for (std::int32_t i = 0; i < blade.count; ++i) {
      Point& point = blade.points[i];
      blade.state.in_tissue += point.edge.tetrahedron >= 0;
      for (Row* row : {&point.cuts, &point.rubs, &point.holds}) {
        row->force = row->gives_way = 0;
        if (row->constraint < 0 || !solved) continue;
        row->force = step.reaction(row->constraint).x;
        row->gives_way = step.acting->constraints[row->constraint].local.m[0][0] * row->force;
      }
      if (point.cuts.constraint < 0 || !solved) continue;
      const Frame frame = frame_of(blade, i);
      const Vec3 f = (point.cuts.force + point.rubs.force) * frame.direction + point.holds.force * frame.along +
                     step.reaction(point.holds.constraint).y * frame.across;
      force = force - f, torque = torque - cross(now(point) - now(blade.points[0]), f);
    }
    store3(organ.vector_to_world(force), blade.state.force);
    store3(organ.vector_to_world(torque), blade.state.torque);
  }
}

}  // namespace palpate
