// The tetrahedra before any cut: neighbours across faces, the tetrahedra around each node, the faces of the surface. Constant after create().
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"

namespace palpate {

// Borrowed by what is made of it.
struct CutBody {
  const double* nodes = nullptr;  // [node_count][3] m, at rest
  std::int32_t node_count = 0;
  const std::int32_t* tetrahedra = nullptr;  // [tetrahedron_count][4]; their volume is above 0
  std::int32_t tetrahedron_count = 0;
  const std::int32_t* triangles = nullptr;  // [triangle_count][3]: the whole surface, counter-clockwise from outside
  std::int32_t triangle_count = 0;
  const std::uint8_t* held = nullptr;  // [node_count] 1: the node cannot move; nullptr: none
  const std::uint8_t* dividable =
      nullptr;  // [node_count] 0: it stays whole, and so do its tetrahedra; nullptr: all may be divided
  const Mat3* support =
      nullptr;  // [triangle_count] N/m, by which a foundation or springs hold a triangle; nullptr: none
};

// A corner of a tetrahedron is 4 tetrahedron + 0..3, and so is the face that is opposite to this corner.
class RestMesh {
 public:
  struct Star {
    const std::int32_t *first, *last;  // corners
    const std::int32_t* begin() const { return first; }
    const std::int32_t* end() const { return last; }
  };

  // The sentence of what is wrong with the body; nullptr: nothing, unless the memory has failed. Cost: E log E.
  const char* create(SceneMemory& memory, const CutBody& body);

  const CutBody& body() const { return body_; }
  bool may_divide(std::int32_t node) const { return !body_.dividable || body_.dividable[node]; }
  std::int32_t tetrahedra() const { return body_.tetrahedron_count; }
  const std::int32_t* nodes_of(std::int32_t tetrahedron) const { return body_.tetrahedra + 4 * tetrahedron; }
  std::int32_t node(std::int32_t corner) const { return body_.tetrahedra[corner]; }
  // The tetrahedron beyond a face; -1: none.
  std::int32_t neighbour(std::int32_t face) const { return neighbours_[face]; }
  // The same face as its other tetrahedron has it; -1: a face of the surface.
  std::int32_t other_side(std::int32_t face) const;
  // The corner of a tetrahedron at one of its nodes.
  std::int32_t corner_at(std::int32_t tetrahedron, std::int32_t node) const {
    const std::int32_t* const nodes = nodes_of(tetrahedron);
    return 4 * tetrahedron + (nodes[0] == node ? 0 : nodes[1] == node ? 1 : nodes[2] == node ? 2 : 3);
  }
  // The node of a tetrahedron that is none of three others of it.
  std::int32_t fourth_node(std::int32_t tetrahedron, std::int32_t a, std::int32_t b, std::int32_t c) const {
    const std::int32_t* const nodes = nodes_of(tetrahedron);
    return nodes[0] ^ nodes[1] ^ nodes[2] ^ nodes[3] ^ a ^ b ^ c;
  }
  // The corners at a node.
  Star star(std::int32_t node) const { return {stars_ + star_begin_[node], stars_ + star_begin_[node + 1]}; }
  // The face of a triangle of the surface.
  std::int32_t face_of_triangle(std::int32_t triangle) const { return face_of_triangle_[triangle]; }

 private:
  const char* check_numbers() const;
  void make_stars();
  struct Side;
  const char* match(Side* sides);
  const char* check_edges(std::uint64_t* edges) const;

  CutBody body_;
  std::int32_t* neighbours_ = nullptr;        // [tetrahedra][4]
  std::int32_t* star_begin_ = nullptr;        // [nodes + 1]
  std::int32_t* stars_ = nullptr;             // [tetrahedra][4]
  std::int32_t* face_of_triangle_ = nullptr;  // [triangles]
};

// The corners of a face that is opposite to corner 0..3, counter-clockwise from outside.
constexpr std::uint8_t kFaceCorners[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

}  // namespace palpate
