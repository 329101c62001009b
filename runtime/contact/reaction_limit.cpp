#include "runtime/contact/reaction_limit.h"

#include <algorithm>
#include <cmath>

namespace palpate {

bool ReactionLimit::create(SceneMemory& memory, std::int32_t rows) {
  most_ = memory.array<double>(static_cast<std::size_t>(rows));
  return !memory.failed();
}

bool ReactionLimit::set(const double* scale, std::int32_t rows_end, const ContactConstraint* constraints,
                        const RowsOfConstraint* rows_of, std::int32_t count, double most_target) {
  scale_ = scale, rows_end_ = rows_end, most_target_ = most_target;
  std::fill(most_, most_ + rows_end, INFINITY);
  bool any = false;
  for (std::int32_t p = 0; p < count; ++p) {
    if (!may_give_way(constraints[p])) continue;
    any = true;
    for (const std::int32_t row : rows_of[p].at)
      if (row >= 0) most_[row] = kMostForce * most_target_ * scale_[row] * scale_[row];
  }
  return any;
}

// The largest reaction over the force that its row alone would need for the largest target; kMostForce where none exceeds it, as a
// rule: all rows are asked that first, without a branch.
double ReactionLimit::largest_share(Rows rows, const double* reaction) const {
  const auto exceeds = [&](std::int32_t row, double share) {
    return (scale_[row] != 0) & (std::fabs(reaction[row]) > share * alone(row));
  };
  bool any = false;
  for (std::int32_t row = 0; row < rows_end_; ++row) any |= exceeds(row, kMostForce);
  double most = kMostForce;
  for (std::int32_t row = 0; row < rows_end_ && any; ++row)
    if (covers(rows, row) && exceeds(row, most)) most = std::fabs(reaction[row]) / alone(row);
  return most;
}

void ReactionLimit::go_within(Rows rows, double most, const double* soft, double* reaction) const {
  const double within = 1 / std::max(1.0, largest_share(rows, soft) / most);
  double way = 1;
  for (std::int32_t row = 0; row < rows_end_; ++row) {
    const double scale = scale_[row], from = within * soft[row], whole = reaction[row] - from,
                 room = most * most_target_ * scale * scale - (whole > 0 ? from : -from);
    if (scale != 0 && covers(rows, row) && std::fabs(whole) * way > room) way = std::max(0.0, room / std::fabs(whole));
  }
  for (std::int32_t row = 0; row < rows_end_; ++row) {
    const double from = within * soft[row];
    if (scale_[row] != 0) reaction[row] = from + way * (reaction[row] - from);
  }
}

}  // namespace palpate
