// The displacement of the surface under large deformation, with the bounds and predictions that collision asks for (surface_field.h).
//
// What one contact does to the surface has no exact meaning here. A contact that is alone does all of it. Of several, each has the
// linear response to its force, times the ratio of the displacement that its rows have and that which all responses together give
// them: so the parts add up at the contacts. Where an offset moves the body, what that makes of the body beyond the linear one belongs to no
// contact, and each has its linear response alone.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/surface_field.h"
#include "runtime/large/deforming_body.h"

namespace palpate {

class BodyField final : public SurfaceField {
 public:
  // body: its contacts are those of the last set(). offset: adds to the field; nullptr: there is none. Both borrowed.
  bool create(SceneMemory& memory, const DeformingBody* body, const Offset* offset, std::int32_t constraint_capacity,
              std::int32_t surface_nodes);
  void forget();
  // A surface node that was in no tetrahedron is where another one is.
  void copy_node(std::int32_t from, std::int32_t to) {
    for (float* const field : {now_, before_})
      std::copy_n(field + 3 * static_cast<std::size_t>(from), 3, field + 3 * static_cast<std::size_t>(to));
  }

  // Takes over the body after a step. force: [node_count] N. solved: false where the step had no solution.
  // Cost: a pass over the surface nodes.
  void set(const ContactConstraints& set, const Vec3* force, bool solved, Operations* work);

  bool empty() const override { return !moves_ && contact_count_ == 0 && !offset_; }
  bool has_offset() const override { return offset_ != nullptr; }
  Vec3 moved_at_node(std::int32_t node) const override { return offset_ ? offset_->now(node) : Vec3{}; }
  void begin_moved() override;
  void end(const ContactId& id) override;
  Vec3 before_at_node(std::int32_t node, QueryWork* work) override {
    work->add(3);
    const Vec3 u = read(before_, node);
    return !offset_ ? u : u + (is_set_ ? offset_->now(node) : offset_->before(node));
  }
  Vec3 at_node_without(std::int32_t node, const ContactId& id, QueryWork* work) override;
  bool predict_without(const ContactId& id, Operations most, Operations* work) override;
  Vec3 predicted_at_node(std::int32_t node, QueryWork* work) override;
  bool pulls_among_others(const ContactId& id, Vec3 outward) const override;
  double predicted_norm() const override { return norm_ + predicted_apart_ + moved_norm(); }
  double predicted_apart() const override { return predicted_apart_; }
  double norm() const override { return norm_ + moved_norm(); }
  double path() const override { return path_; }
  double last_change() const override { return path_ - path_before_; }
  double own_norm(const ContactId& id) const override;
  double norm_without(const ContactId& id) const override;
  double last_change_without(const ContactId& id) const override;

 private:
  // Also of a node inside, between steps.
  Vec3 evaluate_at_node(std::int32_t node, QueryWork* work) override;
  // A contact: its rows, and what it does.
  struct Contact {
    ContactId id;
    std::int32_t first, end;  // rows
    std::int32_t ended;       // 1: since the last set()
    std::int64_t response;    // LargeSolver::response_id of its only spot; -1: it has several
    double sum[3];            // N, its own part as a force on that spot
    double force[3];          // N
    double own, own_change;   // m
  };
  const Contact* find(const ContactId& id) const;
  double moved_norm() const { return offset_ ? offset_->longest() : 0; }
  bool alone() const { return contact_count_ == 1 && moved_norm() == 0; }
  Vec3 response_at(const double* force, std::int32_t first, std::int32_t end, std::int32_t node, QueryWork* work) const;
  static Vec3 read(const float* field, std::int32_t node) {
    const float* const u = field + 3 * static_cast<std::size_t>(node);
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }
  void gather(const ContactConstraints& set, const Vec3* force);
  void find_own_parts();

  const DeformingBody* body_ = nullptr;
  const Offset* offset_ = nullptr;
  std::int32_t surface_nodes_ = 0, contact_count_ = 0, last_count_ = 0, moves_ = 0;
  float *now_ = nullptr, *before_ = nullptr;  // [surface_nodes][3] m: after the last step; after the one before
  Contact *contacts_ = nullptr,
          *last_ = nullptr;  // [constraint_capacity] ascending; of this step and the last
  double* own_ = nullptr;    // [3 constraint_capacity] N, of each row: the contacts' own parts
  double *predicted_ = nullptr, *column_ = nullptr,
         *together_ = nullptr;  // [3 constraint_capacity]; the last two for a call alone
  double norm_ = 0, norm_before_ = 0, path_ = 0, path_set_ = 0, path_before_ = 0, predicted_apart_ = 0;
  bool predicts_rest_ = false;
  bool is_set_ = true;  // since begin_moved()
};

}  // namespace palpate
