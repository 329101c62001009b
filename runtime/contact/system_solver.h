// Reactions of a system of rows that meet their targets and obey their laws: of one organ's contacts, or of several organs' together.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_factor.h"
#include "runtime/contact/law_solver.h"
#include "runtime/contact/reaction_limit.h"

namespace palpate {

// The constraints of a system and their rows.
struct ConstraintRows {
  const ContactConstraint* constraints = nullptr;  // [count]
  const RowsOfConstraint* rows = nullptr;          // [count]
  std::int32_t count = 0;
};

// The nodes that the rows hold, as the solver asks about them. No function is pure: a library without C++ runtime has none of these.
class NodesOfRows {
 public:
  // m: how far the reactions move a contact node at most. Below 0: the step's work has no room for the answer. kept: operations that are left
  // for later work.
  virtual double farthest(const double* /*reaction*/, Operations /*kept*/, StepWork*) { return -1; }
  // Products with the matrix go through these nodes; nullptr: through the rows, of which so many are in use.
  virtual const SharedNodes* share(std::int32_t /*rows*/, Operations /*kept*/, StepWork*) { return nullptr; }

 protected:
  ~NodesOfRows() = default;
};

class SystemSolver {
 public:
  enum class Outcome { solved, regularised, unsolved };

  // A law counts as met where it is missed by no more than kMet of the largest target of the step, plus kLeastMiss metres.
  static constexpr double kMet = 1e-6, kLeastMiss = 1e-9;

  struct Limits {
    std::int32_t nodes = 0;             // of a system that shares nodes
    Operations operations = INT64_MAX;  // of a step (StepWork)
    bool lasts = true;                  // false: each solve has another system. There is no factor, and nothing is kept
  };
  bool create(SceneMemory& memory, const RowMatrix* matrix, const Limits& limits);
  void forget();
  // Completes a restored state: of the last solve.
  void restored(const ConstraintRows& of) {
    of_ = of;
    set_limits();
  }

  // [rows_end] m and N: the caller writes the targets, and where rows begin their reactions, before begin().
  double* targets() { return target_; }
  double* reactions() { return reaction_; }
  const double* targets() const { return target_; }
  const double* reactions() const { return reaction_; }
  const double* last() const { return last_; }  // N, where the solve began
  const double* coarse() const {
    return coarse_;
  }  // N, before the last refinement, which took away what the shift does
  void set_reaction(std::int32_t row, double reaction, double coarse) {
    reaction_[row] = reaction, coarse_[row] = coarse;
  }
  ContactFactor& factor() { return factor_; }
  const ContactFactor& factor() const { return factor_; }

  // Begins a solve of these constraints.
  void begin(const ConstraintRows& of);
  //   solved       the targets are met, or the laws as far as doubt_of() tells
  //   regularised  some targets conflict; residual() says by how much they are missed
  //   unsolved     the system is not definite
  Outcome solve(NodesOfRows& nodes, StepWork* work);
  // In place of both, of reactions that another system has found.
  void take_reactions(const ConstraintRows& of, const LawEffort& effort);

  const ContactResidual& residual() const { return residual_; }
  const LawEffort& effort() const { return effort_; }  // all zero where the factor alone solved the system
  bool by_laws() const { return decided_ != 0; }       // LawSolver had to decide
  bool gave_way() const { return gives_way_ != 0; }
  double tolerance() const { return kSettled * most_target_; }
  // Why constraint p is not to be trusted, where laws decided.
  struct Doubt {
    bool inexact;   // its law is missed: LawSolver came to its limit
    bool conflict;  // the shift alone makes its law hold: contacts conflict
  };
  Doubt doubt_of(std::int32_t p) const { return decided_ ? doubt_[p] : Doubt{}; }
  ContactSystem system(const ConstraintRows& of) const;
  const ConstraintRows& rows() const { return of_; }
  LawSolver& laws() { return laws_; }

  // solve() takes at least three looks at the system (law_solver.h).
  static Operations operations_for(Operations rows, Operations constraints) {
    return 3 * (rows * rows + 200 * constraints) / kDense;
  }

  // Constraints of the last solve whose targets move alike.
  struct MovedAlike {
    const std::int32_t* constraint = nullptr;  // [count] -1: none
    const double* way = nullptr;               // [count] of each one's target, where the group moves by 1; nullptr: 1
    std::int32_t count = 0;
    // Calls visit(row, share, way) for the rows of the constraints: their share along an axis of the organ. axes(p): of constraint p.
    template <class Axes, class Visit>
    void for_each_row(const RowsOfConstraint* rows, int axis, const Axes& axes, const Visit& visit) const {
      for (std::int32_t k = 0; k < count; ++k)
        for (int i = 0; i < 3 && constraint[k] >= 0; ++i) {
          const std::int32_t row = rows[constraint[k]].at[i];
          const double share = axes(constraint[k]).m[i][axis];
          if (row >= 0 && share != 0) visit(row, share, way ? way[k] : 1);
        }
    }
  };
  // N/m, [3 count][3 count]: by how much the sum of the reactions of such constraints grows along x, y and z as those of the same or another
  // group move, while all rows hold that now hold. Where the step's work has no room for that, by how much it would if each row were
  // alone, which is less. kept: operations that are to be left. Cost in multiply-adds: 3 count rows^2 and, where laws decided, rows^3 / 6.
  static constexpr int kMostMovedAlike = PALPATE_MAX_TOOLS;
  void measure_stiffness(const MovedAlike* groups, int count, Operations kept, StepWork* work, double* stiffness);

 private:
  // LawSolver ends where it misses the laws by this share of the largest target. Its solution is refined where refining would
  // move it by more.
  static constexpr double kSettled = 1e-10;

  Vec3 reaction(std::int32_t p) const;
  void take_rows(const ConstraintRows& of);
  void set_limits() {
    has_laws_ = limit_.set(matrix_->scale, matrix_->rows_end, of_.constraints, of_.rows, of_.count, most_target_);
  }
  bool renew_factor(StepWork* work);
  bool contacts_give_way() const;
  std::int32_t find_rows_that_hold(std::int32_t* rows) const;
  Operations squared_rows() const { return Operations{matrix_->rows_end} * matrix_->rows_end; }
  Operations least_operations() const { return operations_for(matrix_->rows_end, of_.count); }
  enum class Limiting { within, limited, no_room };
  Limiting limit_forces(NodesOfRows& nodes, Operations kept, StepWork* work);
  void limit_grips(NodesOfRows& nodes, const ContactSystem& laws, StepWork* work);
  void solve_laws(const ContactSystem& laws, int most_solves, Operations kept, StepWork* work);
  static Operations operations_to_look(const ContactSystem& laws) {
    return LawSolver::operations_to_look(laws) / kDense + 1;
  }
  void decide_by_laws(NodesOfRows& nodes, bool solved, StepWork* work);
  void measure_laws(const ContactSystem& laws);
  void measure_residual();

  const RowMatrix* matrix_ = nullptr;
  ContactFactor factor_;
  ReactionLimit limit_;
  LawSolver laws_;
  ConstraintRows of_;
  bool lasts_ = true;
  double* target_ = nullptr;      // [rows] m
  double most_target_ = 0;        // m, the largest size of a target
  double* reaction_ = nullptr;    // [rows] N
  double* last_ = nullptr;        // [rows] N
  double* coarse_ = nullptr;      // [rows] N
  double* softened_ = nullptr;    // [rows] m/N, soft() with kSoftShift where contacts do not give way
  double* work_ = nullptr;        // [3][rows]
  Doubt* doubt_ = nullptr;        // [2][constraints] in the second half: before grips were limited
  std::int32_t* list_ = nullptr;  // [rows]
  LawEffort effort_;
  ContactResidual residual_;
  double energy_ = 0, last_energy_ = 0;  // J, r^T A r: of the last solve; of the one before
  // 1: in the last solve laws decided that some contacts release, slip or are at a limit. Then the factor does not solve the next step
  // either, as a rule: it is not renewed.
  std::int32_t gives_way_ = 0;
  std::int32_t decided_ = 0;
  bool has_laws_ = false;  // some constraints may give way
  bool limited_ = false;   // the last solve brought forces within their limit
};

}  // namespace palpate
