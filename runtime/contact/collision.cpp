#include "runtime/contact/collision.h"

#include <algorithm>

namespace palpate {
namespace {

// Two faces whose outward normals differ by more than 120 degrees are the two sides of a thin part (cosine).
constexpr double kOppositeFaces = -0.5;
// Radius of the search for the deformed surface around a point, in buckets.
constexpr int kMaxReach = 8;
// No surface point moves farther than this many times the largest imposed displacement (a TRIANGLE contact imposes up to 4/3
// of it on a vertex).
constexpr double kMargin = 1.5;
// An anchor slides by at most this many buckets in one step.
constexpr int kMostSlides = 8;

}  // namespace

bool ContactField::create(SceneMemory& memory, std::int32_t node_capacity, std::int32_t surface_nodes) {
  nodes_ = memory.array<ContactNode>(static_cast<std::size_t>(node_capacity));
  modified_ = memory.array<Vec3>(static_cast<std::size_t>(node_capacity));
  predicted_ = memory.array<Vec3>(static_cast<std::size_t>(node_capacity));
  row_ = memory.array<const void*>(3 * static_cast<std::size_t>(node_capacity));
  coefficient_ = memory.array<double>(3 * static_cast<std::size_t>(node_capacity));
  known_ = memory.array<Vec3>(static_cast<std::size_t>(surface_nodes));
  known_stamp_ = memory.array<std::uint32_t>(static_cast<std::size_t>(surface_nodes));
  surface_nodes_ = surface_nodes;
  return !memory.failed();
}

void ContactField::set(const Tensors& tensors, const ContactConstraints& set, const Vec3* modified,
                       ContactSolver* solver) {
  tensors_ = tensors, solver_ = solver;
  count_ = set.node_count;
  std::copy(set.nodes, set.nodes + count_, nodes_);
  std::copy(modified, modified + count_, modified_);
  for (std::int32_t r = 0; r < 3 * count_ && !tensors.compliance; ++r) {
    const std::int32_t e = r / 3, column = nodes_[e].column, j = r % 3;
    row_[r] = tensors.surface.row(column, j);
    coefficient_[r] = modified[e][j] * static_cast<double>(tensors.surface.row_scale(column, j));
  }
  forget_nodes();
  largest_ = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) largest_ = std::max(largest_, length(set.target[p]));
}

void ContactField::forget_nodes() {
  if (++stamp_ != 0) return;
  std::fill(known_stamp_, known_stamp_ + surface_nodes_, 0u);
  stamp_ = 1;
}

// The nodes of one contact are neighbours in the list.
ContactField::Range ContactField::nodes_of(std::int32_t tool, std::int32_t point) const {
  const auto own = [&](const ContactNode& held) { return held.tool == tool && held.point == point; };
  const ContactNode *end = nodes_ + count_, *first = std::find_if(nodes_, nodes_ + count_, own);
  return {static_cast<std::int32_t>(first - nodes_),
          static_cast<std::int32_t>(std::find_if_not(first, end, own) - nodes_)};
}

void ContactField::drop(std::int32_t tool, std::int32_t point) {
  const Range own = nodes_of(tool, point);
  for (std::int32_t e = own.first; e < own.last; ++e) {
    modified_[e] = Vec3{};
    for (int j = 0; j < 3; ++j) coefficient_[3 * e + j] = 0;
  }
  solver_ = nullptr;
  forget_nodes();
}

bool ContactField::predict_without(std::int32_t tool, std::int32_t point) {
  return solver_ && solver_->predict_without(tool, point, predicted_);
}

Vec3 ContactField::predicted_at_node(std::int32_t node) const {
  Vec3 sum;
  for (std::int32_t e = 0; e < count_; ++e) sum += tensors_.displacement(node, nodes_[e].column) * predicted_[e];
  return is_finite(sum) ? sum : Vec3{};
}

// Displacement of a surface node by the contact nodes first .. last - 1.
Vec3 ContactField::sum(std::int32_t first, std::int32_t last, std::int32_t node) const {
  if (!tensors_.compliance)
    return tensors_.surface.sum_at_node(row_ + 3 * first, coefficient_ + 3 * first, 3 * (last - first), node);
  Vec3 sum;
  for (std::int32_t e = first; e < last; ++e) sum += tensors_.displacement(node, nodes_[e].column) * modified_[e];
  return sum;
}

Vec3 ContactField::at_node(std::int32_t node) {
  if (known_stamp_[node] == stamp_) return known_[node];
  const Vec3 u = sum(0, count_, node);
  known_stamp_[node] = stamp_;
  return known_[node] = is_finite(u) ? u : Vec3{};
}

Vec3 ContactField::at_node_without(std::int32_t node, std::int32_t tool, std::int32_t point) const {
  const Range own = nodes_of(tool, point);
  const Vec3 u = sum(0, own.first, node) + sum(own.last, count_, node);
  return is_finite(u) ? u : Vec3{};
}

void Collision::create(SurfaceIndex* surface, const std::int32_t* triangles, ContactField* field, bool deformed) {
  surface_ = surface, triangles_ = triangles, field_ = field, deformed_ = deformed;
}

template <class AtNode>
Vec3 Collision::at_surface_point(const SurfacePoint& surface_point, AtNode at_node) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v)
    if (surface_point.barycentric[v] != 0)
      sum += surface_point.barycentric[v] * at_node(triangles_[3 * surface_point.triangle + v]);
  return sum;
}

Vec3 Collision::pull_back(const PointState& state, Vec3 p, std::int32_t tool, std::int32_t point) {
  if (!deformed_ || field_->empty()) return p;
  // In contact: against the surface without this contact's part, at its anchor.
  if (state.contact)
    return p - at_surface_point(state.anchor, [&](std::int32_t n) { return field_->at_node_without(n, tool, point); });
  return pull_back_free(p);
}

Vec3 Collision::pull_back_free(Vec3 p) {
  // Farther from the rest surface than any node moves, the point is on the same side of both surfaces.
  const double farthest = kMargin * field_->largest();
  const int reach = std::min(kMaxReach, 1 + static_cast<int>(std::min(1e6, farthest / surface_->bucket_size())));
  double rest_distance = INFINITY;
  surface_->near(p, reach, [&](std::int32_t t) {
    double k[3];
    const Vec3 a = surface_->corner(t, 0), b = surface_->corner(t, 1), c = surface_->corner(t, 2);
    rest_distance = std::min(rest_distance, closest_on_triangle(p, a, b, c, k));
  });
  if (rest_distance > farthest * farthest) return p;

  // Nearer: the nearest point of the deformed surface is among the triangles near p at rest.
  double best = INFINITY;
  Vec3 displacement;
  surface_->near(p, reach, [&](std::int32_t t) {
    const Vec3 a = surface_->corner(t, 0), b = surface_->corner(t, 1), c = surface_->corner(t, 2);
    double k[3];
    const double bound = std::sqrt(closest_on_triangle(p, a, b, c, k)) - farthest;
    if (bound > 0 && bound * bound > best) return;
    const std::int32_t* corner = triangles_ + 3 * t;
    const Vec3 u[3] = {field_->at_node(corner[0]), field_->at_node(corner[1]), field_->at_node(corner[2])};
    const double distance = closest_on_triangle(p, a + u[0], b + u[1], c + u[2], k);
    if (distance >= best) return;
    best = distance;
    displacement = k[0] * u[0] + k[1] * u[1] + k[2] * u[2];
  });
  return p - displacement;
}

void Collision::move(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point, bool hold) {
  Vec3 to = pull_back(state, p, tool, point);
  bool now_inside = surface_->inside(to);
  // The point is outside of the surface as the other contacts' forces deform it. But those forces also overcome this
  // contact's resistance, so they may push the surface away only as long as this contact holds. The contact ends where the
  // other contacts, at their own targets, would take the surface away without it.
  if (state.known && state.contact && deformed_ && !now_inside && !hold && field_->predict_without(tool, point)) {
    to = p - at_surface_point(state.anchor, [&](std::int32_t n) { return field_->predicted_at_node(n); });
    now_inside = surface_->inside(to);
  }
  if (state.known && state.contact) {
    look_for_release(state, state.pulled, to, now_inside, hold);
    // If two contacts could each end because of the other, only the first one ends in this step.
    if (!state.contact && deformed_) field_->drop(tool, point);
  } else if (state.known) {
    look_for_contact(state, state.pulled, to, now_inside);
  }
  state.known = true;
  state.inside = now_inside;
  state.pulled = to;
}

void Collision::begin_contact(PointState& state, const SurfacePoint& surface_point, bool through) {
  state.contact = true;
  state.through = through;
  state.anchor = surface_point;
  state.anchor_at_rest = surface_->position(surface_point);
  state.outward = surface_->outward(surface_point.triangle);
  state.tangent = Vec3{};
}

// The point is pulled back with the whole field, this contact's part included: so it stays beside its anchor even if contacts
// conflict. Without this contact's part it could lie beyond the far side of a thin part, where the nearest surface point is
// somewhere along the rim.
void Collision::follow(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point) {
  if (!deformed_ || field_->empty()) return slide(state, p);
  const Vec3 moved = at_surface_point(state.anchor, [&](std::int32_t n) { return field_->at_node(n); });
  const Vec3 others =
      at_surface_point(state.anchor, [&](std::int32_t n) { return field_->at_node_without(n, tool, point); });
  // Moving the anchor changes this contact's own part of the field, by about own / asked of the way. The anchor therefore goes
  // that much less far; a full step would overshoot and swing.
  const double asked = length(p - state.anchor_at_rest), own = length(moved - others);
  const double share = own > 0 ? asked / (asked + own) : 1;
  slide(state, state.anchor_at_rest + share * (p - moved - state.anchor_at_rest));
}

void Collision::slide(PointState& state, Vec3 p) {
  const auto squared = [](Vec3 v) { return dot(v, v); };
  double best = squared(p - state.anchor_at_rest);
  // Each round searches one bucket around the anchor. Where the anchor moves less than half a bucket, it is the nearest point.
  for (int round = 0; round < kMostSlides; ++round) {
    SurfacePoint surface_point;
    surface_->near(state.anchor_at_rest, 1, [&](std::int32_t t) {
      if (dot(surface_->outward(t), state.outward) < 0) return;
      double k[3];
      const double distance =
          closest_on_triangle(p, surface_->corner(t, 0), surface_->corner(t, 1), surface_->corner(t, 2), k);
      if (distance >= best) return;
      best = distance;
      surface_point.triangle = t;
      std::copy(k, k + 3, surface_point.barycentric);
    });
    if (surface_point.triangle < 0) return;
    const Vec3 from = state.anchor_at_rest;
    state.anchor = surface_point;
    state.anchor_at_rest = surface_->position(surface_point);
    state.outward = surface_->outward(surface_point.triangle);
    if (length(state.anchor_at_rest - from) < 0.5 * surface_->bucket_size()) return;
  }
}

// A contact begins at the last crossing into the organ without a crossing out again; a way out through an opposite face does
// not count, because the point has then gone through a thin part.
void Collision::look_for_contact(PointState& state, Vec3 from, Vec3 to, bool now_inside) {
  Crossing crossing[SurfaceIndex::kMaxCrossings];
  const int count = std::min(surface_->crossings(from, to, crossing), SurfaceIndex::kMaxCrossings);
  int entry = -1;
  bool through = false;
  for (int c = 0; c < count && !through; ++c) {
    if (crossing[c].entering) {
      if (entry < 0) entry = c;
    } else if (entry >= 0) {
      const Vec3 in = surface_->outward(crossing[entry].surface_point.triangle),
                 out = surface_->outward(crossing[c].surface_point.triangle);
      through = dot(in, out) < kOppositeFaces;
      if (!through) entry = -1;
    }
  }
  if (entry >= 0 && (through || now_inside)) return begin_contact(state, crossing[entry].surface_point, through);
  // The point was outside and is inside, so it crossed the surface, although not among the first kMaxCrossings crossings.
  SurfacePoint nearest;
  if (now_inside && !state.inside && nearest_surface_point(to, &nearest)) begin_contact(state, nearest, false);
}

void Collision::look_for_release(PointState& state, Vec3 from, Vec3 to, bool now_inside, bool hold) {
  if (now_inside) {
    state.through = false;
    return;
  }
  if (state.inside) {  // the point has come out in this step: note on which side
    Crossing crossing[SurfaceIndex::kMaxCrossings];
    const int count = std::min(surface_->crossings(from, to, crossing), SurfaceIndex::kMaxCrossings);
    if (count > 0)
      state.through =
          dot(surface_->outward(crossing[count - 1].surface_point.triangle), state.outward) < kOppositeFaces;
  }
  if (hold) return;
  const bool below_its_plane = dot(to - state.anchor_at_rest, state.outward) < 0;
  if (!(state.through && below_its_plane)) state.contact = state.through = false;
}

bool Collision::nearest_surface_point(Vec3 p, SurfacePoint* surface_point) {
  double best = INFINITY;
  for (int reach = 0; reach <= kMaxReach && best == INFINITY; ++reach)
    surface_->near(p, reach, [&](std::int32_t t) {
      double k[3];
      const double distance =
          closest_on_triangle(p, surface_->corner(t, 0), surface_->corner(t, 1), surface_->corner(t, 2), k);
      if (distance >= best) return;
      best = distance;
      surface_point->triangle = t;
      std::copy(k, k + 3, surface_point->barycentric);
    });
  return best < INFINITY;
}

}  // namespace palpate
