#include "runtime/cut/cut_scene.h"

#include <algorithm>

#include "runtime/cut/cut_rebase.h"

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
  const std::int32_t nodes = source.body.node_count + source.new_nodes;
  const auto all = static_cast<std::size_t>(nodes), reserve = 3 * static_cast<std::size_t>(source.new_nodes);
  position_ = memory.array<double>(3 * all), reserve_ = memory.array<double>(reserve);
  const auto tetrahedra = static_cast<std::size_t>(source.body.tetrahedron_count);
  held_ = memory.array<double>(tetrahedra);
  number_ = memory.array<std::int32_t>(all), node_ = memory.array<std::int32_t>(all);
  if (memory.failed()) return nullptr;
  for (std::int32_t n = 0; n < nodes; ++n)
    number_[n] = n < source.body.node_count ? n : source.first_reserve + n - source.body.node_count;
  std::copy_n(source.rest + 3 * source.first_reserve, reserve, reserve_);
  const std::int32_t logged = kLoggedOfNode * source.new_nodes + kLoggedOfTetrahedron * source.body.tetrahedron_count;
  if (!log_.create(memory, logged) || !loose_.create(memory, mesh_, source.can_hold) ||
      !surface_.create(memory, mesh_, number_))
    return nullptr;
  divided_.create(&mesh_, source.target, &surface_, source.rest);
  blades_.create(memory, source.can_hold, source.tissue, source.blade_points);
  memory.keep_array(held_, tetrahedra);
  memory.keep(removal_), memory.keep(told_), memory.keep(touch().surface.changes);
  return nullptr;
}

Lips::Source CutScene::lips(std::int32_t most) const {
  Lips::Source lips;
  lips.touch = &touch(), lips.mesh = &mesh_, lips.target = source_.target, lips.told = &told_, lips.number = number_;
  lips.surface_nodes = source_.surface_nodes, lips.new_nodes = source_.new_nodes;
  lips.faces = (surface_.capacity() - source_.body.triangle_count) / 2, lips.most = most;
  for (std::int32_t r = 0; r < source_.tissue->region_count; ++r)
    lips.shear = std::max(lips.shear, source_.tissue->laws[r].shear);
  return lips;
}

void CutScene::remove_tissue(const double* centre, double radius, double held, double needed) {
  std::copy_n(centre, 3, removal_.centre);
  removal_.radius = radius, removal_.held = held, removal_.needed = needed;
}

double CutScene::most_operations() const {
  const CutRebase* const rebase = source_.target->rebase();
  return static_cast<double>(source_.operations) +
         cost_of(CutLog::Unit::remove, source_.rank, source_.target->compliance().supports().most_foundations()) +
         (rebase ? rebase->most_operations() : 0);
}

// Operations of a unit at a rank: the products with the matrix between the patterns (measured: docs/accuracy.md, "Cuts"). foundations: of the
// tetrahedron that is removed, nine columns each.
double CutScene::cost_of(CutLog::Unit::Kind kind, std::int32_t rank, int foundations) {
  const double square = static_cast<double>(rank) * rank;
  return kind == CutLog::Unit::split ? 2e4 + square : 4e4 + 2 * square + foundations * (4e4 + 3 * square);
}

double CutScene::cost_of(const CutLog::Unit& unit, std::int32_t rank) const {
  const CutSupports& supports = source_.target->compliance().supports();
  const int foundations =
      unit.kind == CutLog::Unit::remove ? supports.foundations_of(unit.change.removed[unit.number]) : 0;
  return cost_of(unit.kind, rank, foundations);
}

void CutScene::begin_step(TouchStep&) {
  double left = static_cast<double>(source_.operations);
  follow(&left);
  if (removal_.radius > 0 || blades_.are_there()) {
    place_nodes();
    blades_.begin_step(placed(), touch().organ);
    while (!told_.is_full && log_.left() == 0 && change_mesh()) {
      take_change();
      follow(&left);
      place_nodes();
    }
  }
  source_.target->end_changes(false);
  if (CutRebase* const rebase = source_.target->rebase()) go_on(*rebase, left);
  tell_state();
}

// Gives the compliance what the log has for it, within the operations that are left. Then the surface shows the change. A body beside the touch may
// have to follow the last change first: a blade that cuts in each step would leave it no solution.
void CutScene::follow(double* left) {
  if (log_.left() == 0 || source_.target->awaits_body()) return;
  CutRebase* const rebase = source_.target->rebase();
  while (log_.left() > 0 && *left > 0) {
    if (rebase && rebase->is_short() && rebase->makes_room()) return rebase->ask();
    const CutLog::Unit unit = log_.next();
    *left -= cost_of(unit, source_.target->compliance().rank());
    const CutOutcome outcome = take(unit, false);
    *left -= source_.target->take_operations();
    if (outcome == CutOutcome::full && rebase && rebase->makes_room()) return rebase->ask();
    if (outcome != CutOutcome::made) {
      // What is tied together stays so.
      told_.is_full = 1;
      log_.drop_rest();
      break;
    }
    log_.done();
  }
  if (log_.left() == 0 && !told_.is_full) {
    surface_.show(mesh_, log_.last(), source_.touched), ++told_.surface;
    source_.target->show(surface_.all());
  }
}

// Re-basing, with what a step has left, but at least by one tile or unit.
void CutScene::go_on(CutRebase& rebase, double left) {
  if (rebase.is_due()) rebase.begin(log_.place());
  if (rebase.fills()) left -= rebase.fill_tile();
  while (rebase.fills() && left > 0) left -= rebase.fill_tile();
  bool has_all = rebase.follows(), is_first = true;
  if (has_all)
    log_.for_each_done(rebase.followed(), [&](const CutLog::Unit& unit, std::int32_t place) {
      has_all = left > 0 || is_first;
      if (!has_all) return false;
      left -= cost_of(unit, rebase.rank()), is_first = false;
      has_all = rebase.follow(place + CutLog::kUnit, [&](CutCompliance& of) { return give(unit, of); });
      left -= rebase.take_operations();
      if (!has_all) rebase.give_up();
      return has_all;
    });
  if (has_all) rebase.finish(false);
}

CutChange CutScene::change_of(const CutLog::Unit& unit) {
  CutChange one;
  if (unit.kind == CutLog::Unit::split) {
    one = unit.change;
    one.new_nodes += unit.number, one.new_node_count = 1;
    one.removed_count = 0;
  } else {
    one.removed = unit.change.removed + unit.number, one.removed_count = 1;
  }
  return one;
}

bool CutScene::give(const CutLog::Unit& unit, CutCompliance& to) {
  if (unit.kind == CutLog::Unit::hold) return to.ground(unit.number, kHoldsPiece) == CutOutcome::made;
  return to.apply(change_of(unit)).outcome == CutOutcome::made;
}

// replayed: of a state that was restored.
CutOutcome CutScene::take(const CutLog::Unit& unit, bool replayed) {
  CutTarget& target = *source_.target;
  if (unit.kind == CutLog::Unit::hold) return target.ground(unit.number, kHoldsPiece, replayed);
  const CutChange one = change_of(unit);
  const CutOutcome outcome = target.take_change(one, replayed).outcome;
  if (outcome == CutOutcome::made && unit.kind == CutLog::Unit::split) add_node(one.new_nodes->node);
  return outcome;
}

std::int32_t CutScene::write_nodes(std::int32_t* nodes, std::int32_t most) const {
  const std::int32_t first = source_.body.node_count, count = made_nodes() - first;
  for (std::int32_t i = 0; i < std::min(count, most); ++i) {
    std::int32_t from = first + i;
    while (from >= first) from = mesh_.from(from);
    nodes[2 * i] = number_[first + i], nodes[2 * i + 1] = number_[from];
  }
  return count;
}

// A new node lies where the one that it comes from lies.
void CutScene::add_node(std::int32_t n) {
  const std::int32_t node = number_[n], from = number_[mesh_.from(n)];
  std::copy_n(source_.rest + 3 * from, 3, source_.rest + 3 * node);
  touch().surface.measure.copy_tissue(node, from);
  source_.target->bring(node, load3(source_.rest + 3 * node) - load3(reserve_ + 3 * (node - source_.first_reserve)));
}

// The next of what hosts ask for: the removal, then each blade. Returns whether there was one.
bool CutScene::change_mesh() {
  if (removal_.radius > 0) {
    double centre[3];
    store3(touch().organ.point_to_organ(load3(removal_.centre)), centre);
    mesh_.remove_ball(centre, removal_.radius, position_, {held_, removal_.held, removal_.needed});
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

void CutScene::place_nodes() {
  const std::int32_t made = made_nodes();
  for (std::int32_t n = 0; n < mesh_.nodes(); ++n) {
    node_[n] = n < made ? number_[n] : node_[mesh_.from(n)];
    const std::int32_t node = node_[n];
    const bool is_known = node < source_.surface_nodes;
    store3(is_known ? touch().surface.place(node) + touch().displacement.at_node(node)
                    : load3(source_.body.nodes + 3 * static_cast<std::size_t>(n)),
           position_ + 3 * static_cast<std::size_t>(n));
  }
}

void CutScene::take_change() {
  const CutMeshChange& change = mesh_.change();
  if (change.full) told_.is_full = 1;
  if (change.tetrahedra.count == 0 && change.removed_tetrahedra.count == 0) return;
  told_.faces += change.cut_faces, told_.removed += change.removed_tetrahedra.count;
  for (std::int32_t i = change.first_triangle; i < change.end_triangle; ++i) told_.area += area_of_cut(i);
  log_change();
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

void CutScene::tell_state() {
  told_.nodes = mesh_.nodes() - source_.body.node_count, told_.pieces = mesh_.pieces().count();
  told_.waiting = mesh_.pending(), told_.left = log_.left(), told_.rank = source_.target->compliance().rank();
  const CutRebase* const rebase = source_.target->rebase();
  if (rebase) told_.rebased = rebase->count(), told_.rebasing = !rebase->is_idle();
}

// The body is at rest.
void CutScene::forget_rest() {
  source_.target->forget_changes(false);
  mesh_.forget(), log_.forget(), blades_.forget(), loose_.forget();
  removal_ = {}, told_ = {};
  std::fill_n(held_, source_.body.tetrahedron_count, 0.0);
  std::copy_n(reserve_, 3 * static_cast<std::size_t>(source_.new_nodes), source_.rest + 3 * source_.first_reserve);
  surface_.forget(mesh_, source_.touched);
  tell_state();
}

void CutScene::restored() {
  source_.target->forget_changes(true);
  const auto each = [&](std::int32_t from, auto visit) { log_.for_each_done(from, visit); };
  const auto again = [&](const CutLog::Unit& unit) { take(unit, true); };
  if (CutRebase* const rebase = source_.target->rebase())
    rebase->restore(each, again, give);
  else
    each(0, [&](const CutLog::Unit& unit, std::int32_t) { return again(unit), true; });
  source_.target->end_changes(true);
  source_.target->take_operations();  // of no step
  surface_.restored(touch());
}

}  // namespace palpate
