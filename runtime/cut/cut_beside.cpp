#include "runtime/cut/cut_beside.h"

#include <algorithm>

namespace palpate {
namespace {

// Numbers of the stream for each new node and each tetrahedron.
constexpr std::int32_t kOfNode = 400, kOfTetrahedron = 16;

}  // namespace

bool CutBeside::create(SceneMemory& memory, const CutLarge::Parts& parts, const CutTriangles& surface,
                       const double* rest) {
  nodes_ = parts.surface_nodes, triangle_count_ = surface.count();
  const auto corners = 3 * static_cast<std::size_t>(triangle_count_), count = static_cast<std::size_t>(triangle_count_);
  const auto numbers = 3 * static_cast<std::size_t>(nodes_);
  rest_ = memory.array<double>(numbers);
  for (std::int32_t** list : {&triangles_, &uncut_}) *list = memory.array<std::int32_t>(corners);
  for (std::uint8_t** list : {&active_, &uncut_active_}) *list = memory.array<std::uint8_t>(count);
  const std::int32_t most = kOfNode * parts.capacity.new_nodes + kOfTetrahedron * parts.body->tetrahedron_count;
  if (memory.failed() || !stream_.create(memory, most) || !body_.create(memory, parts, nullptr)) return false;
  std::copy_n(rest, numbers, rest_);
  std::copy_n(surface.triangles(), corners, uncut_), std::copy_n(surface.active(), count, uncut_active_);
  std::copy_n(uncut_, corners, triangles_), std::copy_n(uncut_active_, count, active_);
  return fans_.build(memory, nodes_, triangles_, triangle_count_, active_);
}

void CutBeside::follow(const std::int32_t* numbers, std::int32_t count, bool replayed) {
  replayed_ = replayed, shows_ = false;
  CutStream::read(numbers, count, *this);
  body_.end_changes(replayed);
  if (shows_) fans_.change_all();
}

void CutBeside::split(const CutChange& change) {
  body_.take_change(change, replayed_);
  const auto rest_of = [&](std::int32_t n) { return rest_ + 3 * static_cast<std::size_t>(body_.surface_node(n)); };
  std::copy_n(rest_of(change.new_nodes->from), 3, rest_of(change.new_nodes->node));
}

void CutBeside::remove(std::int32_t tetrahedron) {
  CutChange change;
  change.removed = &tetrahedron, change.removed_count = 1;
  body_.take_change(change, replayed_);
}

void CutBeside::triangle(std::int32_t number, const std::int32_t* corners, bool is_active) {
  std::copy_n(corners, 3, triangles_ + 3 * static_cast<std::size_t>(number));
  active_[number] = is_active, shows_ = true;
}

void CutBeside::forget() {
  body_.forget_changes(false);
  std::copy_n(uncut_, 3 * static_cast<std::size_t>(triangle_count_), triangles_);
  std::copy_n(uncut_active_, triangle_count_, active_);
  fans_.change_all();
}

void CutBeside::restore(std::int32_t count) {
  forget();
  follow(stream_.numbers(), count, true);
}

}  // namespace palpate
