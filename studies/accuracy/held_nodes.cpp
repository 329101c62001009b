#include "studies/accuracy/held_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <palpate/palpate.hpp>

#include "formats/errors.h"
#include "studies/timing/timing.h"

namespace palpate::accuracy {
namespace {

constexpr double kTick = 1e-3, kStep = 1e-4;  // s, m
constexpr unsigned kAllowed = PALPATE_STEP_RESPONSE_RANGE | PALPATE_STEP_DEFORMATION_BEHIND;

SceneDef definition(std::size_t nodes, HeldModel model) {
  SceneDef def;
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE;
  def.max_tools = 1, def.max_points = static_cast<std::int32_t>(nodes);
  def.max_contact_nodes = 3 * def.max_points;
  def.force_limit = def.force_slew = INFINITY;
  if (model == HeldModel::response) def.force = PALPATE_FORCE_RESPONSE, def.radial = PALPATE_RADIAL_RESPONSE;
  if (model == HeldModel::large)
    def.large.deformation = PALPATE_DEFORMATION_LARGE;
  else
    def.max_operations = INT64_MAX;  // all nodes are held at once and exactly
  return def;
}

// A scene whose one tool grips nodes.
class Grips {
 public:
  Grips(const Bundle& bundle, std::span<const std::int32_t> nodes, HeldModel model)
      : scene_(bundle, definition(nodes.size(), model)),
        contacts_(scene_.make_contacts()),
        grips_(nodes.size(), palpate_default_grip()),
        u_(3 * static_cast<std::size_t>(bundle.describe().surface_node_count)) {
    for (std::size_t g = 0; g < grips_.size(); ++g) grips_[g].kind = PALPATE_GRIP_NODE, grips_[g].node = nodes[g];
    tool_.grips = grips_.data(), tool_.grip_count = static_cast<std::int32_t>(grips_.size());
  }

  void displace(std::size_t grip, Vec3 by) { store3(by, grips_[grip].displacement); }
  unsigned touch() { return scene_.touch(&tool_, 1, kTick, contacts_); }
  unsigned shape() {
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = u_.data(), out.node_capacity = static_cast<std::int32_t>(u_.size() / 3);
    return scene_.shape(contacts_, out);
  }
  HeldAnswer answer() const {
    HeldAnswer answer;
    for (std::size_t n = 0; 3 * n < u_.size(); ++n) answer.u.push_back({u_[3 * n], u_[3 * n + 1], u_[3 * n + 2]});
    answer.force = -1 * load3(contacts_.tool(0).force_raw);
    return answer;
  }
  double bytes() const {
    double sum = 0;
    for (std::int32_t pass = 0; const palpate_plan_pass* part = palpate_scene_plan(scene_.get(), pass); ++pass)
      sum += static_cast<double>(part->memory_bytes);
    return sum;
  }

 private:
  Scene scene_;
  Contacts contacts_;
  std::vector<palpate_grip> grips_;
  palpate_tool tool_ = palpate_default_tool();
  std::vector<float> u_;
};

[[noreturn]] void refuse(const std::filesystem::path& file, std::size_t nodes, unsigned flags) {
  throw OperationError(fmt::format("{}: holding {} nodes raised flags {}", file.string(), nodes, flags));
}

}  // namespace

HeldAnswer hold_nodes(const std::filesystem::path& file, std::span<const std::int32_t> nodes,
                      std::span<const Vec3> displacement) {
  const Bundle bundle(file.c_str());
  Grips grips(bundle, nodes, HeldModel::linear);
  for (std::size_t g = 0; g < nodes.size(); ++g) grips.displace(g, displacement[g]);
  if (const unsigned flags = grips.touch() | grips.shape()) refuse(file, nodes.size(), flags);
  return grips.answer();
}

HeldPath move_nodes(const std::filesystem::path& file, std::span<const std::int32_t> nodes, Vec3 direction,
                    std::span<const double> depths, HeldModel model) try {
  const Bundle bundle(file.c_str());
  Grips grips(bundle, nodes, model);
  palpate_error ignored;
  palpate_bundle_prefault(bundle.get(), 0, &ignored);
  HeldPath path;
  path.scene_bytes = grips.bytes();
  std::vector<double> touch_us, shape_us;
  unsigned flags = 0;
  for (int tick = 0; path.at.size() < depths.size(); ++tick) {
    const double depth = std::min(tick * kStep, depths[path.at.size()]);
    for (std::size_t g = 0; g < nodes.size(); ++g) grips.displace(g, depth * direction);
    const auto begun = studies::Clock::now();
    flags |= grips.touch();
    if (tick > 0) touch_us.push_back(1e6 * studies::seconds_since(begun));
    if (depth < depths[path.at.size()]) continue;
    const auto shaped = studies::Clock::now();
    flags |= grips.shape();
    shape_us.push_back(1e6 * studies::seconds_since(shaped));
    path.at.push_back(grips.answer());
  }
  if ((flags & ~kAllowed) != 0) refuse(file, nodes.size(), flags);
  path.touch_us = studies::percentile(touch_us, 0.5), path.touch_us_most = studies::percentile(touch_us, 0.99);
  path.shape_us = studies::percentile(shape_us, 0.5);
  return path;
} catch (const Error& error) {
  throw OperationError(fmt::format("{}: {}", file.string(), error.what()));
}

}  // namespace palpate::accuracy
