#include "programs/player/held_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

double length(const double (&v)[3]) {
  return std::hypot(v[0], v[1], v[2]);
}

nlohmann::ordered_json or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace

HeldSummary::HeldSummary(const PlayedOrgan& organ)
    : organ_(organ),
      links_(organ.held().links().size()),
      grasps_(organ.scene().tools.size()),
      needles_(grasps_.size()),
      given_forces_(grasps_.size()),
      loads_(organ.loads().count()),
      obstacles_(organ.obstacles().count()),
      blades_(organ.cuts().blade_count()) {}

void HeldSummary::add(double time) {
  for (std::size_t s = 0; s < links_.size(); ++s)
    links_[s].add(palpate_scene_link_state(organ_.runtime_scene(), static_cast<std::int32_t>(s)), time);
  for (std::size_t t = 0; t < grasps_.size(); ++t) {
    const auto id = static_cast<std::int32_t>(t);
    if (organ_.held().grasp(t)) add_grasp(t, time);
    if (organ_.scene().tools[t].given_force) add_given_force(t, time);
    const palpate_needle_state* needle =
        organ_.needles().of(t) ? palpate_scene_needle_state(organ_.runtime_scene(), id) : nullptr;
    if (needle) needles_[t].add(*needle, time, organ_.needles().places());
  }
  for (std::size_t i = 0; i < loads_.size(); ++i) add_load(i, time);
  for (std::size_t i = 0; i < obstacles_.size(); ++i) add_obstacle(i, time);
  for (std::size_t i = 0; i < blades_.size(); ++i) add_blade(i, time);
  if (const palpate_cut_state* const cut = OrganCuts::state(organ_.runtime_scene())) cut_.add(*cut, time);
}

void HeldSummary::add_given_force(std::size_t tool, double time) {
  const palpate_given_force_state* state =
      palpate_scene_given_force_state(organ_.runtime_scene(), static_cast<std::int32_t>(tool));
  if (!state) return;
  GivenForce& given = given_forces_[tool];
  given.touches += state->condition != PALPATE_GIVEN_FORCE_FREE;
  given.carried += state->condition == PALPATE_GIVEN_FORCE_CARRIED;
  if (const double way = length(state->displacement); way > given.farthest)
    given.farthest = way, given.farthest_time = time;
}

void HeldSummary::add_load(std::size_t i, double time) {
  const palpate_load_state* state = OrganLoads::state(organ_.runtime_scene(), i);
  if (!state) return;
  Load& load = loads_[i];
  load.area = state->area, load.peak_force = std::max(load.peak_force, length(state->force));
  if (const double way = length(state->displacement); way > load.farthest)
    load.farthest = way, load.farthest_time = time;
}

void HeldSummary::add_obstacle(std::size_t i, double time) {
  const palpate_obstacle_state* state = OrganObstacles::state(organ_.runtime_scene(), i);
  if (!state) return;
  Obstacle& obstacle = obstacles_[i];
  if (const double force = length(state->force); force > obstacle.peak_force)
    obstacle.peak_force = force, obstacle.peak_time = time;
  obstacle.peak_torque = std::max(obstacle.peak_torque, length(state->torque));
  obstacle.deepest = std::max(obstacle.deepest, state->deepest);
  obstacle.most_nodes = std::max(obstacle.most_nodes, state->nodes);
}

void HeldSummary::add_blade(std::size_t i, double time) {
  const palpate_blade_state* state = OrganCuts::blade_state(organ_.runtime_scene(), i);
  if (!state) return;
  Blade& blade = blades_[i];
  if (const double force = length(state->force); force > blade.peak_force)
    blade.peak_force = force, blade.peak_time = time;
  blade.peak_torque = std::max(blade.peak_torque, length(state->torque));
  if (state->area < blade.area) {
    blade.work_of_earlier += blade.work, blade.area_of_earlier += blade.area;
    blade.friction_work_of_earlier += blade.friction_work;
  }
  blade.work = state->work, blade.friction_work = state->friction_work, blade.area = state->area;
}

void HeldSummary::add_grasp(std::size_t tool, double time) {
  const palpate_grasp_state* state = palpate_scene_grasp_state(organ_.runtime_scene(), static_cast<std::int32_t>(tool));
  if (!state) return;
  Grasp& grasp = grasps_[tool];
  grasp.peak_force = std::max(grasp.peak_force, length(state->force));
  if (const double torque = length(state->torque); torque > grasp.peak_torque)
    grasp.peak_torque = torque, grasp.peak_torque_time = time;
  grasp.slipped = std::max(grasp.slipped, state->slipped);
  if (state->condition == PALPATE_GRASP_LET_GO && !grasp.let_go) grasp.let_go = time;
}

nlohmann::ordered_json HeldSummary::links() const {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t s = 0; s < links_.size(); ++s) {
    const LinkStretch& stretch = organ_.held().stretches()[s];
    nlohmann::ordered_json& entry = list.emplace_back();
    entry["name"] = organ_.scene().links[stretch.link].name, entry["stretch"] = stretch.part + 1;
    links_[s].put(&entry);
  }
  return list;
}

nlohmann::ordered_json HeldSummary::loads() const {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < loads_.size(); ++i)
    list.push_back({{"name", organ_.loads().name_of(i)},
                    {"area_m2", loads_[i].area},
                    {"peak_force_N", loads_[i].peak_force},
                    {"largest_displacement_m", loads_[i].farthest},
                    {"largest_displacement_s", loads_[i].farthest_time}});
  return list;
}

nlohmann::ordered_json HeldSummary::obstacles() const {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < obstacles_.size(); ++i)
    list.push_back({{"name", organ_.obstacles().of(i).name},
                    {"peak_force_N", obstacles_[i].peak_force},
                    {"peak_time_s", obstacles_[i].peak_time},
                    {"peak_torque_Nm", obstacles_[i].peak_torque},
                    {"most_nodes", obstacles_[i].most_nodes},
                    {"deepest_m", obstacles_[i].deepest}});
  return list;
}

std::optional<double> HeldSummary::first_time_of(const char* event) const {
  for (const CutEvent& one : cut_.events())
    if (std::string_view(one.what) == event) return one.time;
  return {};
}

nlohmann::ordered_json HeldSummary::blades() const {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < blades_.size(); ++i)
    if (const Blade& blade = blades_[i]; organ_.cuts().blade(i).toughness > 0)
      list.push_back({{"name", organ_.cuts().blade(i).name},
                      {"peak_force_N", blade.peak_force},
                      {"peak_time_s", blade.peak_time},
                      {"peak_torque_Nm", blade.peak_torque},
                      {"work_J", blade.work + blade.work_of_earlier},
                      {"friction_work_J", blade.friction_work + blade.friction_work_of_earlier},
                      {"area_m2", blade.area + blade.area_of_earlier}});
  return list;
}

nlohmann::ordered_json HeldSummary::cut() const {
  if (!organ_.is_cut()) return nullptr;
  const palpate_cut_state& state = cut_.state();
  auto pieces = nlohmann::ordered_json::array();
  for (const CutEvent& event : cut_.events())
    if (std::string_view(event.what) == kPieceCameOff) pieces.push_back(event.time);
  return {{"faces", state.faces},     {"area_m2", state.area},
          {"nodes", state.nodes},     {"removed", state.removed},
          {"pieces", state.pieces},   {"waiting", state.waiting},
          {"left", state.left},       {"rank", state.rank},
          {"rebased", state.rebased}, {"first_s", or_null(first_time_of(kFirstCut))},
          {"pieces_s", pieces},       {"full_s", or_null(first_time_of(kFull))}};
}

nlohmann::ordered_json HeldSummary::grasp(std::size_t tool) const {
  const palpate_grasp* of = organ_.held().grasp(tool);
  if (!of) return nullptr;
  const Grasp& grasp = grasps_[tool];
  return {{"radius_m", of->radius},           {"discs", of->opposite_triangle >= 0 ? 2 : 1},
          {"peak_force_N", grasp.peak_force}, {"peak_torque_Nm", grasp.peak_torque},
          {"slipped_m", grasp.slipped},       {"let_go_s", or_null(grasp.let_go)}};
}

nlohmann::ordered_json HeldSummary::needle(std::size_t tool) const {
  const palpate_needle* of = organ_.needles().of(tool);
  if (!of) return nullptr;
  return needles_[tool].json(*of);
}

nlohmann::ordered_json HeldSummary::given_force(std::size_t tool) const {
  const GivenForce& given = given_forces_[tool];
  return {{"largest_displacement_m", given.farthest},
          {"largest_displacement_s", given.farthest_time},
          {"touches_in_contact", given.touches},
          {"touches_carried", given.carried}};
}

std::vector<std::string> HeldSummary::lines() const {
  std::vector<std::string> lines;
  for (std::size_t t = 0; t < given_forces_.size(); ++t)
    if (organ_.scene().tools[t].given_force)
      lines.push_back(
          fmt::format("force of tool \"{}\": carried in {} of {} touches; the tool moved by {:.3g} mm, at {:.3g} s",
                      organ_.scene().tools[t].name, given_forces_[t].carried, given_forces_[t].touches,
                      1e3 * given_forces_[t].farthest, given_forces_[t].farthest_time));
  for (std::size_t s = 0; s < links_.size(); ++s) {
    if (links_[s].tension == 0) continue;
    lines.push_back(fmt::format("link \"{}\": {}", organ_.held().name_of(s), links_[s].sentence()));
  }
  for (std::size_t t = 0; t < grasps_.size(); ++t) {
    const Grasp& grasp = grasps_[t];
    if (!organ_.held().grasp(t)) continue;
    lines.push_back(fmt::format("grasp of tool \"{}\": largest torque {:.3g} N m, at {:.3g} s{}",
                                organ_.scene().tools[t].name, grasp.peak_torque, grasp.peak_torque_time,
                                grasp.let_go        ? fmt::format("; let go at {:.3g} s", *grasp.let_go)
                                : grasp.slipped > 0 ? fmt::format("; slipped by {:.3g} mm", 1e3 * grasp.slipped)
                                                    : std::string()));
  }
  for (std::size_t t = 0; t < needles_.size(); ++t)
    if (organ_.needles().of(t))
      lines.push_back(fmt::format("needle of tool \"{}\": {}", organ_.scene().tools[t].name, needles_[t].sentence()));
  for (std::size_t i = 0; i < loads_.size(); ++i)
    lines.push_back(
        fmt::format("load \"{}\": up to {:.3g} N on {:.3g} cm^2; it moved its patch by {:.3g} mm, at {:.3g} s",
                    organ_.loads().name_of(i), loads_[i].peak_force, 1e4 * loads_[i].area, 1e3 * loads_[i].farthest,
                    loads_[i].farthest_time));
  for (std::size_t i = 0; i < obstacles_.size(); ++i)
    lines.push_back(
        fmt::format("obstacle \"{}\": {}", organ_.obstacles().of(i).name,
                    obstacles_[i].most_nodes == 0
                        ? "nothing pressed it"
                        : fmt::format("largest force {:.3g} N, at {:.3g} s; up to {} nodes pressed it",
                                      obstacles_[i].peak_force, obstacles_[i].peak_time, obstacles_[i].most_nodes)));
  for (std::size_t i = 0; i < blades_.size(); ++i)
    if (const Blade& blade = blades_[i]; blade.peak_force > 0)
      lines.push_back(fmt::format("blade \"{}\": largest force {:.3g} N, at {:.3g} s; {:.3g} mJ for {:.3g} cm^2",
                                  organ_.cuts().blade(i).name, blade.peak_force, blade.peak_time,
                                  1e3 * (blade.work + blade.work_of_earlier),
                                  1e4 * (blade.area + blade.area_of_earlier)));
  if (first_time_of(kFirstCut)) {
    const palpate_cut_state& cut = cut_.state();
    const std::string of = organ_.name().empty() ? "" : fmt::format(" of organ \"{}\"", organ_.name());
    lines.push_back(fmt::format("cut{}: {} faces, {:.3g} cm^2, {} tetrahedra removed, {} {}", of, cut.faces,
                                1e4 * cut.area, cut.removed, cut.pieces, cut.pieces == 1 ? "piece" : "pieces"));
  }
  return lines;
}

std::vector<std::string> HeldSummary::warnings() const {
  constexpr double kWideJaws =
      10;  // times their radius: forceps take a fold, which is not much thicker than they are wide
  std::vector<std::string> sentences;
  for (std::size_t t = 0; t < grasps_.size(); ++t) {
    const palpate_grasp* grasp = organ_.held().grasp(t);
    const std::string& name = organ_.scene().tools[t].name;
    if (grasp && grasps_[t].let_go)
      sentences.push_back(fmt::format(
          "the grasp of tool \"{}\" let go at {:.3g} s: it was pulled beyond what friction holds; close it farther, "
          "pull less, or give it another friction",
          name, *grasps_[t].let_go));
    if (grasp && organ_.held().apart(t) > kWideJaws * grasp->radius)
      sentences.push_back(fmt::format(
          "the jaws of tool \"{}\" take hold {:.3g} mm apart, more than {:g} times their radius of {:.3g} mm; are near "
          "and opposite on one fold?",
          name, 1e3 * organ_.held().apart(t), kWideJaws, 1e3 * grasp->radius));
    if (organ_.needles().of(t) && !needles_[t].stuck().empty())
      sentences.push_back(fmt::format("the needle of tool \"{}\" was {}", name, needles_[t].stuck()));
  }
  if (organ_.is_cut() && organ_.cuts().any() && !first_time_of(kFirstCut))
    sentences.push_back(
        "nothing was cut or removed: no blade went from outside through the [cut] region of the bundle, and no removal "
        "reached it");
  if (const auto full = first_time_of(kFull))
    sentences.push_back(fmt::format(
        "from {:.4g} s on nothing more was cut: {} new nodes and rank {} are all that the bundle and the scene allow; "
        "raise `reserve` in [cut] of the boundary file, `cut_nodes` or `cut_rank` in [limits], or take `cut_rebase` "
        "there",
        *full, cut_.state().nodes, cut_.state().rank));
  return sentences;
}

}  // namespace palpate
