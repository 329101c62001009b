#include "runtime/contact/law_newton.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_lu.h"
#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

constexpr int kHalvings = 4;      // tries of a direction, each half as long
constexpr double kServes = 0.5;   // a factor is kept while a step with it reduces the error to this share
constexpr double kEnough = 1e-4;  // a share of the direction that a step must reduce the error by, at least

const double* matrix_row(const ContactSystem& system, std::int32_t row) {
  return system.matrix + static_cast<std::size_t>(row) * system.stride;
}

bool may_release(const ContactConstraint& constraint) {
  return constraint.law == ContactLaw::unilateral || constraint.law == ContactLaw::coulomb;
}

// How a contact under friction slips, where one step of the projection leaves the tangential forces up to `most` that friction allows.
struct Slip {
  bool slips;
  double share;    // of the step's length that the projection leaves
  Vec3 direction;  // of the friction; x is zero
};
Slip slip_of(double compliance, Vec3 r, Vec3 ahead, double most) {
  const Vec3 to = {0, r.y - ahead.y / compliance, r.z - ahead.z / compliance};
  const double size = length(to);
  if (size < most || (size == most && most > 0)) return {false, 1, {}};
  return {true, size > 0 ? most / size : 0, size > 0 ? (1 / size) * to : Vec3{}};
}

}  // namespace

bool LawNewton::create(SceneMemory& memory, std::int32_t rows, std::int32_t contact_nodes) {
  capacity_ = std::min(rows, kMostRows);
  const std::size_t most = static_cast<std::size_t>(capacity_), all = static_cast<std::size_t>(rows);
  stride_ = odd_lines(most + 16);  // room for the numbers that factor_lu overwrites after a row's end
  factor_ = memory.array<double>(most * stride_);
  solution_ = memory.array<double>(most);
  equations_ = memory.array<Equation>(most);
  change_ = memory.array<double>(all);
  further_ = memory.array<double>(all);
  trial_ = memory.array<double>(2 * all);
  return shared_.create(memory, contact_nodes, rows / 3) && !memory.failed();
}

// Releases contacts and lists the equations of all others. False where there are too many. The factor is lost where the list is
// not that of the factor.
bool LawNewton::list_equations(const ContactSystem& system, double* reaction, double* ahead) {
  bool same = size_ >= 0, any_released = false;
  const auto put = [&](std::int32_t row, double now) {
    any_released = any_released || reaction[row] != now;
    reaction[row] = now;
  };
  count_ = 0;
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const std::int32_t* const row = system.rows[p].at;
    if (may_release(system.constraints[p])) {
      const double own = row[0] < 0 ? 0 : matrix_row(system, row[0])[row[0]] + system.soft[row[0]];
      if (row[0] < 0 || !(reaction[row[0]] * own > ahead[row[0]])) {
        for (int i = 0; i < 3; ++i)
          if (row[i] >= 0) put(row[i], 0);
        continue;
      }
    }
    for (std::int32_t i = 0; i < 3; ++i) {
      if (row[i] < 0) continue;
      // A row that the law keeps at its limit has no equation either.
      const bool limited = system.most || (i == 0 && system.constraints[p].limit > 0);
      if (limited && (system.constraints[p].law != ContactLaw::coulomb || i == 0)) {
        const double own = matrix_row(system, row[i])[row[i]] + system.soft[row[i]], most = most_of(system, p)[i],
                     next = reaction[row[i]] * own - ahead[row[i]];
        if (std::fabs(next) >= own * most) {
          put(row[i], next > 0 ? most : -most);
          continue;
        }
      }
      if (count_ == capacity_) return false;
      same = same && count_ < size_ && equations_[count_].constraint == p && equations_[count_].axis == i;
      equations_[count_++] = {p, i};
    }
  }
  if (any_released) find_ahead(system, reaction, ahead);
  if (!same || size_ != count_) size_ = -1;
  return true;
}

LawNewton::Derivative LawNewton::derivative_of(const ContactSystem& system, std::int32_t p, Vec3 r, Vec3 ahead) {
  Derivative derivative;
  for (int i = 0; i < 3; ++i) derivative.weight.m[i][i] = 1;
  if (system.constraints[p].law != ContactLaw::coulomb) return derivative;
  const Mat3 own = own_compliance(system, p);
  const double compliance = std::max(own.m[1][1], own.m[2][2]);
  const Vec3 most = most_of(system, p);
  const double limit = most_friction(system.constraints[p], r.x, most);
  const Slip slip = slip_of(compliance, r, ahead, limit);
  for (int i = 1; slip.slips && i < 3; ++i) {
    for (int j = 1; j < 3; ++j) {
      derivative.weight.m[i][j] = slip.share * ((i == j ? 1 : 0) - slip.direction[i] * slip.direction[j]);
      derivative.beside.m[i][j] = compliance * ((i == j ? 1 : 0) - derivative.weight.m[i][j]);
    }
    if (r.x > 0 && limit < std::min(most.y, most.z))
      derivative.beside.m[i][0] = -compliance * system.constraints[p].friction * slip.direction[i];
  }
  return derivative;
}

// One row of the derivative: m per N, by the reactions of the listed equations.
void LawNewton::write_equation(const ContactSystem& system, Equation equation, const Derivative& derivative,
                               double* to) const {
  const std::int32_t p = equation.constraint, i = equation.axis;
  const std::int32_t* const own_row = system.rows[p].at;
  const double *const weight = derivative.weight.m[i], *const beside = derivative.beside.m[i];
  const double* row[3];
  double share[3];
  int shares = 0;  // one, but for friction that slips
  for (int j = 0; j < 3; ++j)
    if (weight[j] != 0 && own_row[j] >= 0) row[shares] = matrix_row(system, own_row[j]), share[shares++] = weight[j];
  for (std::int32_t e = 0; e < count_; ++e) {
    const std::int32_t column = system.rows[equations_[e].constraint].at[equations_[e].axis];
    double sum = 0;
    for (int k = 0; k < shares; ++k) sum += share[k] * row[k][column];
    if (equations_[e].constraint == p) {
      const std::int32_t j = equations_[e].axis;
      sum += beside[j] + weight[j] * system.soft[column];
    }
    to[e] = sum;
  }
}

// Where few contacts are not released, their own equations are fewer than the axes of the nodes.
bool LawNewton::goes_through_nodes(const ContactSystem& system) const {
  const std::int64_t count = count_;
  return system.shared && SharedNewton::operations_to_factor(system) < count * count * count / 3 + 3 * count * count;
}
std::int64_t LawNewton::operations_to_factor(const ContactSystem& system) const {
  const std::int64_t count = count_;
  return goes_through_nodes(system) ? SharedNewton::operations_to_factor(system)
                                    : count * count * count / 3 + 3 * count * count;
}
// With the present factor, or with the next one where there is none.
std::int64_t LawNewton::operations_to_solve(const ContactSystem& system) const {
  const bool nodes = size_ >= 0 ? through_nodes_ : goes_through_nodes(system);
  return nodes ? SharedNewton::operations_to_solve(system) : std::int64_t{count_} * count_;
}

bool LawNewton::factor(const ContactSystem& system, const double* reaction, const double* ahead) {
  through_nodes_ = goes_through_nodes(system);
  if (through_nodes_) return factor_shared(system, reaction, ahead);
  Derivative derivative;
  for (std::int32_t e = 0, last = -1; e < count_; ++e) {
    const std::int32_t p = equations_[e].constraint;
    if (p != last) derivative = derivative_of(system, p, gather(system, reaction, p), gather(system, ahead, p));
    last = p;
    write_equation(system, equations_[e], derivative, factor_ + static_cast<std::size_t>(e) * stride_);
  }
  size_ = factor_lu(count_, factor_, stride_) ? count_ : -1;
  return size_ >= 0;
}

bool LawNewton::factor_shared(const ContactSystem& system, const double* reaction, const double* ahead) {
  shared_.begin(system);
  for (std::int32_t e = 0; e < count_;) {
    const std::int32_t p = equations_[e].constraint;
    bool has[3] = {};
    for (; e < count_ && equations_[e].constraint == p; ++e) has[equations_[e].axis] = true;
    Derivative derivative = derivative_of(system, p, gather(system, reaction, p), gather(system, ahead, p));
    Mat3 alone;  // what a constraint's reactions do by themselves, without the nodes
    for (int i = 0; i < 3; ++i) {
      const std::int32_t row = system.rows[p].at[i];
      for (int j = 0; j < 3; ++j)
        if (row >= 0 && system.rows[p].at[j] >= 0)
          alone.m[i][j] = system.constraints[p].local.m[i][j] + (i == j ? system.soft[row] : 0);
      for (int j = 0; row < 0 && j < 3; ++j) derivative.weight.m[j][i] = 0;
    }
    Mat3 own = derivative.weight * alone;
    add_scaled(own, 1, derivative.beside);
    shared_.add(system, p, own, derivative.weight, has);
  }
  size_ = shared_.factor(system, factor_, stride_) ? count_ : -1;
  return size_ >= 0;
}

void LawNewton::find_direction(const ContactSystem& system, const double* reaction, const double* ahead) {
  Vec3 off;
  for (std::int32_t e = 0, last = -1; e < count_; ++e) {
    const std::int32_t p = equations_[e].constraint;
    if (p != last)
      off = missed_by_law(system.constraints[p], own_compliance(system, p), gather(system, reaction, p),
                          gather(system, ahead, p), most_of(system, p));
    last = p;
    solution_[e] = -off[equations_[e].axis];
  }
  if (!through_nodes_) solve_lu(count_, factor_, stride_, solution_);
  std::fill(change_, change_ + system.rows_end, 0.0);
  for (std::int32_t e = 0; e < count_; ++e)
    change_[system.rows[equations_[e].constraint].at[equations_[e].axis]] = solution_[e];
  if (through_nodes_) shared_.solve(system, change_);
  find_product(system, change_, further_);
}

// m, the length of all that the laws miss.
double LawNewton::error(const ContactSystem& system, const double* reaction, const double* ahead) const {
  double sum = 0;
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const Vec3 off = missed_by_law(system.constraints[p], own_compliance(system, p), gather(system, reaction, p),
                                   gather(system, ahead, p), most_of(system, p));
    sum += dot(off, off);
  }
  return std::sqrt(sum);
}

// A direction of a new factor may make the error larger than the last one, but not than the last three.
bool LawNewton::move(const ContactSystem& system, bool is_new, double* reaction, double* ahead) {
  const std::int32_t rows = system.rows_end;
  double *const trial = trial_, *const trial_ahead = trial_ + rows;
  const double before = error(system, reaction, ahead);
  recent_[2] = recent_[1], recent_[1] = recent_[0], recent_[0] = before;
  const double most = std::max({recent_[0], recent_[1], recent_[2]});
  double share = 1;
  for (int halving = 0; halving < (is_new ? kHalvings : 1); ++halving, share *= 0.5) {
    for (std::int32_t i = 0; i < rows; ++i) {
      trial[i] = reaction[i] + share * change_[i];
      trial_ahead[i] = ahead[i] + share * further_[i];
    }
    const double now = error(system, trial, trial_ahead);
    if (!(now < (is_new ? (1 - kEnough * share) * most : kServes * before))) continue;
    std::copy(trial, trial + rows, reaction);
    std::copy(trial_ahead, trial_ahead + rows, ahead);
    if (now > kServes * before) size_ = -1;
    return true;
  }
  size_ = -1;
  return false;
}

bool LawNewton::step(const ContactSystem& system, double* reaction, double* ahead, std::int64_t* operations) {
  const std::int64_t of_product = operations_of_product(system);
  if (*operations < of_product) return false;
  *operations -= of_product;
  if (!list_equations(system, reaction, ahead)) return false;
  // Each measure of the error takes as long as some 150 multiply-adds of long rows for a constraint.
  const std::int64_t of_error = 150 * std::int64_t{system.constraint_count},
                     of_factor = operations_to_factor(system) + kHalvings * of_error,
                     of_step = of_product + operations_to_solve(system) + 3 * of_error;
  for (;;) {
    const bool is_new = size_ < 0;
    if (*operations < of_step + (is_new ? of_factor : 0)) return false;
    *operations -= of_step + (is_new ? of_factor : 0);
    if (is_new && !factor(system, reaction, ahead)) return false;
    find_direction(system, reaction, ahead);
    if (move(system, is_new, reaction, ahead)) return true;
    if (is_new) return false;
  }
}

}  // namespace palpate
