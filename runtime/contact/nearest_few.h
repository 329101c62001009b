// Which of many places near a surface a step holds, where it has no room for all.
#pragma once

#include <algorithm>
#include <cstdint>

namespace palpate {

// Calls visit(k, stays) for the items k in their order: the `most` nearest of `count`, which are more, stay, and of equally near ones the first. Returns how
// near the nearest one is that does not stay. near(k): of an item; room: [count], for the search. Cost: count.
template <class Near, class Visit>
double visit_nearest(std::int32_t count, std::int32_t most, Near near, double* room, Visit visit) {
  for (std::int32_t k = 0; k < count; ++k) room[k] = near(k);
  std::nth_element(room, room + most, room + count);
  const double beyond = room[most];
  std::int32_t equal = most;
  for (std::int32_t k = 0; k < count; ++k) equal -= near(k) < beyond;
  for (std::int32_t k = 0; k < count; ++k) {
    const double own = near(k);
    visit(k, own < beyond || (own == beyond && equal-- > 0));
  }
  return beyond;
}

}  // namespace palpate
