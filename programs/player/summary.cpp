#include "programs/player/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFlagNames[] = {"BAD_INPUT",     "CONTACTS_DROPPED",   "REGULARISED",   "RESPONSE_RANGE",
                                      "FORCE_LIMITED", "BUNDLE_LOST",        "NOT_TOUCHABLE", "UNSOLVED",
                                      "OTHER_BUNDLE",  "TRACKING_LOST",      "WORK_DEFERRED", "SOLVE_INEXACT",
                                      "DISCS_THINNED", "DEFORMATION_BEHIND", "LINK_BROKE",    "MOTION_LIMITED"};
static_assert(1 << (std::size(kFlagNames) - 1) == PALPATE_STEP_MOTION_LIMITED);

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

Summary::Summary(const Player& player) : player_(player), tools_(player.scene().tools.size()), held_(player) {
  for (std::size_t t = 0; t < tools_.size(); ++t) tools_[t].points = static_cast<int>(player.points()[t].size());
}

void Summary::add(const TouchRecord& touch) {
  ++touches_;
  most_contact_nodes_ = std::max(most_contact_nodes_, touch.contacts.node_count);
  touch_flags_.add(touch.flags);
  held_.add(touch);
  for (int n = 0; n < touch.contacts.node_count; ++n) {
    const palpate_contact_node& node = *palpate_contacts_node(&touch.contacts, n);
    if (node.tool >= 0 && node.point < tools_[node.tool].points) tools_[node.tool].point_touched = true;
  }
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    const palpate_tool_state& state = *palpate_contacts_tool(&touch.contacts, t);
    Tool& tool = tools_[t];
    tool.flags |= state.flags;
    tool.most_contacts = std::max(tool.most_contacts, state.contact_count);
    if (state.contact_count > 0 && tool.first_contact_time < 0) tool.first_contact_time = touch.time;
    const double force = std::hypot(state.force[0], state.force[1], state.force[2]);
    if (force <= tool.peak_force) continue;
    tool.peak_force = force;
    tool.peak_time = touch.time;
    std::copy_n(state.force, 3, tool.peak_force_vector.begin());
  }
}

void Summary::add(const ShapeRecord& shape) {
  ++shapes_;
  shape_flags_.add(shape.flags);
  for (int n = 0; n < shape.node_count; ++n) {
    const float* u = shape.displacements + 3 * static_cast<std::ptrdiff_t>(n);
    const double length = std::hypot(double{u[0]}, double{u[1]}, double{u[2]});
    if (length > largest_.length) largest_ = {length, shape.time, n};
  }
}

std::string Summary::text(const Timing& timing, const BundleFields& fields, const std::filesystem::path& bundle,
                          int shapes_written, const std::vector<std::string>& warnings) const {
  const SceneConfig& scene = player_.scene();
  Json out;
  out["scene"] = scene.name;
  out["bundle"] = bundle.string();
  out["provenance"] = Json::parse(fields.provenance, nullptr, false);
  out["duration_s"] = player_.duration();
  out["touches"] = touches_;
  out["shapes"] = shapes_;
  out["shapes_written"] = shapes_written;
  out["touch_hz"] = scene.touch_hz;
  out["shape_hz"] = scene.shape_hz;
  out["most_contact_nodes"] = most_contact_nodes_;
  out["largest_displacement_m"] = largest_.length;
  out["warnings"] = warnings;
  out["tools"] = Json::array();
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    const Tool& tool = tools_[t];
    Json entry = {{"name", scene.tools[t].name},
                  {"peak_force_N", tool.peak_force},
                  {"peak_force_vector_N", tool.peak_force_vector},
                  {"peak_time_s", tool.peak_time},
                  {"first_contact_s", nullptr},
                  {"most_contacts", tool.most_contacts},
                  {"flags", flag_names(tool.flags)}};
    if (const auto& capsule = scene.tools[t].capsule)
      entry["capsule"] = {{"radius_m", capsule->radius},
                          {"length_m", capsule->length},
                          {"axis", capsule->axis},
                          {"samples", capsule->samples}};
    if (scene.tools[t].disc_radius > 0) entry["radius_m"] = scene.tools[t].disc_radius;
    if (player_.held().grasp(t)) entry["grasp"] = held_.grasp(t);
    if (tool.first_contact_time >= 0) entry["first_contact_s"] = tool.first_contact_time;
    out["tools"].push_back(entry);
  }
  if (!player_.held().links().empty()) out["links"] = held_.links();
  out["touches_with_flag"] = counts_by_name(touch_flags_);
  out["shapes_with_flag"] = counts_by_name(shape_flags_);
  out["timing_us"] = {{"touch", percentiles(timing.touch_us)}, {"shape", percentiles(timing.shape_us)}};
  if (!timing.deform_us.empty()) {
    out["deform_hz"] = scene.deform_hz;
    out["timing_us"]["deform"] = percentiles(timing.deform_us);
  }
  if (!timing.skin_us.empty()) out["timing_us"]["skin"] = percentiles(timing.skin_us);
  return out.dump(2) + "\n";
}

std::vector<std::string> Summary::forces() const {
  std::vector<std::string> lines;
  for (std::size_t t = 0; t < tools_.size(); ++t)
    if (tools_[t].most_contacts > 0 && player_.scene().force != SceneConfig::Force::off)
      lines.push_back(fmt::format("tool \"{}\": largest force {:.3g} N, at {:.3g} s; first contact at {:.3g} s",
                                  player_.scene().tools[t].name, tools_[t].peak_force, tools_[t].peak_time,
                                  tools_[t].first_contact_time));
  const std::vector<std::string> held = held_.lines();
  lines.insert(lines.end(), held.begin(), held.end());
  return lines;
}

std::vector<std::string> Summary::warnings(const BundleFields& fields) const {
  std::vector<bool> touched;
  for (const Tool& tool : tools_) touched.push_back(tool.point_touched);
  std::vector<std::string> sentences = size_warnings(player_);
  for (const auto& more : {placement_warnings(player_, touched), displacement_warnings(player_, fields, largest_),
                           touch_flags_.warnings("touches"), shape_flags_.warnings("shapes")})
    sentences.insert(sentences.end(), more.begin(), more.end());
  return sentences;
}

}  // namespace palpate
