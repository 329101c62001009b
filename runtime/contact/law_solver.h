// Reactions that obey the contact laws: Gauss-Seidel to find which contacts release, stick and slip, and Newton's method to
// solve for the forces.
#pragma once

#include <cstdint>

#include "runtime/contact/law_newton.h"

namespace palpate {

// What a solution took.
struct LawEffort {
  std::int32_t sweeps = 0;        // of Gauss-Seidel
  std::int32_t newton_steps = 0;  // of Newton's method
  std::int64_t operations = 0;    // multiply-adds of both, as counted
};

class LawSolver {
 public:
  // rows: of the largest system; contact_nodes: of systems with shared nodes.
  bool create(SceneMemory& memory, std::int32_t rows, std::int32_t contact_nodes = 0);

  // Improves `reaction` ([rows_end] N; in: a start, such as the last step's) until the laws of the system, with its soft part, are
  // missed by no more than `tolerance` metres, or for most_operations multiply-adds, of which no more than kMostOperations count: a
  // problem that does not converge takes all of them. Where there are fewer than fewest_operations(), no law is solved: the start is
  // made to obey the laws and scaled until its energy r^T A r is at most most_energy (J), for operations_to_look() multiply-adds.
  // Returns by how much the laws are missed, m. However much that is, the reactions never pull where they may not, never exceed
  // their friction, and do no more work than their targets allow: r^T (A r - d) <= 0 but for rounding.
  static constexpr std::int64_t kMostOperations = 100'000'000;
  double solve(const ContactSystem& system, double tolerance, std::int64_t most_operations, double* reaction,
               double most_energy = INFINITY);
  // The same where the soft part is a shift that only keeps the solution bounded: solves again, most_solves times at most, with what the shift took
  // from the last solution added to the targets (iterated Tikhonov regularisation), as long as the laws are missed by no more than `met` metres.
  // Takes the shift away where nothing conflicts. coarse: [rows_end] N, the reactions before the last of these solutions. Returns by how
  // much the first solution misses the laws, m.
  double solve_without_shift(const ContactSystem& system, double tolerance, double met, int most_solves,
                             std::int64_t most_operations, double* reaction, double* coarse,
                             double most_energy = INFINITY);
  // The same as solve() by Gauss-Seidel alone, for comparison.
  double sweep(const ContactSystem& system, double tolerance, std::int64_t most_operations, double* reaction);

  const LawEffort& effort() const { return effort_; }  // of the last solution
  // One sweep and what measures it.
  static std::int64_t fewest_operations(const ContactSystem& system);
  // By how much each constraint is missed.
  static std::int64_t operations_to_look(const ContactSystem& system);

 private:
  ContactSystem with_own_compliances(const ContactSystem& system);
  double solve_again(const ContactSystem& system, double tolerance, std::int64_t most_operations, double* reaction);
  double hold(const ContactSystem& system, double most_energy, double* reaction);
  double finish(const ContactSystem& system, double tolerance, std::int64_t most_operations, double* reaction);
  bool improve(const ContactSystem& system, double tolerance, double* reaction);
  void sweep_for_a_while(const ContactSystem& system, std::int32_t sweeps, double tolerance, double* reaction);
  bool extrapolate(const ContactSystem& system, double* reaction) const;
  bool may_sweep(const ContactSystem& system) const;
  void keep_best(const ContactSystem& system, double residual, const double* reaction);

  LawNewton newton_;
  LawEffort effort_;
  std::int64_t left_ = 0;      // operations
  double best_residual_ = 0;   // m
  Mat3* own_ = nullptr;        // [constraints] m/N
  double* ahead_ = nullptr;    // [rows] m
  double* best_ = nullptr;     // [rows] N
  double* before_ = nullptr;   // [rows] N, before a sweep
  double* change_ = nullptr;   // [2][rows] N, of the last two sweeps
  double* shifted_ = nullptr;  // [rows] m, targets with the shift's part
  double* earlier_ = nullptr;  // [rows] N, before the last two solutions
};

}  // namespace palpate
