// The linear organ whose mesh is cut, as the body of a touch (contact/body.h). Contacts are solved as those of the uncut organ are, with
// the compliance and the offset of the cut one; the surface's displacements are a field of its own.
//
// An effect creates it in its prepare() and hands it the changes of the mesh between steps, or where a step begins. It refuses what this body does
// not know: volumes that are held (offset_followers.h), contacts that hold nodes inside, displacements of nodes inside.
#pragma once

#include <cstdint>

#include "runtime/contact/body.h"
#include "runtime/contact/touch.h"
#include "runtime/cut/cut_field.h"
#include "runtime/cut/cut_rebase.h"
#include "runtime/cut/cut_response.h"
#include "runtime/cut/cut_stream.h"
#include "runtime/cut/cut_target.h"
#include "runtime/large/mesh_follower.h"

namespace palpate {

class CutOrgan final : public Body, public CutTarget {
 public:
  // All borrowed.
  struct Parts {
    const HyperelasticBody* body = nullptr;  // whose reserve nodes are in no tetrahedron
    const Tensors* tensors = nullptr;
    const std::int32_t* touchable = nullptr;  // [columns of the surface] the node of each
    // Of the nodes on which the cut may act, and where it knows them in double precision. CutResponse::Source.
    const PairCompliance* pairs = nullptr;
    const std::int32_t* pair_nodes = nullptr;
    const double* preload = nullptr;  // [nodes][3] m; nullptr: none
    SupportedSurface supports;
    std::int32_t pair_count = 0;
    std::int32_t surface_nodes = 0, first_reserve = 0;  // the surface nodes from there on are in reserve
    std::int32_t contact_nodes = 0, constraints = 0;    // of a step, at most
    CutCapacity capacity;                               // new_nodes: at most those in reserve
    std::int32_t rebase_at = 0;                         // rank from which on the compliance is re-based; 0: never
    std::int32_t most_slots = 0;                        // nodes on which a cut may act
    // Where a body in another thread follows: it, and what it is told by. The organ is then the linear one of that body.
    MeshFollower* beside = nullptr;
    CutStream* stream = nullptr;
  };
  // Makes itself the body of the touch, before its offset and contacts are built. False where memory ends.
  bool create(SceneMemory& memory, const Parts& parts, TouchState& touch);

  // After all rows of the offset are there: CutResponse::take_loads().
  bool take_loads(SceneMemory& memory, const HyperelasticBody& body, const std::uint8_t* may_divide) {
    return response_.take_loads(memory, body, may_divide, touch_->offset.rows()) &&
           (!rebases_ || rebase_.take_loads(memory));
  }

  CutResult take_change(const CutChange& change, bool replayed = false) override;
  CutOutcome ground(std::int32_t node, double stiffness, bool replayed = false) override;
  void end_changes(bool replayed) override;
  bool awaits_body() const override { return beside_ && beside_->awaits_mesh(); }
  void bring(std::int32_t surface_node, Vec3 from_reserve) override {
    brought_[surface_node - response_.first_new()] = from_reserve;
  }
  // So does Body::forget().
  void forget_changes(bool replayed = false) override;
  void show(const CutTriangles& triangles) override;

  double take_operations() override { return response_.fields().take_operations(); }
  CutRebase* rebase() override { return rebases_ ? &rebase_ : nullptr; }

  const CutResponse& response() const { return response_; }

  SurfaceField* surface_field() override { return &field_; }
  void move_surface(TouchStep& step, const ContactConstraints& set) override;
  void write(const TouchStep& step) const override;
  void forget() override;

 private:
  void follow_changes(bool replayed);

  MeshFollower* beside_ = nullptr;
  CutStream* stream_ = nullptr;
  TouchState* touch_ = nullptr;
  CutResponse response_;
  CutField field_;
  CutRebase rebase_;
  bool rebases_ = false;
  Vec3* brought_ = nullptr;  // [nodes in reserve] m
};

}  // namespace palpate
