// The limit of the reactions where targets conflict.
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/base/step_work.h"
#include "runtime/contact/contact_matrix.h"

namespace palpate {

// Two surface points of one triangle that move apart by d are met only if the triangle's vertices move by d over their distance in
// edges, however much that is. So the reaction r_i of each row has a limit, in multiples of the force that the row alone would need
// for the largest target d of the step:
//     |r_i| <= most d / A_ii,      A = H W H^T here.
// most is kMostForceNear where no contact node moves farther than the largest target, as with many nodes held at targets of their own.
// It falls with the reciprocal of how many times farther one moves, down to kMostForce.
// Where the solution exceeds the limit, a second one is computed in the same way, with ContactFactor's kSoftShift: contacts that
// agree are met to (kSoftShift / (e + kSoftShift))^kSoftSolves, those that conflict meet at a mean. The answer is the point on the
// line between the two that is nearest to the first one and within the limit. It changes continuously with the targets, and along
// each eigenvector of D A D it is at most the exact solution. So r^T A r <= r^T d, and by |u_v|^2 <= |C_vv| r^T A r (surface_tree.h)
// no node v of the organ moves farther than sqrt(most |C_vv| sum_i 1 / A_ii) d.
// Under laws the limit is kMostForce for contacts that may release or slip, and a part of their laws. Of the others beside these, as
// grips are, both solutions are solutions of the laws: in the second one only their rows are soft. Two grips that contradict each
// other meet at a mean; to let each of them end at its limit would free the node between them. All reactions between two that obey
// friction obey it, too.
class ReactionLimit {
 public:
  static constexpr double kMostForce = 64, kMostForceNear = 1024;

  bool create(SceneMemory& memory, const ContactMatrix* matrix);
  // most_target: m, the largest size of a target of the step. The rows are the matrix's.
  void set(const ContactConstraint* constraints, std::int32_t count, double most_target);

  // [rows_end] N, of rows whose laws limit them; infinite for all others.
  const double* of_laws() const { return most_; }
  // The rows that are limited here: all, or those that the laws do not limit.
  enum class Rows { all, beside_laws };
  bool covers(Rows rows, std::int32_t row) const { return rows == Rows::all || !std::isfinite(most_[row]); }
  // The limit of the reactions, as a multiple of what their rows alone would need, where one of them exceeds it; else 0. Reads the nodes'
  // displacements where the step's work has room for that. force: [node_count], overwritten. kept: operations that come after it.
  double exceeded(Rows rows, const ContactConstraints& set, const double* reaction, Operations kept, Vec3* force,
                  StepWork* work) const;
  // The reactions `soft` are brought within the limit, by one factor, and then go as far towards `reaction` as the limit allows.
  void go_within(Rows rows, double most, const double* soft, double* reaction) const;

 private:
  double alone(std::int32_t row) const { return most_target_ * matrix_->scale(row) * matrix_->scale(row); }
  double largest_share(Rows rows, const double* reaction) const;

  const ContactMatrix* matrix_ = nullptr;
  double most_target_ = 0;
  double* most_ = nullptr;  // [rows]
};

}  // namespace palpate
