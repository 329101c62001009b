#include "runtime/cut/cut_log.h"

#include <algorithm>

namespace palpate {

bool CutLog::create(SceneMemory& memory, std::int32_t most) {
  most_ = most;
  log_ = memory.array<std::int32_t>(static_cast<std::size_t>(most));
  memory.keep(used_), memory.keep(change_), memory.keep(at_);
  memory.keep_array(log_, static_cast<std::size_t>(most), used_);
  return !memory.failed();
}

std::int32_t CutLog::numbers_of(const CutMeshChange& change) {
  const std::int32_t nodes = change.end_node - change.first_node, removed = change.removed_tetrahedra.count;
  return kHead + 2 * nodes + 5 * change.tetrahedra.count + removed + 2 * (2 * nodes + removed + kMostHolds);
}

void CutLog::add(const CutMesh& mesh) {
  const CutMeshChange& change = mesh.change();
  change_ = used_;
  std::int32_t* at = log_ + used_;
  *at++ = 0, *at++ = change.end_node - change.first_node;
  *at++ = change.tetrahedra.count, *at++ = change.removed_tetrahedra.count;
  // Of a node that was split twice in the step, the compliance sees both new ones come from it: the tetrahedra have their last corners.
  for (std::int32_t n = change.first_node; n < change.end_node; ++n) {
    std::int32_t from = mesh.from(n);
    while (from >= change.first_node) from = mesh.from(from);
    *at++ = n, *at++ = from;
  }
  for (const std::int32_t t : change.tetrahedra) {
    *at++ = t;
    at = std::copy_n(mesh.nodes_of(t), 4, at);
  }
  at = std::copy(change.removed_tetrahedra.begin(), change.removed_tetrahedra.end(), at);
  used_ = at_ = static_cast<std::int32_t>(at - log_);
  log_[change_] = used_ - change_;
}

void CutLog::add(Unit::Kind kind, std::int32_t number) {
  log_[used_++] = kind, log_[used_++] = number;
  log_[change_] = used_ - change_;
}

CutLog::Unit CutLog::unit_at(std::int32_t change, std::int32_t at) const {
  const std::int32_t *const head = log_ + change, *const nodes = head + kHead, *const moved = nodes + 2 * head[1],
                            *const removed = moved + 5 * head[2];
  Unit unit{static_cast<Unit::Kind>(log_[at]), log_[at + 1], {}};
  // Both are rows of numbers in the order of their fields.
  static_assert(sizeof(CutChange::NewNode) == 2 * sizeof(std::int32_t));
  static_assert(sizeof(CutChange::Moved) == 5 * sizeof(std::int32_t));
  unit.change.new_nodes = reinterpret_cast<const CutChange::NewNode*>(nodes);
  unit.change.moved = reinterpret_cast<const CutChange::Moved*>(moved);
  unit.change.removed = removed;
  unit.change.new_node_count = head[1], unit.change.moved_count = head[2], unit.change.removed_count = head[3];
  return unit;
}

}  // namespace palpate
