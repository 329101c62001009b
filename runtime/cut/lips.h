// The contact between the lips of a cut: tissue on one side does not go through that on the other.
//
// A face that is cut becomes two triangles whose corners lie at the same places at rest. Two such corners, of nodes a and b, are a pair, and have a row along n,
//     n . (u_a - u_b) >= 0,   n: unit, from the lip of b to that of a.
// A mesh is cut along faces as they are, so that its lips have teeth as long as an edge, where a blade has left none. So n is not the normal of a face: it is the
// direction of a sum of the vector areas of the faces around a pair, in which teeth cancel (the vector area of a patch depends on its border alone). There
// is no friction: lips are wet.
//
// A pair holds where its nodes are across from one another, within 1.5 mean edges along the lips. What has gone through before, where the pair did not hold,
// is not pushed out: that would do work that nobody has done.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/row_source.h"
#include "runtime/contact/touch.h"
#include "runtime/cut/cut_mesh.h"
#include "runtime/cut/cut_target.h"
#include "runtime/include/palpate/palpate_cut.h"

namespace palpate {

// index: the node a, point: the node b.
constexpr ContactSource kLipSource{PALPATE_SOURCE_LIP};

class Lips final : public RowSource {
 public:
  // All borrowed.
  struct Source {
    TouchState* touch = nullptr;
    const CutMesh* mesh = nullptr;
    const CutTarget* target = nullptr;
    const palpate_cut_state* told = nullptr;
    const std::int32_t* number = nullptr;  // [nodes of the mesh] the node of the scene
    std::int32_t surface_nodes = 0, new_nodes = 0;
    std::int32_t faces = 0;  // that can be cut
    std::int32_t most = 0;   // pairs that have rows in a step
    double shear = 0;        // Pa, of the stiffest tissue
  };
  // Memory: 690 bytes for each new node, 72 for each face and 36 for each surface node.
  bool create(SceneMemory& memory, const Source& source);

  // Cost: eight passes over the faces that are cut, and the displacement of each node of a lip.
  std::int32_t begin(TouchStep& step) override;
  void request(TouchStep& step) override;
  void end(TouchStep& step) override;
  void forget_rest() override { face_count_ = pair_count_ = node_count_ = held_count_ = 0, seen_ = 0; }

 private:
  struct Pair {
    std::int32_t a, b;        // nodes of the scene, a < b
    std::int32_t at_a, at_b;  // of node_
    std::int64_t rests;       // steps until it asks for no row where its nodes are apart
    double gap, overlap;      // m, along the normal: before the step; of which so much is not pushed out
    Vec3 normal;              // unit, in the organ's frame
  };
  struct Face {
    std::int32_t a[3],
        b[3];  // of node_: the corners on the one lip, counter-clockwise from outside, and those across from them
    std::int32_t pair[3];  // -1: the cut ends there, and both are one node
    std::int32_t sign[3];  // 1: the corner in a is that of Pair::a; else -1
  };
  void rebuild();
  void add_face(std::int32_t triangle, std::int32_t other);
  std::int32_t scene_node(std::int32_t of_mesh) const;
  std::int32_t local(std::int32_t node);
  std::int32_t pair_of(std::int32_t a, std::int32_t b);
  void order_pairs();
  void find_normals();
  bool measure(Pair& pair, const Vec3& area) const;
  std::uint32_t keep_nearest();

  Source source_;
  Pair *pairs_ = nullptr, *last_ = nullptr;  // [pairs_capacity_] ascending by a, b
  Face* faces_ = nullptr;                    // [source.faces]
  std::int32_t* node_ = nullptr;             // [surface nodes] the nodes of the lips
  std::int32_t* local_ = nullptr;            // [surface nodes] -1: not one of them
  std::int32_t* first_pair_ = nullptr;       // [surface nodes] of a local node, for rebuild()
  std::int32_t* next_pair_ = nullptr;        // [pairs_capacity_]
  std::int32_t* held_ = nullptr;             // [pairs_capacity_] that have rows in this step, ascending
  std::int32_t* constraint_ = nullptr;       // [pairs_capacity_] of held_
  double* nearness_ = nullptr;               // [pairs_capacity_]
  Vec3 *place_ = nullptr, *area_ = nullptr;  // [surface nodes] m, deformed; [pairs_capacity_] m^2
  Vec3* face_area_ = nullptr;                // [source.faces] m^2
  std::int32_t pairs_capacity_ = 0, pair_count_ = 0, face_count_ = 0, node_count_ = 0, held_count_ = 0;
  std::uint64_t seen_ = 0;  // palpate_cut_state.surface of what is here
  QueryWork work_;
};

}  // namespace palpate
