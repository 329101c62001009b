#include "programs/player/summary.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFlagNames[] = {"BAD_INPUT",     "CONTACTS_DROPPED", "REGULARISED",   "RESPONSE_RANGE",
                                      "FORCE_LIMITED", "BUNDLE_LOST",      "NOT_TOUCHABLE", "UNSOLVED"};
static_assert(1 << (std::size(kFlagNames) - 1) == PALPATE_STEP_UNSOLVED);

Json percentiles(const std::vector<double>& values) {
  Json out;
  for (const auto& [name, share] : {std::pair{"p50", .5}, {"p90", .9}, {"p99", .99}, {"p99.9", .999}, {"max", 1.0}})
    out[name] = percentile(values, share);
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

Summary::Summary(const Player& player) : player_(player), tools_(player.scene().tools.size()) {}

void Summary::add(const TouchRecord& touch) {
  ++touches_;
  most_contact_nodes_ = std::max(most_contact_nodes_, touch.contacts.node_count);
  for (std::size_t bit = 0; bit < touches_with_flag_.size(); ++bit) touches_with_flag_[bit] += touch.flags >> bit & 1;
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    const palpate_tool_state& state = touch.contacts.tools[t];
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
    if (scene.tools[t].radius > 0) entry["radius_m"] = scene.tools[t].radius;
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

}  // namespace palpate
