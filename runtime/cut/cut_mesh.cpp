#include "runtime/cut/cut_mesh.h"

#include <algorithm>

namespace palpate {
namespace {

// Of the time that a tetrahedron is held in balls.
constexpr double kRounding = 1e-9;

}  // namespace

const char* CutMesh::create(SceneMemory& memory, const CutBody& body, std::int32_t reserve) {
  if (const char* const wrong = rest_.create(memory, body)) return wrong;
  if (const char* const wrong = state_.create(memory, rest_)) return wrong;
  const auto tetrahedra = static_cast<std::size_t>(body.tetrahedron_count);
  const auto nodes = static_cast<std::size_t>(body.node_count), all = nodes + static_cast<std::size_t>(reserve);
  capacity_ = body.node_count + reserve, node_count_ = body.node_count;
  nodes_ = memory.array<std::int32_t>(4 * tetrahedra);
  from_ = memory.array<std::int32_t>(all);
  at_rest_ = memory.array<std::int32_t>(all);
  order_ = memory.array<std::uint32_t>(4 * tetrahedra);
  pending_ = memory.array<std::int32_t>(2 * tetrahedra);
  work_.met = memory.array<std::int32_t>(2 * tetrahedra);
  work_.part = memory.array<std::int32_t>(2 * tetrahedra);
  work_.around = memory.array<std::int32_t>(nodes);
  work_.nearness = memory.array<double>(tetrahedra);
  work_.kept = memory.array<std::uint32_t>(all);
  work_.listed = memory.array<std::uint32_t>(nodes);
  work_.place = memory.array<std::int32_t>(tetrahedra);
  for (CutMeshChange::List* const list : {&change_.tetrahedra, &change_.removed_tetrahedra})
    list->items = memory.array<std::int32_t>(tetrahedra);
  change_.lost_nodes.items = memory.array<std::int32_t>(all);
  for (CutMeshChange::List* const list : {&change_.before, &change_.removed_triangles, &change_.renamed_triangles})
    list->items = memory.array<std::int32_t>(4 * tetrahedra);
  if (memory.failed()) return "no memory for a body that can be cut";
  std::copy(body.tetrahedra, body.tetrahedra + 4 * tetrahedra, nodes_);
  for (std::int32_t n = 0; n < body.node_count; ++n) from_[n] = at_rest_[n] = n;
  if (!trial_.create(memory, state_) || !finish_.create(memory, state_, trial_) ||
      !surface_.create(memory, rest_, nodes_) || !pieces_.create(memory, state_) ||
      !search_.create(memory, state_, nodes_, capacity_))
    return "no memory for a body that can be cut";
  memory.keep(node_count_);
  memory.keep(pending_count_);
  memory.keep(met_before_);
  memory.keep_array(nodes_, 4 * tetrahedra);
  memory.keep_array(from_, all, node_count_);
  memory.keep_array(at_rest_, all, node_count_);
  memory.keep_array(order_, 4 * tetrahedra);
  memory.keep_array(pending_, 2 * tetrahedra, pending_count_);
  begin_change();
  return nullptr;
}

void CutMesh::forget() {
  const CutBody& body = rest_.body();
  std::copy(body.tetrahedra, body.tetrahedra + 4 * body.tetrahedron_count, nodes_);
  std::fill(order_, order_ + 4 * body.tetrahedron_count, 0u);
  node_count_ = body.node_count, pending_count_ = 0, met_before_ = 0;
  state_.forget(), finish_.forget_all(), surface_.forget(), pieces_.forget(), search_.forget();
  begin_change();
}

void CutMesh::begin_change() {
  work_.met_count = 0;
  change_.first_node = change_.end_node = node_count_;
  change_.first_triangle = change_.end_triangle = surface_.count();
  change_.first_piece = change_.end_piece = pieces_.count();
  change_.cut_faces = 0, change_.full = false;
  for (CutMeshChange::List* const list : {&change_.tetrahedra, &change_.before, &change_.removed_tetrahedra,
                                          &change_.lost_nodes, &change_.removed_triangles, &change_.renamed_triangles})
    list->count = 0;
}

const CutMeshChange& CutMesh::end_change() {
  forget_pending();
  for (std::int32_t i = 0; i < change_.tetrahedra.count; ++i) {
    const std::int32_t t = change_.tetrahedra[i];
    const auto moved = [&](std::int32_t corner) { return nodes_[corner] != change_.before[4 * i + corner % 4]; };
    for (std::int32_t face = 4 * t; face < 4 * t + 4; ++face) {
      const std::int32_t triangle = surface_.triangle(face);
      if (triangle < 0 || triangle >= change_.first_triangle) continue;
      for (std::int32_t c = 4 * t; c < 4 * t + 4; ++c)
        if (c != face && moved(c)) {
          change_.renamed_triangles.add(triangle);
          break;
        }
    }
  }
  if (has_severed()) pieces_.renumber();
  change_.end_node = node_count_, change_.end_triangle = surface_.count(), change_.end_piece = pieces_.count();
  if (change_.end_piece > change_.first_piece || change_.removed_tetrahedra.count > 0) pieces_.measure();
  return change_;
}

void CutMesh::forget_pending() {
  std::int32_t left = 0;
  for (std::int32_t i = 0; i < pending_count_; ++i)
    if (state_.face(pending_[i]) == FaceState::pending) pending_[left++] = pending_[i];
  pending_count_ = left;
}

// ---- a blade ------------------------------------------------------------------------------------------------------

const CutMeshChange& CutMesh::blade(const BladeSweep& sweep, const double* positions) {
  begin_change();
  for (std::int32_t i = 0; i < sweep.count; ++i)
    if (!is_finite(load3(sweep.from + 3 * i)) || !is_finite(load3(sweep.to + 3 * i))) return end_change();
  if (sweep.count < 2) return end_change();
  search_.passed(sweep, positions, [&](std::int32_t face) { meet(face); });
  cut_met();
  finish_passed(sweep, positions);
  return end_change();
}

const CutMeshChange& CutMesh::cut(const std::int32_t* faces, std::int32_t count) {
  begin_change();
  for (std::int32_t i = 0; i < count; ++i)
    if (state_.closed(faces[i])) meet(trial_.lower_side(faces[i]));
  cut_met();
  return end_change();
}

void CutMesh::meet(std::int32_t face) {
  if (state_.face(face) != FaceState::whole) return;
  state_.set(face, FaceState::pending);
  order_[face] = ++met_before_;
  pending_[pending_count_++] = face;
  work_.met[work_.met_count++] = face;
}

void CutMesh::cut_met() {
  const std::uint32_t begin = trial_.moment();
  for (std::int32_t i = 0; i < work_.met_count; ++i) {
    const std::int32_t face = work_.met[i];
    if (state_.face(face) == FaceState::pending && !trial_.gathered_since(begin, face)) cut_cluster(face);
  }
}

// Cuts what can be cut of the pending faces that hang together with this one.
void CutMesh::cut_cluster(std::int32_t face) {
  const std::int32_t count = trial_.gather(face, FaceState::pending);
  for (std::int32_t i = 0; i < count; ++i) finish_.forget(trial_.gathered()[i]);
  cut_tried(trial_.try_faces(trial_.gathered(), count, order_));
}

void CutMesh::cut_pending_near(std::int32_t tetrahedron, std::uint32_t begin) {
  for (std::int32_t c = 4 * tetrahedron; c < 4 * tetrahedron + 4; ++c)
    for (const std::int32_t corner : rest_.star(rest_.node(c)))
      for (std::int32_t face = 4 * (corner / 4); face < 4 * (corner / 4) + 4; ++face) {
        const std::int32_t lower = trial_.lower_side(face);
        if (face != corner && state_.face(face) == FaceState::pending && !trial_.gathered_since(begin, lower))
          cut_cluster(lower);
      }
}

// Cuts the tried faces, one part that hangs together after another.
void CutMesh::cut_tried(std::int32_t count) {
  for (std::int32_t i = 0; i < count; ++i) {
    if (state_.face(trial_.left()[i]) != FaceState::tried) continue;
    const std::int32_t faces = trial_.gather(trial_.left()[i], FaceState::tried);
    const std::int32_t* const part = work_.part;
    std::copy(trial_.gathered(), trial_.gathered() + faces, work_.part);
    begin_nodes();
    for (std::int32_t f = 0; f < faces; ++f) add_nodes(part[f] / 4, part[f]);
    const bool fits = is_attached(part, faces) && divide();
    for (std::int32_t f = 0; f < faces; ++f) state_.set(part[f], fits ? FaceState::cut : FaceState::pending);
    if (!fits) continue;
    change_.cut_faces += faces;
    for (std::int32_t f = 0; f < faces; ++f) surface_.add(part[f]), surface_.add(rest_.other_side(part[f]));
  }
}

// A cut begins at the surface or at an earlier cut.
bool CutMesh::is_attached(const std::int32_t* faces, std::int32_t count) const {
  for (std::int32_t i = 0; i < count; ++i)
    for (std::int32_t c = 4 * (faces[i] / 4); c < 4 * (faces[i] / 4) + 4; ++c)
      if (c != faces[i] && state_.on_surface(rest_.node(c))) return true;
  return false;
}

// Calls visit(component) for each component at a node at rest that needs a new node: all but the first one of each node there.
template <class Visit>
void CutMesh::each_new_part(std::int32_t node, const Visit& visit) {
  for (const std::int32_t corner : rest_.star(node)) {
    if (state_.gone(corner / 4) || state_.component(corner) != corner) continue;
    const std::int32_t now = nodes_[corner];
    if (work_.kept[now] == work_.pass)
      visit(corner);
    else
      work_.kept[now] = work_.pass;
  }
}

void CutMesh::begin_nodes() {
  ++work_.pass;
  work_.around_count = 0;
}

// Lists the nodes at rest of a tetrahedron, but for that of the corner `except`.
void CutMesh::add_nodes(std::int32_t tetrahedron, std::int32_t except) {
  for (std::int32_t c = 4 * tetrahedron; c < 4 * tetrahedron + 4; ++c) {
    const std::int32_t node = rest_.node(c);
    if (c == except || work_.listed[node] == work_.pass) continue;
    work_.listed[node] = work_.pass;
    work_.around[work_.around_count++] = node;
  }
}

// Gives each component at the listed nodes a node; false where the reserve has not enough. The components must be known.
bool CutMesh::divide() {
  std::int32_t wanted = 0;
  ++work_.pass;
  for (std::int32_t i = 0; i < work_.around_count; ++i) each_new_part(work_.around[i], [&](std::int32_t) { ++wanted; });
  if (wanted > capacity_ - node_count_) {
    change_.full = true;
    return false;
  }
  ++work_.pass;
  for (std::int32_t i = 0; i < work_.around_count; ++i) split_node(work_.around[i]);
  return true;
}

void CutMesh::split_node(std::int32_t node) {
  each_new_part(node, [&](std::int32_t component) {
    from_[node_count_] = nodes_[component], at_rest_[node_count_] = node;
    for (const std::int32_t corner : rest_.star(node))
      if (!state_.gone(corner / 4) && state_.component(corner) == component) change_node(corner, node_count_);
    ++node_count_;
  });
}

void CutMesh::change_node(std::int32_t corner, std::int32_t node) {
  const std::int32_t t = corner / 4;
  const std::int32_t place = work_.place[t];
  if (place >= change_.tetrahedra.count || change_.tetrahedra[place] != t) {
    work_.place[t] = change_.tetrahedra.count;
    change_.tetrahedra.add(t);
    for (std::int32_t c = 4 * t; c < 4 * t + 4; ++c) change_.before.add(nodes_[c]);
  }
  nodes_[corner] = node;
  search_.changed(t);
}

// Finishes what is pending where the sweep does not reach any more.
void CutMesh::finish_passed(const BladeSweep& sweep, const double* positions) {
  const std::int32_t before = pending_count_;
  const std::uint32_t begin = trial_.moment();
  finish_.begin_step();
  // New nodes of this step have no position yet.
  const auto reaches = [&](std::int32_t face) {
    return search_.reaches(sweep, face, positions, from_, change_.first_node);
  };
  for (std::int32_t i = 0; i < before && finish_.has_time(); ++i) {
    const std::int32_t face = pending_[i];
    if (state_.face(face) != FaceState::pending || finish_.is_tried(face) || trial_.gathered_since(begin, face))
      continue;
    if (reaches(face)) continue;
    const std::int32_t count = trial_.gather(face, FaceState::pending);
    const std::int32_t* const faces = trial_.gathered();
    if (std::any_of(faces, faces + count, reaches)) continue;
    if (!finish_.finish(faces, count, order_)) continue;
    for (std::int32_t f = 0; f < finish_.count(); ++f)
      if (finish_.is_new(f)) pending_[pending_count_++] = finish_.face(f);
    const std::uint32_t changed = trial_.moment();
    for (std::int32_t f = 0; f < finish_.count(); ++f)
      if (state_.face(finish_.face(f)) == FaceState::pending && !trial_.gathered_since(changed, finish_.face(f)))
        cut_cluster(finish_.face(f));
  }
}

// Whether something has come apart in this step: the two sides of a face that was cut, or the neighbours of
// the tetrahedra that were removed.
bool CutMesh::has_severed() {
  const auto share_node = [&](std::int32_t one, std::int32_t two) {
    for (int c = 0; c < 16; ++c)
      if (nodes_[4 * one + c / 4] == nodes_[4 * two + c % 4]) return true;
    return false;
  };
  std::int32_t known[2] = {-1, -1};  // a pair that is connected
  for (std::int32_t i = change_.first_triangle; i < surface_.count(); ++i) {
    const std::int32_t face = surface_.face(i), one = face / 4, two = face < 0 ? -1 : rest_.neighbour(face);
    if (two < one || state_.gone(two) || share_node(one, two)) continue;
    if (known[0] >= 0 && share_node(one, known[0]) && share_node(two, known[1])) continue;
    if (!pieces_.connected(one, two)) return true;
    known[0] = one, known[1] = two;
  }
  std::int32_t before = -1;
  for (const std::int32_t t : change_.removed_tetrahedra)
    for (std::int32_t face = 4 * t; face < 4 * t + 4; ++face) {
      const std::int32_t next = rest_.neighbour(face);
      if (next < 0 || state_.gone(next)) continue;
      if (before >= 0 && !share_node(before, next) && !pieces_.connected(before, next)) return true;
      before = next;
    }
  return false;
}

// ---- removal ------------------------------------------------------------------------------------------------------

const CutMeshChange& CutMesh::remove(const std::int32_t* tetrahedra, std::int32_t count) {
  begin_change();
  const std::int32_t removed = trial_.try_removal(tetrahedra, count);
  if (removed == 0) return end_change();
  const std::int32_t* const gone = trial_.left();
  begin_nodes();
  for (std::int32_t i = 0; i < removed; ++i) add_nodes(gone[i], -1);
  if (!divide()) {
    for (std::int32_t i = 0; i < removed; ++i) state_.set_gone(gone[i], false);
    return end_change();
  }
  for (std::int32_t i = 0; i < removed; ++i) take_away(gone[i]);
  lose_nodes(change_.removed_tetrahedra.items, change_.removed_tetrahedra.count);
  const std::uint32_t begin = trial_.moment();
  for (const std::int32_t t : change_.removed_tetrahedra) cut_pending_near(t, begin);
  return end_change();
}

const CutMeshChange& CutMesh::remove_ball(const double centre[3], double radius, const double* positions,
                                          const BallTime& time) {
  std::int32_t found = 0;
  if (is_finite(load3(centre)) && radius > 0)
    search_.inside_ball(load3(centre), radius, positions, [&](std::int32_t tetrahedron, double square) {
      if (time.needed > 0 && (time.of[tetrahedron] += time.held) < time.needed * (1 - kRounding)) return;
      work_.nearness[tetrahedron] = square;
      work_.met[found++] = tetrahedron;
    });
  std::sort(work_.met, work_.met + found, [&](std::int32_t a, std::int32_t b) {
    return work_.nearness[a] != work_.nearness[b] ? work_.nearness[a] < work_.nearness[b] : a < b;
  });
  return remove(work_.met, found);
}

// The tetrahedron is gone: its triangles leave the surface, and the faces of its neighbours are new ones.
void CutMesh::take_away(std::int32_t tetrahedron) {
  for (std::int32_t face = 4 * tetrahedron; face < 4 * tetrahedron + 4; ++face) {
    if (surface_.triangle(face) >= 0) change_.removed_triangles.add(surface_.remove(face));
    const std::int32_t other = rest_.other_side(face);
    if (other < 0) continue;
    if (state_.face(face) == FaceState::pending) state_.set(face, FaceState::whole);
    if (!state_.gone(other / 4) && surface_.triangle(other) < 0) surface_.add(other);
  }
  change_.removed_tetrahedra.add(tetrahedron);
  pieces_.remove(tetrahedron);
}

// Finds the nodes of these tetrahedra that no tetrahedron has any more.
void CutMesh::lose_nodes(const std::int32_t* tetrahedra, std::int32_t count) {
  ++work_.pass;
  for (std::int32_t i = 0; i < count; ++i)
    for (std::int32_t c = 4 * tetrahedra[i]; c < 4 * tetrahedra[i] + 4; ++c) {
      const std::int32_t node = nodes_[c];
      if (work_.kept[node] == work_.pass) continue;
      work_.kept[node] = work_.pass;
      const RestMesh::Star star = rest_.star(rest_.node(c));
      if (std::none_of(star.begin(), star.end(),
                       [&](std::int32_t corner) { return !state_.gone(corner / 4) && nodes_[corner] == node; }))
        change_.lost_nodes.add(node);
    }
}

}  // namespace palpate
