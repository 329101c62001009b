// The hyperelastic body as the body of a touch (contact/body.h): solved in the step, or beside it.
#pragma once

#include <cstdint>

#include "runtime/contact/body.h"
#include "runtime/contact/touch_step.h"
#include "runtime/large/body_beside.h"
#include "runtime/large/body_energy.h"
#include "runtime/large/body_field.h"
#include "runtime/large/deforming_body.h"
#include "runtime/large/mesh_follower.h"

namespace palpate {

class LargeBody : public Body, public MeshFollower {
 public:
  DeformingBody& deforming() { return deforming_; }
  // The mesh may be cut (mesh_follower.h).
  MeshFollower* mesh_follower() override { return this; }
  Layout follow_mesh(AddedCompliance* added) override { return deforming_.follow_mesh(added); }
  void split(const Split& split, bool replayed) override { deforming_.split(split, replayed); }
  void remove(std::int32_t tetrahedron) override { deforming_.remove(tetrahedron); }
  void take_loads(const DividedLoad* loads, std::int32_t count) override { deforming_.take_loads(loads, count); }
  void take_supports(const Support* supports, std::int32_t count) override {
    deforming_.take_supports(supports, count);
  }
  void changed(bool replayed) override { deforming_.changed(replayed); }
  void forget_changes() override { deforming_.forget_changes(); }

  // For contacts that slide. False where memory ends.
  bool watch_energy(SceneMemory& memory, std::int32_t constraint_capacity) {
    watches_ = true;
    return energy_.create(memory, constraint_capacity);
  }

  bool responds_linearly() const override { return false; }
  // That the body follows in a thread of its own; nullptr: none.
  MeshStream* stream() const { return stream_; }

 protected:
  ~LargeBody() = default;
  // force_on(p): N, of constraint p on the body, in the organ's frame.
  template <class Force>
  void note_energy(TouchStep& step, const ContactConstraints& set, Force force_on);
  // Contacts felt too little while the body was behind, and what it has beyond that has shortened them since.
  void raise_where_shortened(TouchStep& step, const ContactConstraints& set, bool behind);
  void end_energy(TouchStep& step, const ContactConstraints& set, bool followed);
  // For the step, and each tool that has contacts in it.
  static void raise(TouchStep& step, std::uint32_t flags);

  DeformingBody deforming_;
  BodyEnergy energy_;
  MeshStream* stream_ = nullptr;
  bool watches_ = false;
};

// LARGE: the body takes the steps of its method in the touch, and has a field of its own.
class BodyInTouch final : public LargeBody {
 public:
  // For those who ask about the surface beside the solve. False where memory ends.
  bool create_field(SceneMemory& memory, const Offset* offset, std::int32_t constraint_capacity,
                    std::int32_t surface_nodes) {
    has_field_ = true;
    return field_.create(memory, &deforming_, offset, constraint_capacity, surface_nodes);
  }

  SurfaceField* surface_field() override { return &field_; }
  ContactSolver::Outcome solve(TouchStep& step, bool again) override;
  Operations operations_to_solve(const TouchStep&) const override { return deforming_.fewest_operations(); }
  bool prepare(TouchStep& step) override;
  void aim(TouchStep& step) override;
  BodySystem system(TouchState&) override {
    return {&deforming_.solver().compliance(), deforming_.rows_of_constraints(), &deforming_.laws(), nullptr};
  }
  bool takes_steps() const override { return true; }
  bool follow(TouchStep& step) override;
  ContactSolver::Outcome take_reactions(TouchStep& step, const LawEffort& effort) override;
  ContactSolver::Outcome fail(TouchStep& step) override;
  Vec3 reached(const TouchState&, std::int32_t p) const override { return deforming_.reached(p); }
  bool gives_way(TouchStep& step, ContactSolver::Outcome outcome) override;
  void judge(TouchStep& step, ContactSolver::Outcome outcome) override;
  void move_surface(TouchStep& step, const ContactConstraints& set) override;
  Vec3 reaction(const TouchState&, std::int32_t p) const override { return deforming_.reaction(p); }
  Vec3 missed(const TouchStep&, std::int32_t p) const override { return deforming_.missed(p); }
  Mat3 axes(const TouchStep&, std::int32_t p) const override { return deforming_.frame(p); }
  Vec3 moved_node(const TouchState& state, std::int32_t e) const override;
  Mat3 compliance_between(const TouchState&, std::int32_t p, std::int32_t q) const override {
    return deforming_.compliance_between(p, q);
  }
  void measure_stiffness(TouchState&, const SystemSolver::MovedAlike* groups, int count, double* stiffness) override {
    deforming_.measure_stiffness(groups, count, stiffness);
  }
  void write(const TouchStep& step) const override;
  void forget() override;
  void restored() override { deforming_.restored(); }

  // ---- the mesh is cut
  // Which nodes of the mesh become new ones, for a body that may be cut. False where memory ends.
  bool reserve(SceneMemory& memory, const NewNodes& new_nodes) {
    new_nodes_ = new_nodes, on_ = memory.array<Vec3>(static_cast<std::size_t>(new_nodes.count));
    return !memory.failed();
  }
  void split(const Split& split, bool replayed) override;
  void bring(std::int32_t node, Vec3 on) override { on_[node - new_nodes_.first] = on; }
  void forget_changes() override;

 private:
  void note_energy(TouchStep& step);
  void take_offset(TouchStep& step);
  ContactSolver::Outcome tell(TouchStep& step);

  BodyField field_;
  bool has_field_ = false;
  NewNodes new_nodes_;
  std::int32_t made_ = 0;  // of the new nodes
  Vec3* on_ = nullptr;     // [new nodes] m, by which a new node is off its place at rest in the bundle
  bool sound_ = true;      // where several bodies are solved as one: all numbers of this step are finite so far
  DeformingBody::Outcome outcome_;  // of the step that goes on
};

// LARGE_BESIDE: the thread of palpate_scene_deform has the body, and the touch goes on from its solutions by the linear response.
class BodyInThread final : public LargeBody {
 public:
  BodyBeside& beside() { return beside_; }

  // The linear organ of the touch is `linear`, whose mesh is cut.
  void follow_beside(Body* linear, MeshStream* stream) override { linear_ = linear, stream_ = stream; }
  void copy_node(std::int32_t from, std::int32_t to) override { beside_.copy_node(from, to); }
  bool holds_back() const override { return beside_.holds_back(); }
  void hold_back(const float* released, double energy) override { beside_.hold_back(released, energy); }
  bool awaits_mesh() const override { return beside_.told().awaits_mesh != 0; }
  SurfaceField* surface_field() override { return linear_ ? linear_->surface_field() : nullptr; }
  void move_surface(TouchStep& step, const ContactConstraints& set) override {
    return linear_ ? linear_->move_surface(step, set) : Body::move_surface(step, set);
  }
  const AddedField* added() const override { return &beside_.added(); }
  const ContactConstraints& take(TouchStep& step) override;
  void take_targets(const TouchStep& step) override { beside_.take_targets(step.state->rows.set()); }
  bool prepare(TouchStep& step) override;
  bool follow(TouchStep& step) override;
  bool gives_way(TouchStep& step, ContactSolver::Outcome) override { return follow(step); }
  ContactSolver::Outcome take_reactions(TouchStep& step, const LawEffort& effort) override;
  Vec3 reached(const TouchState& state, std::int32_t p) const override {
    return Body::reached(state, p) + beside_.added_on(p);
  }
  Vec3 moved_node(const TouchState& state, std::int32_t e) const override;
  void judge(TouchStep& step, ContactSolver::Outcome outcome) override;
  void write(const TouchStep& step) const override;
  void forget() override;
  void restored() override { beside_.restored(); }
  std::int32_t deform() override { return beside_.deform(); }

 private:
  void give(TouchStep& step);

  BodyBeside beside_;
  Body* linear_ = nullptr;  // nullptr: the organ of the tensors
  bool is_joint_ = false;   // in this step, solved with other bodies
};

}  // namespace palpate
