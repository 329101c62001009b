#include "programs/player/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "programs/player/csv_table.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFlagNames[] = {
    "BAD_INPUT",     "CONTACTS_DROPPED",   "REGULARISED",  "RESPONSE_RANGE", "FORCE_LIMITED", "BUNDLE_LOST",
    "NOT_TOUCHABLE", "UNSOLVED",           "OTHER_BUNDLE", "TRACKING_LOST",  "WORK_DEFERRED", "SOLVE_INEXACT",
    "DISCS_THINNED", "DEFORMATION_BEHIND", "LINK_BROKE",   "MOTION_LIMITED", "FRICTION_JAMS", "SURFACE_CROSSES"};
static_assert(1 << (std::size(kFlagNames) - 1) == PALPATE_STEP_SURFACE_CROSSES);

Json percentiles(const std::vector<double>& values) {
  Json out;
  for (const auto& [name, share] : {std::pair{"p50", .5}, {"p90", .9}, {"p99", .99}, {"p99.9", .999}, {"max", 1.0}})
    out[name] = percentile(values, share);
  return out;
}

Json counts_by_name(const FlagCounts& flags) {
  Json out = Json::object();
  for (std::size_t bit = 0; bit < std::size(kFlagNames); ++bit)
    if (flags.steps_with()[bit] > 0) out[kFlagNames[bit]] = flags.steps_with()[bit];
  return out;
}

Json json_of(const CrossingsSummary& crossings) {
  Json out = {{"checks", crossings.checks}, {"most_pairs", crossings.most_pairs}, {"first_s", nullptr}};
  if (!crossings.first) return out;
  out["first_s"] = crossings.first_time;
  out["triangles"] = crossings.first->triangle;
  out["place_m"] = crossings.first->place, out["rest_m"] = crossings.first->rest;
  return out;
}

std::vector<NamedOrgan> named_organs(const WorldPlayer& player) {
  std::vector<NamedOrgan> organs;
  for (std::size_t k = 0; k < player.organ_count(); ++k)
    organs.push_back({&player.organ(k), player.scene().organs[k].name, player.pose(k)});
  return organs;
}

}  // namespace

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()) * (1 - 1e-12)));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::vector<std::string> flag_names(palpate_step_flags flags) {
  std::vector<std::string> names;
  for (std::size_t bit = 0; bit < std::size(kFlagNames); ++bit)
    if (flags >> bit & 1) names.emplace_back(kFlagNames[bit]);
  return names;
}

Summary::Summary(const SceneConfig& scene, const std::vector<std::vector<SceneConfig::Vector>>& points,
                 const std::vector<NamedOrgan>& organs)
    : scene_(scene), tools_(scene.tools.size()) {
  for (std::size_t t = 0; t < tools_.size(); ++t) tools_[t].points = static_cast<int>(points[t].size());
  for (const NamedOrgan& organ : organs) organs_.push_back({organ, HeldSummary(*organ.organ)});
}

Summary::Summary(const Player& player) : Summary(player.scene(), player.points(), {{&player.organ(), {}}}) {}

Summary::Summary(const WorldPlayer& player) : Summary(player.scene(), player.points(), named_organs(player)) {
  if (!player.links().empty()) links_.emplace(player.scene(), player.links(), player.runtime_world());
}

template <typename State>
void Summary::add_tool(double time, std::size_t t, const State& state) {
  Tool& tool = tools_[t];
  tool.flags |= state.flags;
  tool.most_contacts = std::max(tool.most_contacts, state.contact_count);
  if (state.contact_count > 0 && tool.first_contact_time < 0) tool.first_contact_time = time;
  const double force = std::hypot(state.force[0], state.force[1], state.force[2]);
  if (force <= tool.peak_force) return;
  tool.peak_force = force;
  tool.peak_time = time;
  std::copy_n(state.force, 3, tool.peak_force_vector.begin());
}

void Summary::add_nodes(Organ& organ, double time, const palpate_contacts& contacts) {
  organ.most_contact_nodes = std::max(organ.most_contact_nodes, contacts.node_count);
  organ.held.add(time);
  for (int n = 0; n < contacts.node_count; ++n) {
    const palpate_contact_node& node = *palpate_contacts_node(&contacts, n);
    if (node.source == PALPATE_SOURCE_TOOL && node.point < tools_[node.index].points)
      tools_[node.index].point_touched = true;
  }
}

void Summary::add(const TouchRecord& touch) {
  ++touches_;
  touch_flags_.add(touch.flags);
  lost_.add(touch.time, touch.contacts);
  add_nodes(organs_[0], touch.time, touch.contacts);
  for (std::size_t t = 0; t < tools_.size(); ++t)
    add_tool(touch.time, t, *palpate_contacts_tool(&touch.contacts, static_cast<std::int32_t>(t)));
}

void Summary::add(const WorldTouchRecord& touch) {
  ++touches_;
  touch_flags_.add(touch.flags);
  for (std::size_t t = 0; t < tools_.size(); ++t)
    add_tool(touch.time, t, *palpate_world_contacts_tool(&touch.contacts, static_cast<std::int32_t>(t)));
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    const auto index = static_cast<std::int32_t>(k);
    add_nodes(organs_[k], touch.time, *palpate_world_contacts_organ(&touch.contacts, index));
    const double* by_others = palpate_world_contacts_state(&touch.contacts, index)->pressed;
    const double pressed = std::hypot(by_others[0], by_others[1], by_others[2]);
    if (pressed > organs_[k].peak_pressed) organs_[k].peak_pressed = pressed, organs_[k].peak_pressed_time = touch.time;
  }
  if (links_) links_->add(touch.time);
  most_pairs_ = std::max(most_pairs_, touch.contacts.pair_count);
  for (int p = 0; p < touch.contacts.pair_count; ++p) {
    const palpate_world_pair& pair = *palpate_world_contacts_pair(&touch.contacts, p);
    peak_pressure_ = std::max(peak_pressure_, pair.pressure);
    largest_overlap_ = std::max(largest_overlap_, pair.overlap);
  }
}

void Summary::add(const ShapeRecord& shape, std::size_t organ) {
  if (organ == 0) ++shapes_;
  shape_flags_.add(shape.flags);
  if (shape.crossings) organs_[organ].crossings.add(shape.time, shape.crossings->found());
  LargestDisplacement& largest = organs_[organ].largest;
  for (int n = 0; n < shape.node_count; ++n) {
    const float* u = shape.displacements + 3 * static_cast<std::ptrdiff_t>(n);
    const double length = std::hypot(double{u[0]}, double{u[1]}, double{u[2]});
    if (length > largest.length) largest = {length, shape.time, n};
  }
}

std::string Summary::text(const Timing& timing, const std::vector<BundleFields>& fields, int shapes_written,
                          const std::vector<std::string>& warnings, int digits) const {
  Json out;
  out["scene"] = scene_.name;
  const auto add_bundle = [&](Json& to, std::size_t organ) {
    to["bundle"] = organs_[organ].of.organ->bundle_file().string();
    to["provenance"] = nullptr;  // below
  };
  const auto add_moved = [&](Json& to, const Organ& organ) {
    to["most_contact_nodes"] = organ.most_contact_nodes;
    to["largest_displacement_m"] = organ.largest.length;
    if (organ.of.organ->crossings()) to["crossings"] = json_of(organ.crossings);
  };
  const bool one_organ = scene_.organs.empty();
  if (one_organ) add_bundle(out, 0);
  out["duration_s"] = duration_of(scene_);
  out["touches"] = touches_;
  out["shapes"] = shapes_;
  out["shapes_written"] = shapes_written;
  out["touch_hz"] = scene_.touch_hz;
  out["shape_hz"] = scene_.shape_hz;
  if (one_organ) add_moved(out, organs_[0]);
  out["warnings"] = warnings;
  for (std::size_t k = 0; k < organs_.size() && !one_organ; ++k) {
    Json organ = {{"name", organs_[k].of.name}};
    add_bundle(organ, k), add_moved(organ, organs_[k]);
    organ["peak_pressed_N"] = organs_[k].peak_pressed;
    if (!organs_[k].of.organ->held().links().empty()) organ["links"] = organs_[k].held.links();
    if (organs_[k].of.organ->loads().any()) organ["loads"] = organs_[k].held.loads();
    if (organs_[k].of.organ->obstacles().any()) organ["obstacles"] = organs_[k].held.obstacles();
    if (organs_[k].of.organ->is_cut()) organ["cut"] = organs_[k].held.cut();
    if (organs_[k].of.organ->cuts().feels()) organ["blades"] = organs_[k].held.blades();
    out["organs"].push_back(organ);
  }
  if (scene_.pairs > 0)
    out["pairs"] = {
        {"most", most_pairs_}, {"peak_pressure_Pa", peak_pressure_}, {"largest_overlap_m", largest_overlap_}};
  if (links_) out["links"] = links_->json();
  out["tools"] = Json::array();
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    const Tool& tool = tools_[t];
    Json entry = {{"name", scene_.tools[t].name},
                  {"peak_force_N", tool.peak_force},
                  {"peak_force_vector_N", tool.peak_force_vector},
                  {"peak_time_s", tool.peak_time},
                  {"first_contact_s", nullptr},
                  {"most_contacts", tool.most_contacts},
                  {"flags", flag_names(tool.flags)}};
    if (const auto& capsule = scene_.tools[t].capsule)
      entry["capsule"] = {{"radius_m", capsule->radius},
                          {"length_m", capsule->length},
                          {"axis", capsule->axis},
                          {"samples", capsule->samples}};
    if (scene_.tools[t].disc_radius > 0) entry["radius_m"] = scene_.tools[t].disc_radius;
    const Organ& held = organs_[scene_.tools[t].organ];
    if (held.of.organ->held().grasp(t)) entry["grasp"] = held.held.grasp(t);
    if (held.of.organ->needles().of(t)) entry["needle"] = held.held.needle(t);
    if (scene_.tools[t].given_force) entry["given_force"] = held.held.given_force(t);
    if (tool.first_contact_time >= 0) entry["first_contact_s"] = tool.first_contact_time;
    out["tools"].push_back(entry);
  }
  if (one_organ && !organs_[0].of.organ->held().links().empty()) out["links"] = organs_[0].held.links();
  if (one_organ && organs_[0].of.organ->loads().any()) out["loads"] = organs_[0].held.loads();
  if (one_organ && organs_[0].of.organ->obstacles().any()) out["obstacles"] = organs_[0].held.obstacles();
  if (one_organ && organs_[0].of.organ->is_cut()) out["cut"] = organs_[0].held.cut();
  if (one_organ && organs_[0].of.organ->cuts().feels()) out["blades"] = organs_[0].held.blades();
  out["touches_with_flag"] = counts_by_name(touch_flags_);
  out["shapes_with_flag"] = counts_by_name(shape_flags_);
  out["timing_us"] = {{"touch", percentiles(timing.touch_us)}, {"shape", percentiles(timing.shape_us)}};
  if (!timing.deform_us.empty()) {
    out["deform_hz"] = scene_.deform_hz;
    out["timing_us"]["deform"] = percentiles(timing.deform_us);
  }
  if (!timing.skin_us.empty()) out["timing_us"]["skin"] = percentiles(timing.skin_us);
  if (!timing.inside_us.empty()) out["timing_us"]["inside"] = percentiles(timing.inside_us);
  if (!timing.crossings_us.empty()) out["timing_us"]["crossings"] = percentiles(timing.crossings_us);
  out = rounded(out, digits);
  for (std::size_t k = 0; k < organs_.size(); ++k)
    (one_organ ? out : out["organs"][k])["provenance"] = Json::parse(fields[k].provenance, nullptr, false);
  return out.dump(2) + "\n";
}

std::vector<std::string> Summary::forces() const {
  std::vector<std::string> lines;
  const auto has_force = [](const Organ& organ) { return organ.of.organ->scene().def.force != PALPATE_FORCE_OFF; };
  for (std::size_t t = 0; t < tools_.size(); ++t)
    if (tools_[t].most_contacts > 0 && std::any_of(organs_.begin(), organs_.end(), has_force))
      lines.push_back(fmt::format("tool \"{}\": largest force {:.3g} N, at {:.3g} s; first contact at {:.3g} s",
                                  scene_.tools[t].name, tools_[t].peak_force, tools_[t].peak_time,
                                  tools_[t].first_contact_time));
  for (const Organ& organ : organs_) {
    if (organ.peak_pressed > 0)
      lines.push_back(fmt::format("organ \"{}\": other organs press with up to {:.3g} N, at {:.3g} s", organ.of.name,
                                  organ.peak_pressed, organ.peak_pressed_time));
    const std::vector<std::string> held = organ.held.lines();
    lines.insert(lines.end(), held.begin(), held.end());
  }
  if (!links_) return lines;
  const std::vector<std::string> between = links_->lines();
  lines.insert(lines.end(), between.begin(), between.end());
  return lines;
}

std::vector<std::string> Summary::warnings(const std::vector<BundleFields>& fields) const {
  std::vector<bool> touched;
  for (const Tool& tool : tools_) touched.push_back(tool.point_touched);
  std::vector<std::string> sentences;
  const auto append = [&](const std::vector<std::string>& more) {
    sentences.insert(sentences.end(), more.begin(), more.end());
  };
  std::vector<NamedOrgan> organs;
  for (const Organ& organ : organs_)
    organs.push_back(organ.of), append(organ.of.organ->log().warnings), append(size_warnings(organ.of));
  append(placement_warnings(scene_, organs, touched));
  for (std::size_t k = 0; k < organs_.size(); ++k)
    append(organs_[k].held.warnings()), append(displacement_warnings(organs_[k].of, fields[k], organs_[k].largest));
  append(lost_.warnings());
  append(touch_flags_.warnings("touches"));
  append(shape_flags_.warnings("shapes"));
  for (const Organ& organ : organs_)
    if (const auto& first = organ.crossings.first)
      sentences.push_back(fmt::format(
          "{}the surface passes through itself from {:.4g} s on: triangles {} and {} at {:.1f} {:.1f} {:.1f} mm; "
          "nothing in the library keeps an organ's surface apart from itself",
          organ.of.name.empty() ? "" : fmt::format("organ \"{}\": ", organ.of.name), organ.crossings.first_time,
          first->triangle[0], first->triangle[1], 1e3 * first->place[0], 1e3 * first->place[1], 1e3 * first->place[2]));
  return sentences;
}

}  // namespace palpate
