// What deforms under the rows of a step. This class is the linear organ, which the bundle's tensors describe and contact_solver.h solves. A
// body of another kind derives from it and overrides what it answers otherwise. A step asks the scene's body, and
// never what it is.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/contact_solver.h"

namespace palpate {

class AddedField;
class MeshFollower;
class SurfaceField;
struct TouchState;
struct TouchStep;

// The rows of a body's constraints as a system of its own.
struct BodySystem {
  const RowMatrix* matrix = nullptr;          // m/N
  const RowsOfConstraint* rows_of = nullptr;  // [constraints]
  SystemSolver* system = nullptr;             // of their targets and reactions
  // Of the linear organ: how far reactions move its nodes.
  const ContactMatrix* nodes = nullptr;
};

// What a body says about the steps of its own that it took for a step of the touch.
struct Deformed {
  std::int32_t steps = 0;
  double residual = 0, least_volume = 1;  // as in palpate_contacts
  bool lags = false;                      // it is not where its contacts hold it
};

// No function is pure: a library without C++ runtime has none of these. No destructor: bodies belong to a scene's memory.
class Body {
 public:
  // ---- while a scene is built
  // Displacements are linear in the forces. Then a contact's own part of the field does not change its share as the anchor moves, and
  // slide_energy.h knows the energy of contacts that slide; else the body accounts for it.
  virtual bool responds_linearly() const { return true; }
  // The body's own field, in place of the tensors'; nullptr: it has none.
  virtual SurfaceField* surface_field() { return nullptr; }
  // What adds to the tensors' field; nullptr: nothing. The solver then has other targets and frames than those that were requested.
  virtual const AddedField* added() const { return nullptr; }

  // The body follows a mesh that is cut; nullptr: it cannot.
  virtual MeshFollower* mesh_follower() { return nullptr; }

  // ---- a step, in this order
  // The requested constraints as the body is to hold them.
  virtual const ContactConstraints& take(TouchStep& step);
  // The same constraints have other targets, since sources have asked again.
  virtual void take_targets(const TouchStep&) {}
  // Finds the reactions of TouchStep::acting and the force of each contact node. again: the step has solved them before, with other targets.
  virtual ContactSolver::Outcome solve(TouchStep& step, bool again);
  // What solve() takes at least.
  virtual Operations operations_to_solve(const TouchStep& step) const;
  // ---- where several bodies are solved as one, in place of take(), solve(), gives_way() and take_targets()
  // Brings the constraints and their system up to date: those between bodies have no targets of their own. False: a number is not finite.
  virtual bool prepare(TouchStep& step);
  // The constraints have other targets. The system gets what is left of each one where no reaction acts.
  virtual void aim(TouchStep& step);
  virtual BodySystem system(TouchState& state);
  // Whether the body takes steps of its own, by follow().
  virtual bool takes_steps() const { return false; }
  // All have reactions, and the constraints between bodies have as targets where these bring them. True: the body has gone on, so that the
  // systems are to be solved again.
  virtual bool follow(TouchStep&) { return false; }
  // Takes the reactions over as solve() its own.
  virtual ContactSolver::Outcome take_reactions(TouchStep& step, const LawEffort& effort);
  // The step has no solution: it ends without contact forces.
  virtual ContactSolver::Outcome fail(TouchStep& step);
  // m, along its rows: where the reactions of the system bring constraint p.
  virtual Vec3 reached(const TouchState& state, std::int32_t p) const;

  // Whether contacts that slide have shorter targets now, for energy that nobody paid, so that the step is to be solved again.
  virtual bool gives_way(TouchStep& step, ContactSolver::Outcome outcome);
  // Judges the energy of contacts that slide.
  virtual void judge(TouchStep& step, ContactSolver::Outcome outcome);
  // The fields follow these forces.
  virtual void move_surface(TouchStep& step, const ContactConstraints& set);
  // What the last solve has found. Of constraint p in its frame: the reactions of its rows, N; by how much these miss their targets, m.
  virtual Vec3 reaction(const TouchState& state, std::int32_t p) const;
  virtual Vec3 missed(const TouchStep& step, std::int32_t p) const;
  // That frame: its rows are the axes of the constraint's.
  virtual Mat3 axes(const TouchStep& step, std::int32_t p) const;
  // m, in x, y, z: by how much the contacts have moved contact node e.
  virtual Vec3 moved_node(const TouchState& state, std::int32_t e) const;
  // m/N, in x, y, z: of the weighted mean of constraint p by a force on that of q, where nothing else holds the body.
  virtual Mat3 compliance_between(const TouchState& state, std::int32_t p, std::int32_t q) const;
  // SystemSolver::measure_stiffness().
  virtual void measure_stiffness(TouchState& state, const SystemSolver::MovedAlike* groups, int count,
                                 double* stiffness);
  // What the body adds to the step's result, which is laid out.
  virtual void write(const TouchStep& step) const;

  // ---- between steps
  virtual void forget() {}
  // Completes a restored state (scene_memory.h) by what follows from it.
  virtual void restored() {}
  // Of a body that is solved in a thread of its own: palpate_scene_deform of palpate.h.
  virtual std::int32_t deform() { return -1; }

 protected:
  ~Body() = default;
};

class LinearOrgan final : public Body {};

}  // namespace palpate
