// Contacts under large deformation: constraints -> rows of large_solver.h -> forces at the contact nodes, and the displaced nodes.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/large/large_solver.h"

namespace palpate {

class DeformingBody {
 public:
  // node_capacity, constraint_capacity: of the constraints of a step. Memory: as LargeSolver::create.
  LargeSolver::Created create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                              std::int32_t order_count, std::int32_t node_capacity, std::int32_t constraint_capacity);

  // force: [node_count] N, of each contact node on the body. Takes the steps that `work` leaves, one at least, and counts them.
  // Constraints must be sticking.
  LargeOutcome solve(const ContactConstraints& set, StepWork* work, Vec3* force);

  // Displacements of nodes 0 .. count - 1, [count][3] m.
  void write_field(std::int32_t count, float* out) const {
    for (std::int32_t n = 0; n < count; ++n) solver_.displacement(n, out + 3 * static_cast<std::int64_t>(n));
  }

  void forget() { solver_.forget(); }
  void restored() { solver_.restored(); }
  Operations operations_of_a_step() const { return operations_; }
  // No step takes more: a move that is halved ten times, and as many searches.
  Operations most_operations() const { return (12 + 10 * LargeSolver::kMostSteps) * operations_; }
  std::int64_t factor_numbers() const { return solver_.factor().numbers(); }

 private:
  std::int32_t add_rows(const ContactConstraint& constraint, Vec3 target, std::int32_t count);
  LargeSolver solver_;
  LargeRow* rows_ = nullptr;       // [3 constraint_capacity]
  double* force_ = nullptr;        // [3 constraint_capacity] N
  std::int32_t* nodes_ = nullptr;  // [node_capacity]
  double* weights_ = nullptr;      // [node_capacity]
  Operations operations_ = 0;
};

}  // namespace palpate
