#include "runtime/surface/collision.h"

#include <algorithm>

namespace palpate {
namespace {

// Faces whose outward normals differ by more than 120 degrees are the two sides of a thin part.
constexpr double kOppositeFaces = -0.5;
// How far around a point the deformed surface is searched, in buckets.
constexpr int kMaxReach = 8;
// No place moves by more than this many times the largest imposed displacement (alpha_v of a triangle reaches 4/3).
constexpr double kMargin = 1.5;
// How many buckets a place slides in one step at the most.
constexpr int kMostSlides = 8;

}  // namespace

bool ContactField::create(SceneMemory& memory, std::int32_t entry_capacity, std::int32_t surface_nodes) {
  entries_ = memory.array<ContactEntry>(static_cast<std::size_t>(entry_capacity));
  modified_ = memory.array<Vec3>(static_cast<std::size_t>(entry_capacity));
  if_gone_ = memory.array<Vec3>(static_cast<std::size_t>(entry_capacity));
  row_ = memory.array<const void*>(3 * static_cast<std::size_t>(entry_capacity));
  coefficient_ = memory.array<double>(3 * static_cast<std::size_t>(entry_capacity));
  known_ = memory.array<Vec3>(static_cast<std::size_t>(surface_nodes));
  known_stamp_ = memory.array<std::uint32_t>(static_cast<std::size_t>(surface_nodes));
  surface_nodes_ = surface_nodes;
  return !memory.failed();
}

void ContactField::set(const Tensors& tensors, const ContactSet& set, const Vec3* modified, ContactSolver* solver) {
  tensors_ = tensors, solver_ = solver;
  count_ = set.entry_count;
  std::copy(set.entries, set.entries + count_, entries_);
  std::copy(modified, modified + count_, modified_);
  for (std::int32_t r = 0; r < 3 * count_ && !tensors.compliance; ++r) {
    const std::int32_t e = r / 3, column = entries_[e].column, j = r % 3;
    row_[r] = tensors.surface.row(column, j);
    coefficient_[r] = modified[e][j] * static_cast<double>(tensors.surface.row_scale(column, j));
  }
  forget_nodes();
  largest_ = 0;
  for (std::int32_t p = 0; p < set.block_count; ++p) largest_ = std::max(largest_, length(set.target[p]));
}

void ContactField::forget_nodes() {
  if (++stamp_ != 0) return;
  std::fill(known_stamp_, known_stamp_ + surface_nodes_, 0u);
  stamp_ = 1;
}

// The entries of a contact stand together.
ContactField::Range ContactField::entries_of(std::int32_t tool, std::int32_t point) const {
  const auto own = [&](const ContactEntry& entry) { return entry.tool == tool && entry.point == point; };
  const ContactEntry *end = entries_ + count_, *first = std::find_if(entries_, entries_ + count_, own);
  return {static_cast<std::int32_t>(first - entries_),
          static_cast<std::int32_t>(std::find_if_not(first, end, own) - entries_)};
}

void ContactField::drop(std::int32_t tool, std::int32_t point) {
  const Range own = entries_of(tool, point);
  for (std::int32_t e = own.first; e < own.last; ++e) {
    modified_[e] = Vec3{};
    for (int j = 0; j < 3; ++j) coefficient_[3 * e + j] = 0;
  }
  solver_ = nullptr;
  forget_nodes();
}

bool ContactField::let_go(std::int32_t tool, std::int32_t point) {
  return solver_ && solver_->without(tool, point, if_gone_);
}

Vec3 ContactField::at_node_if_gone(std::int32_t node) const {
  Vec3 sum;
  for (std::int32_t e = 0; e < count_; ++e) sum += tensors_.displacement(node, entries_[e].column) * if_gone_[e];
  return is_finite(sum) ? sum : Vec3{};
}

// What entries first .. last - 1 do to a node.
Vec3 ContactField::sum(std::int32_t first, std::int32_t last, std::int32_t node) const {
  if (!tensors_.compliance)
    return tensors_.surface.sum_at_node(row_ + 3 * first, coefficient_ + 3 * first, 3 * (last - first), node);
  Vec3 sum;
  for (std::int32_t e = first; e < last; ++e) sum += tensors_.displacement(node, entries_[e].column) * modified_[e];
  return sum;
}

Vec3 ContactField::at_node(std::int32_t node) {
  if (known_stamp_[node] == stamp_) return known_[node];
  const Vec3 u = sum(0, count_, node);
  known_stamp_[node] = stamp_;
  return known_[node] = is_finite(u) ? u : Vec3{};
}

Vec3 ContactField::at_node_without(std::int32_t node, std::int32_t tool, std::int32_t point) const {
  const Range own = entries_of(tool, point);
  const Vec3 u = sum(0, own.first, node) + sum(own.last, count_, node);
  return is_finite(u) ? u : Vec3{};
}

void Collision::create(SurfaceIndex* surface, const std::int32_t* triangles, ContactField* field, bool deformed) {
  surface_ = surface, triangles_ = triangles, field_ = field, deformed_ = deformed;
}

template <class AtNode>
Vec3 Collision::at_place(const SurfacePlace& place, AtNode at_node) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v)
    if (place.barycentric[v] != 0) sum += place.barycentric[v] * at_node(triangles_[3 * place.triangle + v]);
  return sum;
}

Vec3 Collision::pull_back(const PointState& state, Vec3 p, std::int32_t tool, std::int32_t point) {
  if (!deformed_ || field_->empty()) return p;
  // In contact: against the surface as it would be without this contact, at the place it holds.
  if (state.contact)
    return p - at_place(state.place, [&](std::int32_t n) { return field_->at_node_without(n, tool, point); });
  return pull_back_free(p);
}

Vec3 Collision::pull_back_free(Vec3 p) {
  // Further from the rest surface than any part of it moves, a point stands to both surfaces alike.
  const double farthest = kMargin * field_->largest();
  const int reach = std::min(kMaxReach, 1 + static_cast<int>(std::min(1e6, farthest / surface_->bucket_size())));
  double rest_distance = INFINITY;
  surface_->near(p, reach, [&](std::int32_t t) {
    double k[3];
    const Vec3 a = surface_->corner(t, 0), b = surface_->corner(t, 1), c = surface_->corner(t, 2);
    rest_distance = std::min(rest_distance, closest_on_triangle(p, a, b, c, k));
  });
  if (rest_distance > farthest * farthest) return p;

  // Near: the nearest place of the deformed surface is a place that lies near at rest.
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
  // Outside of where the others' forces bring the surface; but where this contact holds against them, those forces are what it
  // takes to overcome it. It ends where the others' places alone would do.
  if (state.known && state.contact && deformed_ && !now_inside && !hold && field_->let_go(tool, point)) {
    to = p - at_place(state.place, [&](std::int32_t n) { return field_->at_node_if_gone(n); });
    now_inside = surface_->inside(to);
  }
  if (state.known && state.contact) {
    look_for_release(state, state.pulled, to, now_inside, hold);
    // Two contacts that each stand outside of what the other presses down do not both end: without this one the other holds.
    if (!state.contact && deformed_) field_->drop(tool, point);
  } else if (state.known) {
    look_for_contact(state, state.pulled, to, now_inside);
  }
  state.known = true;
  state.inside = now_inside;
  state.pulled = to;
}

void Collision::hold_place(PointState& state, const SurfacePlace& place, bool through) {
  state.contact = true;
  state.through = through;
  state.place = place;
  state.place_at_rest = surface_->at(place);
  state.outward = surface_->outward(place.triangle);
  state.tangent = Vec3{};
}

// Pulled back with all that moves the place, its own contact too, the tool stands beside it however hard contacts conflict.
// Without its own, in a thin part it stands beyond the far side, and what is nearest to it there lies round the rim.
void Collision::follow(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point) {
  if (!deformed_ || field_->empty()) return slide(state, p);
  const Vec3 moved = at_place(state.place, [&](std::int32_t n) { return field_->at_node(n); });
  const Vec3 others = at_place(state.place, [&](std::int32_t n) { return field_->at_node_without(n, tool, point); });
  // What the contact itself does changes along the way, by about as much of the way as it is of what the tool asks for: so
  // much less is gone, or the place would swing.
  const double asked = length(p - state.place_at_rest), own = length(moved - others);
  const double share = own > 0 ? asked / (asked + own) : 1;
  slide(state, state.place_at_rest + share * (p - moved - state.place_at_rest));
}

void Collision::slide(PointState& state, Vec3 p) {
  const auto squared = [](Vec3 v) { return dot(v, v); };
  double best = squared(p - state.place_at_rest);
  // Each round looks a bucket around the place; a place that has not moved that far is the nearest there is.
  for (int round = 0; round < kMostSlides; ++round) {
    SurfacePlace place;
    surface_->near(state.place_at_rest, 1, [&](std::int32_t t) {
      if (dot(surface_->outward(t), state.outward) < 0) return;
      double k[3];
      const double distance =
          closest_on_triangle(p, surface_->corner(t, 0), surface_->corner(t, 1), surface_->corner(t, 2), k);
      if (distance >= best) return;
      best = distance;
      place.triangle = t;
      std::copy(k, k + 3, place.barycentric);
    });
    if (place.triangle < 0) return;
    const Vec3 from = state.place_at_rest;
    state.place = place;
    state.place_at_rest = surface_->at(place);
    state.outward = surface_->outward(place.triangle);
    if (length(state.place_at_rest - from) < 0.5 * surface_->bucket_size()) return;
  }
}

// The place where the motion last went in and did not come out again; going out on the opposite side does not count.
void Collision::look_for_contact(PointState& state, Vec3 from, Vec3 to, bool now_inside) {
  Crossing crossing[SurfaceIndex::kMaxCrossings];
  const int count = std::min(surface_->crossings(from, to, crossing), SurfaceIndex::kMaxCrossings);
  int entry = -1;
  bool through = false;
  for (int c = 0; c < count && !through; ++c) {
    if (crossing[c].entering) {
      if (entry < 0) entry = c;
    } else if (entry >= 0) {
      const Vec3 in = surface_->outward(crossing[entry].place.triangle),
                 out = surface_->outward(crossing[c].place.triangle);
      through = dot(in, out) < kOppositeFaces;
      if (!through) entry = -1;
    }
  }
  if (entry >= 0 && (through || now_inside)) return hold_place(state, crossing[entry].place, through);
  // Inside after having been outside: a crossing was there, even if it is not among the first kMaxCrossings.
  SurfacePlace place;
  if (now_inside && !state.inside && nearest_place(to, &place)) hold_place(state, place, false);
}

void Collision::look_for_release(PointState& state, Vec3 from, Vec3 to, bool now_inside, bool hold) {
  if (now_inside) {
    state.through = false;
    return;
  }
  if (state.inside) {  // just came out: on which side?
    Crossing crossing[SurfaceIndex::kMaxCrossings];
    const int count = std::min(surface_->crossings(from, to, crossing), SurfaceIndex::kMaxCrossings);
    if (count > 0)
      state.through = dot(surface_->outward(crossing[count - 1].place.triangle), state.outward) < kOppositeFaces;
  }
  if (hold) return;
  const bool below_its_plane = dot(to - state.place_at_rest, state.outward) < 0;
  if (!(state.through && below_its_plane)) state.contact = state.through = false;
}

bool Collision::nearest_place(Vec3 p, SurfacePlace* place) {
  double best = INFINITY;
  for (int reach = 0; reach <= kMaxReach && best == INFINITY; ++reach)
    surface_->near(p, reach, [&](std::int32_t t) {
      double k[3];
      const double distance =
          closest_on_triangle(p, surface_->corner(t, 0), surface_->corner(t, 1), surface_->corner(t, 2), k);
      if (distance >= best) return;
      best = distance;
      place->triangle = t;
      std::copy(k, k + 3, place->barycentric);
    });
  return best < INFINITY;
}

}  // namespace palpate
