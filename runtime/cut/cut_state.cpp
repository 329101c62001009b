#include "runtime/cut/cut_state.h"

#include <algorithm>

namespace palpate {

const char* CutState::create(SceneMemory& memory, const RestMesh& rest) {
  rest_ = &rest;
  const auto tetrahedra = static_cast<std::size_t>(rest.tetrahedra());
  faces_ = memory.array<FaceState>(4 * tetrahedra);
  gone_ = memory.array<std::uint8_t>(tetrahedra);
  component_ = memory.array<std::int32_t>(4 * tetrahedra);
  fans_ = memory.array<std::uint8_t>(4 * tetrahedra);
  stack_ = memory.array<std::int32_t>(tetrahedra);
  if (memory.failed()) return "no memory for a body that can be cut";
  memory.keep_array(faces_, 4 * tetrahedra);
  memory.keep_array(gone_, tetrahedra);
  forget();
  for (std::int32_t n = 0; n < rest.body().node_count; ++n) {
    find_components(n);
    for (const std::int32_t corner : rest.star(n))
      if (component_[corner] != *rest.star(n).begin() || has_fans(component_[corner]))
        return "the surface of the body to be cut is not manifold at a node";
  }
  return nullptr;
}

void CutState::forget() {
  const std::int32_t tetrahedra = rest_->tetrahedra();
  std::fill(gone_, gone_ + tetrahedra, std::uint8_t{0});
  for (std::int32_t face = 0; face < 4 * tetrahedra; ++face) {
    faces_[face] = FaceState::whole;
    for (std::int32_t c = face - face % 4; c < face - face % 4 + 4; ++c)
      if (c != face && !rest_->may_divide(rest_->node(c))) faces_[face] = FaceState::kept;
  }
}

bool CutState::may_go(std::int32_t tetrahedron) const {
  const std::int32_t* const nodes = rest_->nodes_of(tetrahedron);
  return !gone(tetrahedron) && std::all_of(nodes, nodes + 4, [&](std::int32_t n) { return rest_->may_divide(n); });
}

bool CutState::on_surface(std::int32_t node) const {
  for (const std::int32_t corner : rest_->star(node)) {
    const std::int32_t first = corner - corner % 4;
    for (std::int32_t f = first; f < first + 4; ++f)
      if (f != corner && !gone(first / 4) && open(f) && face(f) != FaceState::tried) return true;
  }
  return false;
}

void CutState::find_components(std::int32_t node) {
  const RestMesh::Star star = rest_->star(node);
  for (const std::int32_t corner : star) component_[corner] = -1, fans_[corner] = 0;
  for (const std::int32_t corner : star)
    if (component_[corner] < 0 && !gone(corner / 4)) flood(node, corner);
}

void CutState::flood(std::int32_t node, std::int32_t first) {
  std::int32_t waiting = 0, borders = 0, border = -1;
  stack_[waiting++] = first;
  component_[first] = first;
  while (waiting > 0) {
    const std::int32_t corner = stack_[--waiting], begin = corner - corner % 4;
    for (std::int32_t face = begin; face < begin + 4; ++face) {
      if (face == corner) continue;
      if (open(face)) {
        ++borders, border = face;
        continue;
      }
      const std::int32_t next = rest_->corner_at(rest_->neighbour(face), node);
      if (component_[next] >= 0) continue;
      component_[next] = first;
      stack_[waiting++] = next;
    }
  }
  if (borders == 0) return;
  // All open faces lie in one row if a walk from one of them passes all others before it is back.
  const std::int32_t* const nodes = rest_->nodes_of(border / 4);
  std::int32_t other[2], count = 0;
  for (std::int32_t c = 0; c < 4; ++c)
    if (c != border % 4 && nodes[c] != node) other[count++] = nodes[c];
  Border at{border, other[0], other[1]};
  std::int32_t passed = 0;
  do {
    at = next_border(node, at);
    ++passed;
  } while (at.face != border && passed <= borders);
  fans_[first] = passed != borders;
}

CutState::Border CutState::next_border(std::int32_t node, Border border) const {
  std::int32_t tetrahedron = border.face / 4, far = rest_->node(border.face);
  std::int32_t cross = rest_->corner_at(tetrahedron, border.trail);
  while (!open(cross)) {
    tetrahedron = rest_->neighbour(cross);
    cross = rest_->corner_at(tetrahedron, far);
    far = rest_->fourth_node(tetrahedron, node, border.lead, far);
  }
  return {cross, border.lead, far};
}

bool CutState::find_sectors(Ring ring) {
  const std::int32_t start = ring.tetrahedron;
  bool begins = true;
  for (;;) {
    const std::int32_t t = ring.tetrahedron;
    if (gone(t)) {
      begins = true;
    } else if (begins && sector_count_ < kMostSectors) {
      std::int32_t* const sector = sectors_[sector_count_++];
      sector[0] = component_[rest_->corner_at(t, ring.a)], sector[1] = component_[rest_->corner_at(t, ring.b)];
      begins = false;
    }
    const std::int32_t cross = rest_->corner_at(t, ring.behind), next = rest_->neighbour(cross);
    if (faces_[cross] >= FaceState::tried) begins = true;
    if (next < 0) return false;
    ring = {next, ring.a, ring.b, ring.ahead, rest_->fourth_node(next, ring.a, ring.b, ring.ahead)};
    if (next == start) return true;
  }
}

bool CutState::edge_is_shared(std::int32_t tetrahedron, std::int32_t a, std::int32_t b, std::int32_t away) {
  sector_count_ = 0;
  const std::int32_t ahead = rest_->fourth_node(tetrahedron, a, b, away);
  if (!find_sectors({tetrahedron, a, b, away, ahead})) {
    // The edge lies on the surface at rest: the sectors on the other side of the first tetrahedron.
    const std::int32_t next = rest_->neighbour(rest_->corner_at(tetrahedron, ahead));
    if (next >= 0) find_sectors({next, a, b, away, rest_->fourth_node(next, a, b, away)});
  }
  for (int i = 0; i < sector_count_; ++i)
    for (int j = 0; j < i; ++j)
      if (sectors_[i][0] == sectors_[j][0] && sectors_[i][1] == sectors_[j][1]) return true;
  return sector_count_ == kMostSectors;
}

bool CutState::face_has_shared_edge(std::int32_t face) {
  const std::int32_t tetrahedron = face / 4;
  const std::uint8_t* const at = kFaceCorners[face % 4];
  const std::int32_t* const nodes = rest_->nodes_of(tetrahedron);
  for (int c = 0; c < 3; ++c)
    if (edge_is_shared(tetrahedron, nodes[at[(c + 1) % 3]], nodes[at[(c + 2) % 3]], nodes[at[c]])) return true;
  return false;
}

}  // namespace palpate
