// The displacement of a cut organ's surface, with the bounds and predictions that collision asks for (surface_field.h), in metres. The organ is
// linear: the part of a contact is the response to its forces.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/bundle/load_field.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/contact_ways.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/surface_field.h"
#include "runtime/cut/cut_response.h"

namespace palpate {

class CutField final : public SurfaceField {
 public:
  struct Limits {
    std::int32_t nodes = 0, constraints = 0;  // of a step's contacts
  };
  // All borrowed. Memory: 520 bytes for each surface node.
  bool create(SceneMemory& memory, const Tensors* tensors, CutResponse* response, const Offset* offset,
              ContactSolver* solver, const Limits& limits);
  // What a body that is solved beside the touch adds. Borrowed.
  void add(const AddedField* added) { added_ = added; }
  void forget();
  // A surface node that was in reserve is where another one is.
  void copy_node(std::int32_t from, std::int32_t to);

  // The cut is another one from now on: what the surface shows stays until the next set().
  void note_change() { changed_ = 1; }
  bool is_changed() const { return changed_ != 0; }
  // Takes over the change before the next set(), under the last forces. Returns what the change does to the surface, [surface nodes][3] m, until the
  // next call, and the energy of the linear organ that it takes, J. The caller subtracts it from what a body beside the touch adds. Cost: as set().
  const float* follow_change(double* energy);

  // Takes over the forces of a step's contacts, N. solved: false where the step has no solution. Cost: the tensors' rows of the contact nodes,
  // and rank multiply-adds for each number of the field; of several contacts, again for each of a tool, up to kMostParts. Nothing where the
  // forces are those of the step before and the cut is the same.
  void set(const ContactConstraints& set, const Vec3* force, bool solved, Operations* work);
  // m, what the contacts do to a surface node.
  Vec3 by_contacts(std::int32_t node) const { return read(now_, node); }

  bool empty() const override { return !moves_ && contact_count_ == 0 && !offset_; }
  bool has_offset() const override { return true; }
  Vec3 moved_at_node(std::int32_t node) const override { return offset_->now(node); }
  void begin_moved() override;
  void end(const ContactId& id) override;
  Vec3 before_at_node(std::int32_t node, QueryWork* work) override;
  Vec3 at_node_without(std::int32_t node, const ContactId& id, QueryWork* work) override;
  bool predict_without(const ContactId& id, Operations most, Operations* work) override;
  Operations operations_to_predict(const ContactId& id) const override;
  Vec3 predicted_at_node(std::int32_t node, QueryWork* work) override;
  bool pulls_among_others(const ContactId& id, Vec3 outward) const override;
  double predicted_norm() const override { return predicted_.norm + moved_norm(); }
  double predicted_apart() const override { return predicted_.apart; }
  double norm() const override { return norms_.now + moved_norm(); }
  double path() const override { return norms_.path; }
  double last_change() const override { return norms_.path - norms_.path_before; }
  double own_norm(const ContactId& id) const override;
  double norm_without(const ContactId& id) const override;
  double last_change_without(const ContactId& id) const override;
  Vec3 beyond_mesh(const ContactDisc& disc, const ContactId& id, bool predicted) const override {
    return solved_ ? solver_->beyond_mesh(disc, id, predicted) : Vec3{};
  }
  std::int32_t discs() const override { return solved_ ? solver_->matrix().held().discs : 0; }
  double deepest_but(const ContactId& id) const override { return ways_.deepest_but(id); }
  double sum_of_changes() const override { return ways_.sum_of_changes; }

 private:
  // Contacts of tools whose parts are known at all nodes. One more is found when it is asked for, and its bound is that of no body.
  static constexpr std::int32_t kMostParts = 16;
  struct Contact {
    ContactId id;
    std::int32_t first, last;         // its contact nodes
    std::int32_t part;                // among the parts; -1: it is alone; -2: not known
    std::int32_t ended;               // 1: since the last set()
    std::int32_t unused;              // in the place of padding, which a saved state would hold
    double own, without, own_change;  // m
    Vec3 force;                       // N
    Vec3 way, place;                  // m, as ContactWays has them
    double radius;
  };
  // Forces on the contact nodes first .. last - 1, and the field that they make.
  struct Part {
    std::int32_t first, last;
    float* field;
  };
  static Vec3 read(const float* field, std::int32_t node) {
    const float* const u = field + 3 * static_cast<std::size_t>(node);
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }
  float* part(float* parts, std::int32_t which) const { return parts + static_cast<std::size_t>(which) * numbers_; }
  const Contact* find(const ContactId& id) const { return find_contact(contacts_, contact_count_, id); }
  Vec3 evaluate_at_node(std::int32_t node, QueryWork* work) override;
  // m: what belongs to no contact.
  Vec3 beside_contacts(std::int32_t node) const {
    return added_ ? offset_->now(node) + added_->now(node) : offset_->now(node);
  }
  double moved_norm() const { return added_ ? offset_->longest() + added_->longest() : offset_->longest(); }
  double moved_change() const { return added_ ? offset_->change() + added_->change() : offset_->change(); }
  void gather(const ContactConstraints& set, const Vec3* force);
  bool same_forces(const ContactConstraints& set, const Vec3* force, bool solved) const;
  void keep_fields();
  void find_fields();
  void evaluate_all();
  const float* measure(Contact& contact);
  void evaluate(const Vec3* force, const Part* parts, int count);
  void evaluate_line(const Vec3* force, std::int32_t first, std::int32_t last);
  void add_base(const Vec3* force, std::int32_t first, std::int32_t last);
  Operations operations_of(int fields) const;

  const Tensors* tensors_ = nullptr;
  CutResponse* response_ = nullptr;
  const Offset* offset_ = nullptr;
  const AddedField* added_ = nullptr;
  ContactSolver* solver_ = nullptr;
  std::size_t numbers_ = 0;                           // of a field
  ContactNode* nodes_ = nullptr;                      // [nodes] of the last set()
  Vec3* force_ = nullptr;                             // [nodes] N
  float *now_ = nullptr, *before_ = nullptr;          // [surface nodes][3] m, by the contacts
  float *parts_ = nullptr, *parts_before_ = nullptr;  // [kMostParts + 1][surface nodes][3] m
  Contact *contacts_ = nullptr, *last_ = nullptr;     // [constraints] ascending; of this step and the last
  std::int32_t node_count_ = 0, contact_count_ = 0, part_count_ = 0, last_count_ = 0, moves_ = 0, solved_ = 0;
  std::int32_t changed_ = 0;  // 1: the cut has, since the last set()
  struct Norms {  // m: of now_ and before_; of all changes, now, after the last set() and after the one before
    double now = 0, before = 0, path = 0, path_set = 0, path_before = 0;
  } norms_;
  struct Prediction {
    float* field = nullptr;      // [surface nodes][3] m
    double norm = 0, apart = 0;  // m
  } predicted_;
  ContactWays ways_;
  ContactId asked_;     // the contact whose part is the last one of parts_
  bool is_set_ = true;  // since begin_moved()
  struct Scratch {
    LoadField loads;
    double* line = nullptr;             // [surface nodes][3] m, C f
    double *x = nullptr, *y = nullptr;  // [kMostRows][stride]
    double* product = nullptr;          // [surface nodes][3][kMostRows]
    Vec3* force = nullptr;              // [nodes] N, of a prediction
  } scratch_;
};

}  // namespace palpate
