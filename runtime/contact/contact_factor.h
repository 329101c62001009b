// The Cholesky factor of the contact matrix, scaled and shifted, whose rows come and go with the contacts; and the solution by it.
#pragma once

#include <cstdint>

#include "runtime/base/step_work.h"
#include "runtime/contact/row_matrix.h"
#include "runtime/dense/updated_cholesky.h"

namespace palpate {

class ContactFactor {
 public:
  // Near-dependent rows (a node held twice, two surface points of one triangle a micron apart, more than three in one triangle)
  // make A = D H W H^T D singular; D scales its diagonal to one. The factor is that of A + kShift I, and the solution is refined
  // up to kMostSolves - 1 times (iterated Tikhonov regularisation). Along an eigenvector of A with eigenvalue e the solution is
  // then (1 - (kShift / (e + kShift))^kMostSolves) / e times that part of D d. The factor falls with e and never exceeds
  // kMostSolves / kShift, so
  //     |D^-1 r| <= kMostSolves / kShift |D d|.
  // Separate contacts are met to (kShift / e)^2 or better, which is below single precision.
  static constexpr double kShift = 1e-6;
  static constexpr int kMostSolves = 4;
  // A second factor, of A + kSoftShift I, gives a solution in which contacts that conflict meet at a mean (ReactionLimit).
  static constexpr double kSoftShift = 0.15;
  static constexpr int kSoftSolves = 8;

  // Memory: 16 rows^2 bytes. operations: of a step (StepWork). lasts: false: there is no factor and no state,
  // and soft() alone is of use.
  bool create(SceneMemory& memory, const RowMatrix* matrix, Operations operations, bool lasts);
  void forget();

  // The rows in use, in the order of the factor; and whether there is a factor of all of them.
  std::int32_t used() const { return used_; }
  std::int32_t row_at(std::int32_t at) const { return row_at_[at]; }
  bool exists() const { return factor_.size() == used_; }
  // What stands on the diagonal of the matrix, [rows_end] m/N.
  const double* soft() const { return soft_; }

  // Where there is no factor: of all rows of the matrix.
  void shift_rows();

  void leave() {
    if (used_ > 0) factor_.clear();
  }
  void leave_soft() { soft_factor_.clear(); }
  // Rows that are not in use any more leave. False where the system is not definite.
  void drop_rows();
  // The same of few rows, of a contact that ends. There is a factor.
  void remove_rows();
  // Rows of the matrix join. False where the system is not definite.
  bool append(const std::int32_t* rows, std::int32_t count);
  // All rows anew, where there is no factor. False where the system is not definite.
  bool renew();

  // reaction: [rows_end] N, from target by the factor and by iterative refinement. Returns by how much another refinement would change
  // the scaled reactions, a share of them.
  double solve(const double* target, double* reaction) const;
  // The same by the second factor, which is computed where it is not there. False where a number is not finite.
  bool solve_soft(const double* target, double* reaction);

  // Sets the reactions of the `gone` rows to zero while all other rows keep their targets. removal: [count][capacity]. False where the
  // system is not definite. There is a factor.
  bool take_out(const std::int32_t* gone, int count, double* removal, double* left) const;

  // Stiffness: x = D (D W D + kShift)^-1 D b on some rows alone, for measure_stiffness(). Rows that hold: factored by hold_rows().
  bool hold_rows(const std::int32_t* rows, std::int32_t count);
  // By the factor of hold_rows(), of the forces that were limited, or of all rows.
  enum class Which { exact, soft };
  void solve_scaled(Which which, double* scaled) const {
    (which == Which::exact ? factor_ : soft_factor_).solve(scaled);
  }
  bool has_soft() const { return soft_factor_.size() == used_; }

  // Removing a row takes rows^2 multiply-adds and adding one half of that; a new factor takes rows^3 / 6. leave, join: contacts.
  static Operations upkeep_of(Operations rows, Operations leave, Operations join) {
    const Operations each = 3 * rows * rows, whole = rows * rows * rows / 6;
    return (smaller(each * leave, whole) + smaller(each / 2 * join, whole)) / kDense;
  }
  // Whether a step has room to keep a factor of so many rows while contacts change.
  bool affords(Operations rows) const { return upkeep_of(rows, 1, 1) <= most_operations_ / 4; }

 private:
  static Operations smaller(Operations a, Operations b) { return a < b ? a : b; }
  std::int32_t close_up();
  void write_scaled(const std::int32_t* order, const std::int32_t* rows, std::int32_t count, double shift,
                    UpdatedCholesky* factor) const;
  template <class Shift>
  double refine(const UpdatedCholesky& factor, Shift shift, int most_solves, const double* target,
                double* reaction) const;

  const RowMatrix* matrix_ = nullptr;
  Operations most_operations_ = INT64_MAX;
  UpdatedCholesky factor_;
  UpdatedCholesky soft_factor_;     // in the order of factor_; without rows where it is not computed
  double* shift_ = nullptr;         // [rows] added to the scaled diagonal, kShift or more
  double* soft_ = nullptr;          // [rows] m/N
  std::int32_t* row_at_ = nullptr;  // [rows]
  std::int32_t used_ = 0;
  std::int32_t* list_ = nullptr;  // [rows]
  double* work_ = nullptr;        // [2][rows]
};

}  // namespace palpate
