#include "runtime/cut/cut_trial.h"

#include <algorithm>

namespace palpate {

bool CutTrial::create(SceneMemory& memory, CutState& state) {
  state_ = &state;
  const auto tetrahedra = static_cast<std::size_t>(state.rest().tetrahedra());
  const auto nodes = static_cast<std::size_t>(state.rest().body().node_count);
  gathered_ = memory.array<std::int32_t>(2 * tetrahedra);
  items_ = memory.array<std::int32_t>(2 * tetrahedra);
  faults_ = memory.array<std::uint8_t>(2 * tetrahedra);
  seen_face_ = memory.array<std::uint32_t>(4 * tetrahedra);
  seen_node_ = memory.array<std::uint32_t>(nodes);
  changed_ = memory.array<std::uint32_t>(nodes);
  return !memory.failed();
}

std::int32_t CutTrial::gather(std::int32_t face, FaceState state) {
  const RestMesh& rest = state_->rest();
  const std::uint32_t pass = ++pass_;
  std::int32_t count = 0;
  gathered_[count++] = lower_side(face);
  seen_face_[gathered_[0]] = pass;
  for (std::int32_t i = 0; i < count; ++i) {
    const std::int32_t from = gathered_[i];
    for (std::int32_t c = 4 * (from / 4); c < 4 * (from / 4) + 4; ++c) {
      const std::int32_t node = rest.node(c);
      if (c == from || seen_node_[node] == pass) continue;
      seen_node_[node] = pass;
      for (const std::int32_t corner : rest.star(node)) {
        ++work_;
        const std::int32_t begin = corner - corner % 4;
        for (std::int32_t f = begin; f < begin + 4; ++f) {
          if (f == corner || state_->face(f) != state || rest.neighbour(f) < f / 4 || seen_face_[f] == pass) continue;
          seen_face_[f] = pass;
          gathered_[count++] = f;
        }
      }
    }
  }
  return count;
}

// The nodes of a face (an item of 0 or more), or of a tetrahedron (-1 - tetrahedron).
template <class Visit>
void CutTrial::each_node(std::int32_t item, const Visit& visit) const {
  const std::int32_t tetrahedron = item < 0 ? -1 - item : item / 4;
  for (std::int32_t c = 4 * tetrahedron; c < 4 * tetrahedron + 4; ++c)
    if (c != item) visit(state_->rest().node(c));
}

void CutTrial::know(std::int32_t node) {
  const RestMesh::Star star = state_->rest().star(node);
  work_ += star.last - star.first;
  state_->find_components(node);
}

std::int32_t CutTrial::face_fault(std::int32_t face) {
  const RestMesh& rest = state_->rest();
  const std::int32_t begin = 4 * (face / 4), beyond = rest.neighbour(face);
  std::int32_t divided = 0;
  bool fans = false;
  for (std::int32_t c = begin; c < begin + 4; ++c) {
    if (c == face) continue;
    const std::int32_t one = state_->component(c), two = state_->component(rest.corner_at(beyond, rest.node(c)));
    divided += one != two;
    fans = fans || state_->has_fans(one) || state_->has_fans(two);
  }
  // A face whose two sides have the same nodes would be a pocket without an inside.
  return divided == 0 || fans || state_->face_has_shared_edge(face) ? 1 + divided : 0;
}

std::int32_t CutTrial::removal_fault(std::int32_t tetrahedron) {
  const RestMesh& rest = state_->rest();
  const std::int32_t* const nodes = rest.nodes_of(tetrahedron);
  for (int c = 0; c < 4; ++c)
    for (const std::int32_t corner : rest.star(nodes[c]))
      if (!state_->gone(corner / 4) && state_->has_fans(state_->component(corner))) return 1;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < a; ++b) {
      int away = 0;
      while (away == a || away == b) ++away;
      if (state_->edge_is_shared(tetrahedron, nodes[a], nodes[b], nodes[away])) return 1;
    }
  return 0;
}

// The faults of all items, those anew that have a node where something changed in the last pass.
void CutTrial::find_faults(bool removal, std::int32_t* least) {
  *least = 0;
  for (std::int32_t i = 0; i < count_; ++i) {
    bool again = false;
    each_node(items_[i], [&](std::int32_t node) { again = again || changed_[node] == pass_; });
    if (again) faults_[i] = static_cast<std::uint8_t>(removal ? removal_fault(-1 - items_[i]) : face_fault(items_[i]));
    if (faults_[i] > 0 && (*least == 0 || faults_[i] < *least)) *least = faults_[i];
  }
}

// Takes back the faces that divide nothing, or of those with the least fault one at a place, the last ones first. Returns how many are left.
std::int32_t CutTrial::take_back(bool removal, std::int32_t least) {
  const std::uint32_t pass = ++pass_;
  const bool all = !removal && least == 1;
  // The items are in the order in which they came.
  for (std::int32_t i = count_ - 1; i >= 0; --i) {
    if (faults_[i] != least) continue;
    bool near = false;
    each_node(items_[i], [&](std::int32_t node) { near = near || changed_[node] == pass; });
    if (near && !all) continue;
    each_node(items_[i], [&](std::int32_t node) { changed_[node] = pass; });
    if (removal)
      state_->set_gone(-1 - items_[i], false);
    else
      state_->set(items_[i], FaceState::pending);
    faults_[i] = 255;
  }
  std::int32_t left = 0;
  for (std::int32_t i = 0; i < count_; ++i) {
    if (faults_[i] == 255)
      each_node(items_[i], [&](std::int32_t node) {
        if (seen_node_[node] != pass) know(node);
        seen_node_[node] = pass;
      });
    else
      items_[left] = items_[i], faults_[left] = faults_[i], ++left;
  }
  return left;
}

void CutTrial::note_faulty(bool removal) {
  faulty_count_ = group_count_ = 0;
  const RestMesh& rest = state_->rest();
  for (std::int32_t i = 0; i < count_ && !removal && faulty_count_ < kMostFaulty; ++i) {
    const std::int32_t face = items_[i], beyond = rest.neighbour(face);
    if (faults_[i] == 0) continue;
    faulty_[faulty_count_++] = face;
    for (std::int32_t c = 4 * (face / 4); c < 4 * (face / 4) + 4; ++c) {
      if (c == face) continue;
      const std::int32_t other = rest.corner_at(beyond, rest.node(c));
      const bool one_has = state_->has_fans(state_->component(c)), two_has = state_->has_fans(state_->component(other));
      if (one_has && !two_has) note_group(other);
      if (two_has && !one_has) note_group(c);
    }
  }
}

void CutTrial::note_group(std::int32_t corner) {
  const std::int32_t component = state_->component(corner);
  for (std::int32_t i = 0; i < group_count_; ++i)
    if (groups_[i].component == component) return;
  if (group_count_ == kMostGroups) return;
  Group& group = groups_[group_count_];
  group.component = component, group.count = 0;
  for (const std::int32_t at : state_->rest().star(state_->rest().node(corner))) {
    if (state_->gone(at / 4) || state_->component(at) != component) continue;
    if (group.count == Group::kMost) return;
    group.tetrahedra[group.count++] = at / 4;
  }
  ++group_count_;
}

std::int32_t CutTrial::settle(bool removal) {
  const std::uint32_t pass = ++pass_;
  for (std::int32_t i = 0; i < count_; ++i)
    each_node(items_[i], [&](std::int32_t node) {
      if (changed_[node] != pass) know(node);
      changed_[node] = pass;
    });
  std::int32_t least = 0;
  find_faults(removal, &least);
  note_faulty(removal);
  for (; least > 0; find_faults(removal, &least)) count_ = take_back(removal, least);
  return count_;
}

std::int32_t CutTrial::try_faces(const std::int32_t* faces, std::int32_t count, const std::uint32_t* order) {
  count_ = count;
  std::copy(faces, faces + count, items_);
  std::sort(items_, items_ + count,
            [&](std::int32_t a, std::int32_t b) { return order[a] != order[b] ? order[a] < order[b] : a < b; });
  for (std::int32_t i = 0; i < count; ++i) state_->set(items_[i], FaceState::tried);
  return settle(false);
}

std::int32_t CutTrial::try_removal(const std::int32_t* tetrahedra, std::int32_t count) {
  count_ = 0;
  for (std::int32_t i = 0; i < count; ++i)
    if (state_->may_go(tetrahedra[i])) items_[count_++] = -1 - tetrahedra[i], state_->set_gone(tetrahedra[i], true);
  settle(true);
  for (std::int32_t i = 0; i < count_; ++i) items_[i] = -1 - items_[i];
  return count_;
}

}  // namespace palpate
