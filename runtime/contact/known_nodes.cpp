#include "runtime/contact/known_nodes.h"

namespace palpate {

bool KnownNodes::create(SceneMemory& memory, std::int32_t nodes) {
  nodes_ = nodes;
  at_ = memory.array<Vec3>(static_cast<std::size_t>(nodes));
  stamp_ = memory.array<std::uint32_t>(static_cast<std::size_t>(nodes));
  return !memory.failed();
}

void KnownNodes::keep_state(SceneMemory& memory) {
  memory.keep(now_);
  memory.keep(count_);
  memory.keep(few_);
  memory.keep_array(at_, static_cast<std::size_t>(nodes_));
  memory.keep_array(stamp_, static_cast<std::size_t>(nodes_));
}

void KnownNodes::forget() {
  count_ = 0;
  if (++now_ != 0) return;
  std::fill(stamp_, stamp_ + nodes_, 0u);
  now_ = 1;
}

void KnownNodes::expect(std::int32_t acting, bool many) {
  few_ = static_cast<std::int32_t>(
      std::min<Operations>(nodes_ / (many ? kFewAgain : kFew), kMostOneByOne / alone(acting)));
}

}  // namespace palpate
