#include "runtime/cut/cut_scene.h"

#include <algorithm>

namespace palpate {
namespace {

// Numbers of the log for each new node and each tetrahedron.
constexpr std::int32_t kLoggedOfNode = 160, kLoggedOfTetrahedron = 8;
// N/m: of the springs that hold a piece which has come off.
constexpr double kHoldsPiece = 5;

}  // namespace

const char* CutScene::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  if (const char* const wrong = mesh_.create(memory, source.body, source.new_nodes)) return wrong;
  const auto nodes = static_cast<std::size_t>(source.body.node_count + source.new_nodes);
  position_ = memory.array<double>(3 * nodes);
  if (!log_.create(memory, kLoggedOfNode * source.new_nodes + kLoggedOfTetrahedron * source.body.tetrahedron_count) ||
      !loose_.create(memory, mesh_, source.can_hold) || !surface_.create(memory, mesh_, source.node))
    return nullptr;
  blades_.create(memory, source.can_hold);
  memory.keep(removal_), memory.keep(told_);
  tell();
  return nullptr;
}

void CutScene::remove_tissue(const double* centre, double radius) {
  std::copy_n(centre, 3, removal_.centre);
  removal_.radius = radius;
}

double CutScene::most_operations() const {
  return static_cast<double>(source_.operations) + cost_of(CutLog::Unit::remove, source_.rank);
}

// Operations of a unit at a rank: the products with the matrix between the patterns (measured: docs/accuracy.md, "Cuts").
double CutScene::cost_of(CutLog::Unit::Kind kind, std::int32_t rank) {
  const double square = static_cast<double>(rank) * rank;
  return kind == CutLog::Unit::split ? 2e4 + square : 4e4 + 2 * square;
}

void CutScene::begin_step(TouchStep& step) {
  TouchState& touch = *step.state;
  double left = static_cast<double>(source_.operations);
  follow(&left);
  if (removal_.radius > 0 || blades_.are_there()) {
    place_nodes(touch);
    blades_.begin_step(placed(), touch.organ);
    while (!told_.is_full && log_.left() == 0 && change_mesh(touch)) {
      take_change(touch);
      follow(&left);
    }
  }
  tell();
}

// Gives the compliance what the log has for it, within the operations that are left.
void CutScene::follow(double* left) {
  while (log_.left() > 0 && *left > 0) {
    const CutLog::Unit unit = log_.next();
    *left -= cost_of(unit.kind, source_.organ->rank());
    if (!take(unit)) {
      // What is tied together stays so.
      told_.is_full = 1;
      log_.drop_rest();
      return;
    }
    log_.done();
  }
}

bool CutScene::take(const CutLog::Unit& unit) {
  switch (unit.kind) {
    case CutLog::Unit::hold:
      return source_.organ->hold(unit.number, kHoldsPiece) == CutOutcome::made;
    case CutLog::Unit::split:
      return source_.organ->split(unit.change, unit.number) == CutOutcome::made;
    case CutLog::Unit::remove:
      break;
  }
  return source_.organ->remove(unit.change, unit.number) == CutOutcome::made;
}

// The next of what hosts ask for: the removal, then each blade. Returns whether there was one.
bool CutScene::change_mesh(const TouchState& touch) {
  if (removal_.radius > 0) {
    double centre[3];
    store3(touch.organ.point_to_organ(load3(removal_.centre)), centre);
    mesh_.remove_ball(centre, removal_.radius, position_);
    removal_.radius = 0;
    blades_.leave([&](std::int32_t t) { return mesh_.is_removed(t); });
    return true;
  }
  const std::int32_t blade = blades_.next();
  if (blade < 0) return false;
  mesh_.blade(blades_.sweep(blade, placed()), position_);
  blades_.followed(blade);
  return true;
}

void CutScene::place_nodes(const TouchState& touch) {
  for (std::int32_t n = 0; n < mesh_.nodes(); ++n) {
    const std::int32_t node = source_.node[n];
    const bool is_known = node < source_.surface_nodes;
    store3(is_known ? touch.surface.place(node) + touch.displacement.at_node(node) : load3(source_.body.nodes + 3 * n),
           position_ + 3 * n);
  }
}

void CutScene::take_change(TouchState& touch) {
  const CutMeshChange& change = mesh_.change();
  if (change.full) told_.is_full = 1;
  if (change.tetrahedra.count == 0 && change.removed_tetrahedra.count == 0) return;
  ++told_.surface;
  told_.faces += change.cut_faces, told_.removed += change.removed_tetrahedra.count;
  for (std::int32_t i = change.first_triangle; i < change.end_triangle; ++i) told_.area += area_of_cut(i);
  for (std::int32_t n = change.first_node; n < change.end_node; ++n) {
    std::copy_n(position_ + 3 * mesh_.from(n), 3, position_ + 3 * n);
    add_node(touch, n);
  }
  log_change();
  surface_.take_change(mesh_, touch);
}

// m^2, at rest, of a new triangle: of the two lips of a cut face one counts.
double CutScene::area_of_cut(std::int32_t triangle) const {
  const RestMesh& rest = mesh_.state().rest();
  const std::int32_t face = mesh_.surface().face(triangle);
  if (face < 0 || mesh_.state().face(face) != FaceState::cut || rest.neighbour(face) < face / 4) return 0;
  const auto at = [&](int c) {
    return load3(rest.body().nodes + 3 * rest.nodes_of(face / 4)[kFaceCorners[face % 4][c]]);
  };
  return 0.5 * length(cross(at(1) - at(0), at(2) - at(0)));
}

// Old nodes of pieces that come off are held before the change, new ones as soon as they are there.
void CutScene::log_change() {
  const CutMeshChange& change = mesh_.change();
  if (!log_.has_room(CutLog::numbers_of(change))) {
    told_.is_full = 1;
    return;
  }
  log_.add(mesh_);
  std::int32_t held[CutLog::kMostHolds], count = 0;
  loose_.each_new_hold([&](std::int32_t node) {
    if (count < CutLog::kMostHolds) held[count++] = node;
  });
  for (std::int32_t i = 0; i < count; ++i)
    if (held[i] < change.first_node) log_.add(CutLog::Unit::hold, held[i]);
  for (std::int32_t n = change.first_node; n < change.end_node; ++n) {
    log_.add(CutLog::Unit::split, n - change.first_node);
    if (std::find(held, held + count, n) != held + count) log_.add(CutLog::Unit::hold, n);
  }
  for (std::int32_t i = 0; i < change.removed_tetrahedra.count; ++i) log_.add(CutLog::Unit::remove, i);
}

// A new node lies where the one that it comes from lies, and has its column.
void CutScene::add_node(TouchState& touch, std::int32_t n) {
  const std::int32_t node = source_.node[n], from = source_.node[mesh_.from(n)];
  std::copy_n(touch.surface.rest + 3 * from, 3, source_.rest + 3 * node);
  touch.surface.column_of_node[node] = touch.surface.column_of_node[from];
  source_.organ->add_node(n, mesh_.from(n));
}

void CutScene::tell() {
  told_.nodes = mesh_.nodes() - source_.body.node_count, told_.pieces = mesh_.pieces().count();
  told_.waiting = mesh_.pending(), told_.left = log_.left(), told_.rank = source_.organ->rank();
}

void CutScene::forget_rest() {
  mesh_.forget(), log_.forget(), blades_.forget(), loose_.forget();
  removal_ = {}, told_ = {};
  source_.organ->forget_cut();
  surface_.take_all(mesh_, *source_.touch);
  tell();
}

void CutScene::restored() {
  source_.organ->forget_cut();
  for (std::int32_t n = source_.body.node_count; n < mesh_.nodes(); ++n) add_node(*source_.touch, n);
  log_.for_each_done([&](const CutLog::Unit& unit) { take(unit); });
  surface_.restored(mesh_, *source_.touch);
}

}  // namespace palpate
