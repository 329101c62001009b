#include "programs/player/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "programs/player/tool_points.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFlagNames[] = {"BAD_INPUT",     "CONTACTS_DROPPED", "REGULARISED",   "RESPONSE_RANGE",
                                      "FORCE_LIMITED", "BUNDLE_LOST",      "NOT_TOUCHABLE", "UNSOLVED",
                                      "OTHER_BUNDLE",  "TRACKING_LOST",    "WORK_DEFERRED"};
static_assert(1 << (std::size(kFlagNames) - 1) == PALPATE_STEP_WORK_DEFERRED);

Json percentiles(const std::vector<double>& values) {
  Json out;
  for (const auto& [name, share] : {std::pair{"p50", .5}, {"p90", .9}, {"p99", .99}, {"p99.9", .999}, {"max", 1.0}})
    out[name] = percentile(values, share);
  return out;
}

// The smallest box along the axes, m.
struct Extent {
  SceneConfig::Vector low, high;
  Extent() {
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
  }
  void add(const double* point) {
    for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], point[d]), high[d] = std::max(high[d], point[d]);
  }
  std::string text() const {
    std::string out;
    for (int d = 0; d < 3; ++d)
      out += fmt::format("{}{} {:.4g} .. {:.4g}", d ? ", " : "", "xyz"[d], 1e3 * low[d], 1e3 * high[d]);
    return out + " mm";
  }
};

Extent extent_of_organ(const palpate_bundle* bundle) {
  Extent extent;
  const double* nodes = palpate_bundle_nodes(bundle);
  const int count = nodes ? palpate_bundle_describe(bundle).surface_node_count : 0;
  for (int n = 0; n < count; ++n) extent.add(nodes + 3 * static_cast<std::size_t>(n));
  return extent;
}

// Of the tool's points, along the whole path.
Extent extent_of_path(const SceneConfig::Tool& tool) {
  Extent extent;
  for (const SceneConfig::Vector& point : tool_points(tool))
    for (const SceneConfig::KeyFrame& frame : tool.path) {
      const SceneConfig::Vector at = {frame.position[0] + point[0], frame.position[1] + point[1],
                                      frame.position[2] + point[2]};
      extent.add(at.data());
    }
  return extent;
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

Summary::Summary(const Player& player) : player_(player), tools_(player.scene().tools.size()) {}

void Summary::add(const TouchRecord& touch) {
  ++touches_;
  most_contact_nodes_ = std::max(most_contact_nodes_, touch.contacts.node_count);
  for (std::size_t bit = 0; bit < touches_with_flag_.size(); ++bit) touches_with_flag_[bit] += touch.flags >> bit & 1;
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
  shape_flags_ |= shape.flags;
  for (int n = 0; n < shape.node_count; ++n) {
    const float* u = shape.displacements + 3 * static_cast<std::ptrdiff_t>(n);
    largest_displacement_ = std::max(largest_displacement_, std::hypot(double{u[0]}, double{u[1]}, double{u[2]}));
  }
}

std::string Summary::text(const Timing& timing, const BundleFields& fields, const std::filesystem::path& bundle,
                          int shapes_written) const {
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
  out["largest_displacement_m"] = largest_displacement_;
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
    if (tool.first_contact_time >= 0) entry["first_contact_s"] = tool.first_contact_time;
    out["tools"].push_back(entry);
  }
  Json touches_with_flag = Json::object();
  for (std::size_t bit = 0; bit < std::size(kFlagNames); ++bit)
    if (touches_with_flag_[bit] > 0) touches_with_flag[kFlagNames[bit]] = touches_with_flag_[bit];
  out["touches_with_flag"] = touches_with_flag;
  out["shape_flags"] = flag_names(shape_flags_);
  out["timing_us"] = {{"touch", percentiles(timing.touch_us)}, {"shape", percentiles(timing.shape_us)}};
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
  return lines;
}

std::vector<std::string> Summary::remarks() const {
  std::vector<std::string> lines;
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    const SceneConfig::Tool& tool = player_.scene().tools[t];
    if (tools_[t].most_contacts > 0 || (tool.points.empty() && !tool.capsule)) continue;
    lines.push_back(
        player_.scene().collision == SceneConfig::Collision::off
            ? fmt::format("tool \"{}\" met nothing: its points touch only where collision is \"rest\" or \"deformed\"",
                          tool.name)
            : fmt::format(
                  "tool \"{}\" met nothing: its points move within {}, the organ at rest lies within {}; expected "
                  "a path that begins outside the organ and crosses its surface",
                  tool.name, extent_of_path(tool).text(), extent_of_organ(player_.bundle()).text()));
  }
  for (std::size_t bit = 0; bit < touches_with_flag_.size(); ++bit) {
    if (touches_with_flag_[bit] == 0) continue;
    const auto names = flag_names(palpate_step_flags{1} << bit);
    lines.push_back(fmt::format("{} of {} touches raised {}: docs/troubleshooting.md says what that means",
                                touches_with_flag_[bit], touches_, names.empty() ? "an unknown flag" : names.front()));
  }
  return lines;
}

}  // namespace palpate
