#include "runtime/surface/node_fans.h"

#include <algorithm>

namespace palpate {

bool NodeFans::build(SceneMemory& memory, std::int32_t nodes, const std::int32_t* triangles,
                     std::int32_t triangle_count, const std::uint8_t* active) {
  nodes_ = nodes, triangles_ = triangles, triangle_count_ = triangle_count, active_ = active;
  const auto corners = 3 * static_cast<std::size_t>(triangle_count);
  first_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes));
  next_ = memory.array<std::int32_t>(corners);
  if (active) {
    node_of_ = memory.array<std::int32_t>(corners);
    changed_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes));
    noted_ = memory.array<std::uint8_t>(static_cast<std::size_t>(nodes));
  }
  if (memory.failed()) return false;
  // A node that is split off has some of the triangles that its origin may have, so no fan becomes larger than those of all triangles.
  list_all(nullptr);
  for (std::int32_t n = 0; n < nodes; ++n) {
    std::int32_t size = 0;
    around(n, [&](std::int32_t, int) { ++size; });
    largest_ = std::max(largest_, size);
  }
  if (active) list_all(active);
  return true;
}

// From the back, so that the lists ascend.
void NodeFans::list_all(const std::uint8_t* active) {
  std::fill(first_, first_ + nodes_, -1);
  for (std::int32_t entry = 3 * triangle_count_ - 1; entry >= 0; --entry) {
    const bool is_in = !active || active[entry / 3] != 0;
    if (node_of_) node_of_[entry] = is_in ? triangles_[entry] : -1;
    if (!is_in) continue;
    next_[entry] = first_[triangles_[entry]];
    first_[triangles_[entry]] = entry;
  }
}

}  // namespace palpate
