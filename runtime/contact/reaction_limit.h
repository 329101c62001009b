// The limit of the reactions where targets conflict.
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_laws.h"

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

  // rows: most of the system.
  bool create(SceneMemory& memory, std::int32_t rows);
  // A system whose largest target is most_target (m). scale: [rows_end] 1 / sqrt(A_ii); 0: the row is not in use. rows_of: [count].
  // Returns whether laws limit any.
  bool set(const double* scale, std::int32_t rows_end, const ContactConstraint* constraints,
           const RowsOfConstraint* rows_of, std::int32_t count, double most_target);

  // [rows_end] N, of rows whose laws limit them; infinite for all others.
  const double* of_laws() const { return most_; }
  // The rows that are limited here: all, or those that the laws do not limit.
  enum class Rows { all, beside_laws };
  bool covers(Rows rows, std::int32_t row) const { return rows == Rows::all || !std::isfinite(most_[row]); }
  // The limit of the reactions, as a multiple of what their rows alone would need, where one of them exceeds it; else 0. thrown(): m, how
  // far the reactions move a contact node at most; below 0: the step's work has no room to tell. It is asked seldom.
  template <class Thrown>
  double exceeded(Rows rows, const double* reaction, Thrown thrown) const {
    const double share = largest_share(rows, reaction);
    if (!(share > kMostForce)) return 0;
    const double farthest = thrown();
    if (farthest < 0) return kMostForce;
    const double most = most_near(farthest / most_target_);
    return share > most ? most : 0;
  }
  // The reactions `soft` are brought within the limit, by one factor, and then go as far towards `reaction` as the limit allows.
  void go_within(Rows rows, double most, const double* soft, double* reaction) const;

 private:
  static double most_near(double thrown) {
    const double most = kMostForceNear / thrown;
    return most < kMostForce ? kMostForce : most > kMostForceNear ? kMostForceNear : most;
  }
  double alone(std::int32_t row) const { return most_target_ * scale_[row] * scale_[row]; }
  double largest_share(Rows rows, const double* reaction) const;

  const double* scale_ = nullptr;
  std::int32_t rows_end_ = 0;
  double most_target_ = 0;
  double* most_ = nullptr;  // [rows]
};

}  // namespace palpate
