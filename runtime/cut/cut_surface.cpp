#include "runtime/cut/cut_surface.h"

#include <algorithm>

namespace palpate {

bool CutSurface::create(SceneMemory& memory, const RestMesh& rest, const std::int32_t* nodes) {
  rest_ = &rest, nodes_ = nodes;
  const auto faces = 4 * static_cast<std::size_t>(rest.tetrahedra());
  face_ = memory.array<std::int32_t>(faces);
  triangle_ = memory.array<std::int32_t>(faces);
  if (memory.failed()) return false;
  memory.keep(count_);
  memory.keep_array(face_, faces, count_);
  memory.keep_array(triangle_, faces);
  forget();
  return true;
}

void CutSurface::forget() {
  count_ = 0;
  std::fill(triangle_, triangle_ + 4 * rest_->tetrahedra(), -1);
  for (std::int32_t i = 0; i < rest_->body().triangle_count; ++i) add(rest_->face_of_triangle(i));
}

void CutSurface::nodes(std::int32_t triangle, std::int32_t found[3]) const {
  const std::int32_t face = face_[triangle], first = 4 * (face / 4);
  if (triangle >= rest_->body().triangle_count) {
    for (int c = 0; c < 3; ++c) found[c] = nodes_[first + kFaceCorners[face % 4][c]];
    return;
  }
  const std::int32_t* const at_rest = rest_->body().triangles + 3 * triangle;
  for (int c = 0; c < 3; ++c) found[c] = nodes_[rest_->corner_at(face / 4, at_rest[c])];
}

std::int32_t CutSurface::other_lip(std::int32_t triangle) const {
  const std::int32_t other = face_[triangle] < 0 ? -1 : rest_->other_side(face_[triangle]);
  return other < 0 ? -1 : triangle_[other];
}

std::int32_t CutSurface::add(std::int32_t face) {
  face_[count_] = face;
  return triangle_[face] = count_++;
}

std::int32_t CutSurface::remove(std::int32_t face) {
  const std::int32_t triangle = triangle_[face];
  face_[triangle] = -1, triangle_[face] = -1;
  return triangle;
}

}  // namespace palpate
