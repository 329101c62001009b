#include "runtime/cut/lips.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "runtime/contact/nearest_few.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// In mean edges: how far along the lips two nodes may be apart and still hold; below which gap a pair asks for a row; how far it goes through
// before the step says so.
constexpr double kAcross = 1.5, kNear = 0.02, kThrough = 0.01;
// The compliance of a row beside that of the mesh, times shear modulus and mean edge. Where three cuts meet, one pair says what two others say; with it all can
// be met. About a hundredth of a node's own.
constexpr double kSoft = 0.005;
// A pair that closes in a step by some way may do so again in the next one; this much of it.
constexpr double kClosesOn = 2;
// Radians, by which the lips turn before a row's normal follows, so that rows at rest stay as they are.
constexpr double kTurned = 9e-4;
// Steps for which a pair that has ceased to press keeps its row.
constexpr std::int64_t kRests = 10;
// How far the faces around a pair reach, in faces: far enough for teeth to cancel, and no farther, so that a curved cut keeps its direction.
constexpr int kRings = 4;
// Pairs for each new node: where three or four cuts meet, a node has as many neighbours.
constexpr std::int32_t kPairsOfNode = 4;
// Operations of a face in a step.
constexpr Operations kOfFace = 40;

}  // namespace

bool Lips::create(SceneMemory& memory, const Source& source) {
  source_ = source, pairs_capacity_ = kPairsOfNode * source.new_nodes;
  const auto pairs = static_cast<std::size_t>(pairs_capacity_), nodes = static_cast<std::size_t>(source.surface_nodes),
             faces = static_cast<std::size_t>(source.faces);
  pairs_ = memory.array<Pair>(pairs), last_ = memory.array<Pair>(pairs), faces_ = memory.array<Face>(faces);
  node_ = memory.array<std::int32_t>(nodes), local_ = memory.array<std::int32_t>(nodes);
  first_pair_ = memory.array<std::int32_t>(nodes), next_pair_ = memory.array<std::int32_t>(pairs);
  held_ = memory.array<std::int32_t>(pairs), constraint_ = memory.array<std::int32_t>(pairs);
  nearness_ = memory.array<double>(pairs);
  place_ = memory.array<Vec3>(nodes), area_ = memory.array<Vec3>(pairs);
  face_area_ = memory.array<Vec3>(faces);
  if (memory.failed()) return false;
  std::fill_n(local_, nodes, -1);
  memory.keep(seen_);
  memory.keep(pair_count_), memory.keep_array(pairs_, pairs, pair_count_);
  memory.keep(face_count_), memory.keep_array(faces_, faces, face_count_);
  memory.keep(node_count_), memory.keep_array(node_, nodes, node_count_);
  return !memory.failed();
}

// ---- the pairs of a cut ----------------------------------------------------------------------------------------------

// A node that the compliance does not have yet is the one from which it comes.
std::int32_t Lips::scene_node(std::int32_t of_mesh) const {
  const std::int32_t made = source_.mesh->state().rest().body().node_count + source_.target->new_nodes();
  while (of_mesh >= made) of_mesh = source_.mesh->from(of_mesh);
  return source_.number[of_mesh];
}

std::int32_t Lips::local(std::int32_t node) {
  if (local_[node] < 0) {
    first_pair_[node_count_] = -1;
    local_[node] = node_count_, node_[node_count_++] = node;
  }
  return local_[node];
}

// -1: there is no room.
std::int32_t Lips::pair_of(std::int32_t a, std::int32_t b) {
  std::int32_t* at = &first_pair_[a];
  for (; *at >= 0; at = &next_pair_[*at])
    if (pairs_[*at].at_b == b) return *at;
  if (pair_count_ == pairs_capacity_) return -1;
  Pair& made = pairs_[pair_count_] = Pair{};
  made.a = node_[a], made.b = node_[b], made.at_a = a, made.at_b = b;
  *at = pair_count_, next_pair_[pair_count_] = -1;
  return pair_count_++;
}

// Corners are across from one another where they lie at one node of the body at rest.
void Lips::add_face(std::int32_t triangle, std::int32_t other) {
  std::int32_t a[3], b[3];
  source_.mesh->surface().nodes(triangle, a), source_.mesh->surface().nodes(other, b);
  Face& face = faces_[face_count_];
  for (int c = 0; c < 3; ++c) {
    int across = 0;
    while (across < 2 && source_.mesh->at_rest(b[across]) != source_.mesh->at_rest(a[c])) ++across;
    const std::int32_t node_a = scene_node(a[c]), node_b = scene_node(b[across]);
    if (node_a >= source_.surface_nodes || node_b >= source_.surface_nodes) return;
    face.a[c] = local(node_a), face.b[c] = local(node_b);
    face.sign[c] = node_a < node_b ? 1 : -1;
    face.pair[c] = node_a == node_b  ? -1
                   : node_a < node_b ? pair_of(face.a[c], face.b[c])
                                     : pair_of(face.b[c], face.a[c]);
  }
  ++face_count_;
}

// By insertion, which is little code: for the few hundred pairs of a long cut as much work as a change of its compliance.
void Lips::order_pairs() {
  const auto earlier = [](const Pair& x, const Pair& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); };
  for (std::int32_t p = 0; p < pair_count_; ++p) next_pair_[p] = p;
  for (std::int32_t p = 1; p < pair_count_; ++p) {
    const Pair pair = pairs_[p];
    const std::int32_t was = next_pair_[p];
    std::int32_t at = p;
    for (; at > 0 && earlier(pair, pairs_[at - 1]); --at)
      pairs_[at] = pairs_[at - 1], next_pair_[at] = next_pair_[at - 1];
    pairs_[at] = pair, next_pair_[at] = was;
  }
  for (std::int32_t p = 0; p < pair_count_; ++p) held_[next_pair_[p]] = p;
  for (std::int32_t f = 0; f < face_count_; ++f)
    for (std::int32_t& pair : faces_[f].pair) pair = pair < 0 ? -1 : held_[pair];
}

// Pairs that were there before go on as they were.
void Lips::rebuild() {
  const std::int32_t before = pair_count_;
  std::swap(pairs_, last_);
  pair_count_ = face_count_ = node_count_ = 0;
  const RestMesh& rest = source_.mesh->state().rest();
  const CutSurface& surface = source_.mesh->surface();
  for (std::int32_t t = rest.body().triangle_count; t < surface.count(); ++t) {
    const std::int32_t face = surface.face(t), other = surface.other_lip(t);
    // Of the two sides one begins.
    if (face >= 0 && other >= 0 && face < rest.other_side(face) && face_count_ < source_.faces) add_face(t, other);
  }
  order_pairs();
  for (std::int32_t p = 0, old = 0; p < pair_count_; ++p) {
    Pair& pair = pairs_[p];
    while (old < before && std::tie(last_[old].a, last_[old].b) < std::tie(pair.a, pair.b)) ++old;
    if (old == before || last_[old].a != pair.a || last_[old].b != pair.b) {
      // A node that was divided once more has been inside the other lip as far as it was before.
      for (std::int32_t q = 0; q < before; ++q)
        if (last_[q].a == pair.a || last_[q].b == pair.b || last_[q].a == pair.b || last_[q].b == pair.a)
          pair.overlap = std::max(pair.overlap, last_[q].overlap);
      continue;
    }
    pair.rests = last_[old].rests, pair.normal = last_[old].normal;
    pair.gap = last_[old].gap, pair.overlap = last_[old].overlap;
  }
  for (std::int32_t k = 0; k < node_count_; ++k) local_[node_[k]] = -1;
  seen_ = source_.told->surface;
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// area_: of each pair, of the faces within kRings rings, those near it more often than the others; from b's lip to a's.
void Lips::find_normals() {
  const auto vector_area = [&](const std::int32_t corner[3]) {
    return cross(place_[corner[1]] - place_[corner[0]], place_[corner[2]] - place_[corner[0]]);
  };
  for (std::int32_t f = 0; f < face_count_; ++f)
    face_area_[f] = -1.0 * (vector_area(faces_[f].a) + vector_area(faces_[f].b));
  for (int ring = 0; ring < kRings; ++ring) {
    for (std::int32_t f = 0; ring > 0 && f < face_count_; ++f) {
      face_area_[f] = {};
      for (int c = 0; c < 3; ++c)
        if (const std::int32_t pair = faces_[f].pair[c]; pair >= 0) face_area_[f] += faces_[f].sign[c] * area_[pair];
    }
    std::fill_n(area_, pair_count_, Vec3{});
    for (std::int32_t f = 0; f < face_count_; ++f)
      for (int c = 0; c < 3; ++c)
        if (const std::int32_t pair = faces_[f].pair[c]; pair >= 0) area_[pair] += faces_[f].sign[c] * face_area_[f];
  }
}

// Whether the pair asks for a row.
bool Lips::measure(Pair& pair, const Vec3& area) const {
  const double edge = source_.touch->tree.mean_edge(), size = length(area);
  if (!(size > 0) || !std::isfinite(size)) return false;
  const Vec3 normal = (1 / size) * area;
  if (length(normal - pair.normal) > kTurned) pair.normal = normal;  // that of a new pair is zero
  const Vec3 apart = place_[pair.at_a] - place_[pair.at_b];
  const double gap = dot(pair.normal, apart), inside = std::max(0.0, -gap), closed = std::max(0.0, pair.gap - gap);
  const bool across = length(apart - gap * pair.normal) <= kAcross * edge;
  pair.overlap = across ? std::min(pair.overlap, inside) : inside;
  pair.gap = gap;
  if (!across) pair.rests = 0;
  return across && (pair.rests > 0 || gap + pair.overlap < kNear * edge + kClosesOn * closed);
}

// Where there are more pairs than rows, those that have pressed stay, and of the others the nearest.
std::uint32_t Lips::keep_nearest() {
  if (held_count_ <= source_.most) return 0;
  std::int32_t kept = 0;
  const double beyond = visit_nearest(
      held_count_, source_.most,
      [&](std::int32_t k) {
        const Pair& pair = pairs_[held_[k]];
        return pair.rests == kRests ? -HUGE_VAL : pair.gap + pair.overlap;
      },
      nearness_,
      [&](std::int32_t k, bool stays) {
        if (stays) held_[kept++] = held_[k];
      });
  held_count_ = kept;
  // One that is left out has no force, and matters where it goes through.
  return beyond < -kThrough * source_.touch->tree.mean_edge() ? PALPATE_STEP_CONTACTS_DROPPED : 0;
}

std::int32_t Lips::begin(TouchStep& step) {
  held_count_ = 0, work_ = {};
  if (seen_ != source_.told->surface) rebuild();
  SurfaceField& field = *source_.touch->field;
  if (face_count_ == 0 || field.empty()) return 0;
  for (std::int32_t k = 0; k < node_count_; ++k)
    place_[k] = source_.touch->surface.place(node_[k]) + field.at_node(node_[k], &work_);
  find_normals();
  for (std::int32_t p = 0; p < pair_count_; ++p)
    if (measure(pairs_[p], area_[p])) held_[held_count_++] = p;
  step.flags |= keep_nearest();
  return held_count_;
}

void Lips::request(TouchStep& step) {
  TouchState& touch = *source_.touch;
  for (std::int32_t k = 0; k < held_count_; ++k) {
    const Pair& pair = pairs_[held_[k]];
    std::int32_t node[2];
    double weight[2];
    RowWish wish({{kLipSource, pair.a, pair.b}, 0});
    wish.node = node, wish.weight = weight;
    for (const auto& [n, sign] : {std::pair{pair.a, 1.0}, std::pair{pair.b, -1.0}})
      if (touch.surface.column_of_node[n] >= 0) node[wish.count] = n, weight[wish.count++] = sign;
    constraint_[k] = -1;
    if (wish.count == 0) continue;
    const Vec3 along = across(pair.normal, {}), row[3] = {pair.normal, along, cross(pair.normal, along)};
    wish.set_frame(row);
    wish.rows.law = ContactLaw::unilateral, wish.rows.axes = 1;
    wish.rows.local.m[0][0] = kSoft / (source_.shear * touch.tree.mean_edge());
    wish.target = {-pair.overlap, 0, 0};
    constraint_[k] = touch.rows.add(&wish, 1);
    bool deferred = false;
    if (constraint_[k] < 0)
      step.flags |= PALPATE_STEP_CONTACTS_DROPPED;
    else if (!touch.admission.admit(constraint_[k], false, &deferred))
      constraint_[k] = -1;
    if (deferred) step.flags |= PALPATE_STEP_WORK_DEFERRED;
  }
}

void Lips::end(TouchStep& step) {
  for (std::int32_t k = 0; k < held_count_; ++k) {
    Pair& pair = pairs_[held_[k]];
    const double push = constraint_[k] >= 0 && step.is_solved ? step.reaction(constraint_[k]).x : 0;
    pair.rests = push > 0 ? kRests : std::max<std::int64_t>(1, pair.rests) - 1;
  }
  step.unasked += work_.done() + kOfFace * face_count_;
}

}  // namespace palpate
