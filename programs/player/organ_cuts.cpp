#include "programs/player/organ_cuts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "formats/errors.h"
#include "formats/scene_holds.h"
#include "programs/player/tool_points.h"
#include "programs/player/tool_turn.h"

namespace palpate {
namespace {

bool is_there(const SceneConfig::Blade& blade, double time) {
  return blade.cuts.empty() ||
         std::ranges::any_of(blade.cuts, [time](const auto& row) { return row[0] <= time && time < row[1]; });
}

// Removals that have come due until a time.
std::uint64_t due_until(const SceneConfig::Removal& removal, double time) {
  constexpr double rounding = 1e-9;  // of an interval: so that 0.06 / 0.02 is 3, not 2
  std::uint64_t count = 0;
  for (const auto& [from, until] : removal.times)
    if (time >= from)
      count += static_cast<std::uint64_t>((std::min(time, until) - from) / removal.every + rounding) + 1;
  return count;
}

}  // namespace

OrganCuts::OrganCuts(const SceneConfig& scene) : file_(scene.file.string()) {
  for (const SceneConfig::Blade& blade : scene.blades) {
    const auto& [x, y, z] = blade.direction;
    const double length = std::sqrt(x * x + y * y + z * z);
    blades_.push_back({blade, blade.edge, length > 0 ? scaled(blade.direction, 1 / length) : blade.direction});
  }
  for (const SceneConfig::Removal& removal : scene.removals) removals_.push_back({removal});
}

void OrganCuts::set(palpate_scene* scene, double time) {
  for (std::size_t i = 0; i < blades_.size(); ++i) {
    auto& [of, now, direction_of_edge] = blades_[i];
    const bool is_out = !is_there(of, time);
    now.resize(is_out ? 0 : of.edge.size());  // the memory stays
    const SceneConfig::Vector place = position_at(of.path, time);
    const Rotation turn = turn_at(of.turn, time);
    for (std::size_t p = 0; p < now.size(); ++p) {
      now[p] = of.turn.empty() ? of.edge[p] : turned(turn, of.edge[p]);
      for (int d = 0; d < 3; ++d) now[p][d] += place[d];
    }
    palpate_blade blade = palpate_default_blade();
    blade.points = now.empty() ? nullptr : now[0].data(), blade.point_count = static_cast<std::int32_t>(now.size());
    blade.toughness = of.toughness, blade.friction = of.friction, blade.width = of.width;
    const SceneConfig::Vector direction = turned(turn, direction_of_edge);
    std::copy(direction.begin(), direction.end(), blade.direction);
    palpate_error error = {};
    if (palpate_scene_set_blade(scene, static_cast<std::int32_t>(i), &blade, &error) != PALPATE_OK)
      throw InputError(fmt::format("{}:{}: blade \"{}\": {}", file_, of.line, of.name, error.text));
  }
  remove_due(scene, time);
  time_ = time;
}

void OrganCuts::remove_due(palpate_scene* scene, double time) {
  if (time < time_) {  // played anew
    for (Removal& removal : removals_) removal.asked = removal.owed = 0;
    turn_ = 0;
  }
  for (Removal& removal : removals_) {
    const std::uint64_t due = due_until(removal.of, time);
    removal.owed += due - removal.asked;
    removal.asked = due;
  }
  std::size_t skipped = 0;
  while (skipped < removals_.size() && removals_[(turn_ + skipped) % removals_.size()].owed == 0) ++skipped;
  if (skipped == removals_.size()) return;
  const std::size_t next = (turn_ + skipped) % removals_.size();
  const SceneConfig::Removal& of = removals_[next].of;
  const SceneConfig::Vector place = position_at(of.path, time);
  const double held = of.contact_time > 0 ? static_cast<double>(removals_[next].owed) * of.every : 0;
  palpate_error error = {};
  if (palpate_scene_remove_tissue(scene, place.data(), of.radius, held, of.contact_time, &error) != PALPATE_OK)
    throw InputError(fmt::format("{}:{}: removal \"{}\": {}", file_, of.line, of.name, error.text));
  removals_[next].owed = 0, turn_ = next + 1;
}

bool PresentSurface::follow(const palpate_scene* scene) {
  const palpate_cut_state* const state = OrganCuts::state(scene);
  if (!state || (followed_ && state->surface == version_)) return false;
  followed_ = true, version_ = state->surface;
  const std::int32_t count = palpate_scene_cut_surface(scene, nullptr, nullptr, 0);
  triangles_.resize(3 * static_cast<std::size_t>(count)), is_lip_.resize(static_cast<std::size_t>(count));
  palpate_scene_cut_surface(scene, triangles_.data(), is_lip_.data(), count);
  return true;
}

void place_new_nodes(const palpate_scene* scene, const double* nodes, const palpate_shape_out& shape) {
  std::vector<std::int32_t> pairs(2 * static_cast<std::size_t>(palpate_scene_cut_nodes(scene, nullptr, 0)));
  const auto count = static_cast<std::int32_t>(pairs.size() / 2);
  palpate_scene_cut_nodes(scene, pairs.data(), count);
  for (std::size_t i = 0; i < pairs.size(); i += 2)
    for (std::ptrdiff_t d = 0; d < 3; ++d) {
      const std::ptrdiff_t own = 3 * std::ptrdiff_t{pairs[i]} + d, from = 3 * std::ptrdiff_t{pairs[i + 1]} + d;
      shape.displacements[own] += static_cast<float>(nodes[own] - nodes[from]);
    }
}

bool CutHistory::add(const palpate_cut_state& state, double time) {
  const auto of = [](const palpate_cut_state& s) {
    return std::tie(s.surface, s.area, s.faces, s.removed, s.nodes, s.pieces, s.waiting, s.left, s.rank, s.is_full,
                    s.rebased);
  };
  const bool begins = time_ < 0;
  if (!begins && of(state) == of(state_)) return false;
  const bool was_cut = state_.faces > 0 || state_.removed > 0;
  if (!was_cut && (state.faces > 0 || state.removed > 0)) events_.push_back({time, kFirstCut, state.pieces});
  for (int pieces = state_.pieces; !begins && pieces < state.pieces; ++pieces)
    events_.push_back({time, kPieceCameOff, pieces + 1});
  if (state.is_full && !state_.is_full) events_.push_back({time, kFull, state.pieces});
  state_ = state, time_ = time;
  return true;
}

}  // namespace palpate
