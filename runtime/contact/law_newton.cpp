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

bool LawNewton::create(SceneMemory& memory, std::int32_t rows) {
  capacity_ = std::min(rows, kMostRows);
  const std::size_t most = static_cast<std::size_t>(capacity_), all = static_cast<std::size_t>(rows);
  stride_ = odd_lines(most + 16);  // room for the numbers that factor_lu overwrites after a row's end
  factor_ = memory.array<double>(most * stride_);
  solution_ = memory.array<double>(most);
  equations_ = memory.array<Equation>(most);
  change_ = memory.array<double>(all);
  further_ = memory.array<double>(all);
  trial_ = memory.array<double>(2 * all);
  return !memory.failed();
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
      if (system.most && (system.constraints[p].law != ContactLaw::coulomb || i == 0)) {
        const double own = matrix_row(system, row[i])[row[i]] + system.soft[row[i]], most = system.most[row[i]],
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

// One row of the derivative: m per N, by the reactions of the listed equations.
void LawNewton::write_equation(const ContactSystem& system, Equation equation, Vec3 r, Vec3 ahead, double* to) const {
  const std::int32_t p = equation.constraint, i = equation.axis;
  const std::int32_t* const own_row = system.rows[p].at;
  // Weights of the matrix' rows of this contact, and what stands beside them in its own columns.
  double weight[3] = {}, beside[3] = {};
  weight[i] = 1;
  if (system.constraints[p].law == ContactLaw::coulomb && i > 0) {
    const Mat3 own = own_compliance(system, p);
    const double compliance = std::max(own.m[1][1], own.m[2][2]);
    const Vec3 most = most_of(system, p);
    const double limit = most_friction(system.constraints[p], r.x, most);
    const Slip slip = slip_of(compliance, r, ahead, limit);
    for (int j = 1; slip.slips && j < 3; ++j) {
      weight[j] = slip.share * ((i == j ? 1 : 0) - slip.direction[i] * slip.direction[j]);
      beside[j] = compliance * ((i == j ? 1 : 0) - weight[j]);
    }
    if (slip.slips && r.x > 0 && limit < std::min(most.y, most.z))
      beside[0] = -compliance * system.constraints[p].friction * slip.direction[i];
  }
  for (std::int32_t e = 0; e < count_; ++e) {
    const std::int32_t column = system.rows[equations_[e].constraint].at[equations_[e].axis];
    double sum = 0;
    for (int j = 0; j < 3; ++j)
      if (weight[j] != 0 && own_row[j] >= 0) sum += weight[j] * matrix_row(system, own_row[j])[column];
    if (equations_[e].constraint == p) {
      const std::int32_t j = equations_[e].axis;
      sum += beside[j] + weight[j] * system.soft[column];
    }
    to[e] = sum;
  }
}

bool LawNewton::factor(const ContactSystem& system, const double* reaction, const double* ahead) {
  for (std::int32_t e = 0; e < count_; ++e) {
    const std::int32_t p = equations_[e].constraint;
    write_equation(system, equations_[e], gather(system, reaction, p), gather(system, ahead, p),
                   factor_ + static_cast<std::size_t>(e) * stride_);
  }
  size_ = factor_lu(count_, factor_, stride_) ? count_ : -1;
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
  solve_lu(count_, factor_, stride_, solution_);
  std::fill(change_, change_ + system.rows_end, 0.0);
  for (std::int32_t e = 0; e < count_; ++e)
    change_[system.rows[equations_[e].constraint].at[equations_[e].axis]] = solution_[e];
  for (std::int32_t p = 0; p < system.constraint_count; ++p)
    for (const std::int32_t row : system.rows[p].at)
      if (row >= 0)
        further_[row] = dot_rows(system.rows_end, matrix_row(system, row), change_) + system.soft[row] * change_[row];
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
  const std::int64_t all = system.rows_end;
  if (*operations < all * all) return false;
  *operations -= all * all;
  if (!list_equations(system, reaction, ahead)) return false;
  // Each measure of the error takes as long as some 150 multiply-adds of long rows for a constraint.
  const std::int64_t count = count_, of_error = 150 * std::int64_t{system.constraint_count},
                     of_factor = count * count * count / 3 + 3 * count * count + kHalvings * of_error,
                     of_step = all * all + count * count + 3 * of_error;
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
