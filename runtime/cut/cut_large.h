// The body under large deformation whose mesh is cut. Its energy follows the mesh exactly (mesh_follower.h), and the metric of its method gets what the cut
// adds to the compliance at rest: with the patterns P, the jumps J and the matrix M of cut_compliance.h
//     K'^-1 f = K^-1 (f + P w) + J w,   w = M (P^T K^-1 f + J^T f).
#pragma once

#include <cstdint>

#include "runtime/contact/changed_body.h"
#include "runtime/contact/touch.h"
#include "runtime/cut/cut_target.h"
#include "runtime/large/mesh_follower.h"

namespace palpate {

class CutLarge final : public CutTarget, public AddedCompliance, public ChangedBody {
 public:
  // All borrowed.
  struct Parts {
    const HyperelasticBody* body = nullptr;  // whose reserve nodes are in no tetrahedron
    const PairCompliance* pairs = nullptr;
    SupportedSurface supports;
    std::int32_t surface_nodes = 0, first_reserve = 0;  // the surface nodes from there on are in reserve
    CutCapacity capacity;                               // new_nodes: at most those in reserve
    MeshFollower* follower = nullptr;
  };
  // touch: of a body that is solved in it; nullptr: in another thread. False where memory ends. Memory beside CutCompliance's: 36 bytes a node.
  bool create(SceneMemory& memory, const Parts& parts, TouchState* touch);

  CutResult take_change(const CutChange& change, bool replayed) override;
  CutOutcome ground(std::int32_t node, double stiffness, bool replayed) override;
  void bring(std::int32_t surface_node, Vec3 from_reserve) override { follower_->bring(surface_node, from_reserve); }
  void end_changes(bool replayed) override;
  void forget_changes(bool replayed) override;

  // Cost of the three, of each vector: rank^2 multiply-adds, and the forces of the patterns twice.
  bool acts() const override { return compliance_.rank() > 0; }
  void begin(float* const* x, int count) override;
  void go_on(float* const* x, int count) override;
  void end(float* const* x, int count) override;

  // The rows of the offset have for a new node what they have for the one that it comes from.
  std::int32_t at_rest(std::int32_t node) const override {
    return node >= first_new_ && node < surface_nodes_ ? origin_[node - first_new_] : node;
  }

 private:
  void follow_split(std::int32_t made, bool replayed);
  bool create_supports(SceneMemory& memory, const Parts& parts);
  void follow_supports();
  void follow_loads();
  void add_support(std::int32_t a, std::int32_t b, double factor, const Mat3& block);
  // Of the k-th new node: -1 where it comes from a node at rest.
  std::int32_t new_parent(std::int32_t k) const {
    const std::int32_t parent = compliance_.tissue().parent(rest_nodes_ + k);
    return parent < rest_nodes_ ? -1 : parent - rest_nodes_;
  }
  // Of a node that is not held along all axes; nullptr: it is.
  float* at(float* x, std::int32_t node) const;

  TouchState* touch_ = nullptr;
  MeshFollower* follower_ = nullptr;
  MeshFollower::Layout layout_;
  const std::uint8_t* fixed_ = nullptr;  // [nodes][3]
  std::int32_t rest_nodes_ = 0, surface_nodes_ = 0, followed_ = 0;
  bool changed_ = false;                // since end_changes()
  std::int32_t* origin_ = nullptr;      // [new nodes] the surface node at rest
  std::int32_t* tetrahedra_ = nullptr;  // [largest star]
  std::size_t stride_ = 0, field_stride_ = 0;
  float* force_ = nullptr;  // [kMostVectors][length] N
  Vec3* on_new_ =
      nullptr;  // [kMostVectors][new nodes] N, forces; then m, jumps; of each new node and those that come from it
  double *field_ = nullptr, *weighed_ = nullptr, *x_ = nullptr, *w_ = nullptr;
  Vec3* pseudo_ = nullptr;  // [slots] N
  std::int32_t most_new_ = 0;
  // Of the body as it is: foundations, springs, and what holds pieces that have come off.
  struct Supports {
    MeshFollower::Support *list = nullptr, *grounded = nullptr;
    std::int32_t count = 0, grounded_count = 0;
  } supports_;
  MeshFollower::DividedLoad* loads_ = nullptr;  // [new nodes and slots]
};

}  // namespace palpate
